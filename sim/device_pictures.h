#pragma once
#include <Eigen/Geometry>
#include <memory>
#include <span>

#include "sim/device.h"
#include "sim/render/depth_camera.h"

namespace flash::sim {

/// Draws depth pictures on a CUDA device, the same as `render` does on the processor but where two meshes are
/// at one depth to rounding. Throws a DeviceError where the device is lost, OutOfDeviceMemory where its
/// memory does not suffice.
class DevicePictures {
 public:
  /// Takes copies of the triangles of meshes, and of the vertices that those have which are the same in all
  /// pictures. Throws data::InputError for more than most_meshes, and where this program was built
  /// without CUDA.
  DevicePictures(int cuda_device, std::span<const SeenMesh> meshes);
  ~DevicePictures();

  /// As sim::render, of the same meshes in the same order. Vertices that were not copied are in the memory of
  /// the device. `at`: whose memory the pictures are in. They are there when it returns. What others have
  /// queued on the device's default stream comes before.
  void render(const data::CameraIntrinsics& camera, std::span<const Eigen::Isometry3d> base_from_camera,
              std::span<const SeenMesh> meshes, const DepthPictures& pictures, Device at);

 private:
  struct Storage;
  std::unique_ptr<Storage> storage_;
};

}  // namespace flash::sim
