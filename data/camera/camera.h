#pragma once
#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

namespace flash::data {

enum class DistortionModel { none, plumb_bob, rational_polynomial };

/// Pinhole camera, optical frame (x right, y down, z forward); pixel (0, 0) is the centre of the upper left
/// pixel.
struct CameraIntrinsics {
  int width = 0, height = 0;              ///< [px]
  double fx = 0, fy = 0, cx = 0, cy = 0;  ///< [px]
  DistortionModel model = DistortionModel::none;
  std::vector<double> distortion;  ///< k1 k2 p1 p2 k3 (plumb_bob) and k4 k5 k6 (rational_polynomial)
};

/// ROS camera_info YAML (camera_matrix, distortion_coefficients, image_width) or OpenCV YAML (FileStorage
/// matrices under the names OpenCV's calibration writes). Throws InputError naming file and field.
CameraIntrinsics load_camera_intrinsics(const std::string& path);
void save_camera_info(const CameraIntrinsics& camera, const std::string& path,
                      const std::string& name = "camera");

/// Pixel of a point in the camera frame; empty where it lies behind the camera. OpenCV's distortion formula.
std::optional<Eigen::Vector2d> project(const CameraIntrinsics& camera, const Eigen::Vector3d& point);

/// Point at depth z [m] seen at the pixel; distortion is inverted by Newton's method.
Eigen::Vector3d unproject(const CameraIntrinsics& camera, const Eigen::Vector2d& pixel, double depth);

}  // namespace flash::data
