#include "sim/device_pictures.h"

#include "data/files/error.h"
#ifdef FLASH_HAVE_CUDA
#include <algorithm>
#include <cstdint>
#include <vector>

#include "sim/ask_device.h"
#include "sim/cuda/depth_kernels.h"
#include "sim/cuda/device_array.h"
#include "sim/cuda/devices.h"
#include "sim/law/rigid_frame.h"
#endif

namespace flash::sim {

#ifdef FLASH_HAVE_CUDA

using cuda::DeviceArray;
using Eigen::Isometry3d;

namespace {

/// What the pictures that are drawn together may need beside themselves [bytes]: keys, vertices as they are
/// seen, and triangles that wait. With 32 MB, which stay in the second cache of an H200, pictures took a
/// tenth longer there.
constexpr std::size_t memory_at_once = 200'000'000;
constexpr std::size_t most_at_once = 65'535;  // blocks of a grid along its second axis

/// Moves pictures on by so many pixels; those that are not wanted stay so.
DepthPictures from_pixel(DepthPictures pictures, std::size_t pixel) {
  if (pictures.depth) pictures.depth += pixel;
  if (pictures.distance) pictures.distance += pixel;
  if (pictures.instance) pictures.instance += pixel;
  if (pictures.triangle) pictures.triangle += pixel;
  if (pictures.points) pictures.points += 3 * pixel;
  return pictures;
}

/// Pictures of a batch in the memory of the device, on their way to the host.
struct Way {
  DeviceArray<float> depth, distance, points;
  DeviceArray<std::uint8_t> instance;
  DeviceArray<std::int32_t> triangle;

  DepthPictures take(const DepthPictures& wanted, std::size_t pixels) {
    const auto room = [](auto& array, const auto* for_what, std::size_t count) {
      if (for_what) array.hold(count);
      return for_what ? array.data() : nullptr;
    };
    return {room(depth, wanted.depth, pixels), room(distance, wanted.distance, pixels),
            room(instance, wanted.instance, pixels), room(triangle, wanted.triangle, pixels),
            room(points, wanted.points, 3 * pixels)};
  }
  void bring(const DepthPictures& to, std::size_t pixels) const {
    const auto read = [](const auto& array, auto* where, std::size_t count) {
      if (where) array.read(0, count, where);
    };
    read(depth, to.depth, pixels);
    read(distance, to.distance, pixels);
    read(instance, to.instance, pixels);
    read(triangle, to.triangle, pixels);
    read(points, to.points, 3 * pixels);
  }
};

}  // namespace

struct DevicePictures::Storage {
  int device = 0;
  std::vector<DeviceArray<int>> corners;      // of each mesh
  std::vector<DeviceArray<double>> vertices;  // of each mesh that has the same in all pictures
  std::vector<cuda::DrawnMesh> meshes;
  std::size_t all_triangles = 0, all_vertices = 0;
  DeviceArray<cuda::DrawnMesh> drawn;  // the same
  DeviceArray<SeenVertex> seen;
  DeviceArray<cuda::PlacedMesh> placed;
  DeviceArray<Frame<double>> frames;
  DeviceArray<std::uint64_t> yielding, solid;
  DeviceArray<cuda::LargeTriangle> large;
  DeviceArray<unsigned> large_count;
  Way way;
};

DevicePictures::DevicePictures(int cuda_device, std::span<const SeenMesh> meshes)
    : storage_(std::make_unique<Storage>()) {
  if (meshes.size() > most_meshes)
    throw data::InputError("meshes: found " + std::to_string(meshes.size()) + ", expected " +
                           std::to_string(most_meshes) + " at most");
  Storage& s = *storage_;
  s.device = cuda_device;
  ask_device([&] {
    cuda::use_device(s.device);
    for (const SeenMesh& mesh : meshes) {
      const int* corners = mesh.triangles->data();
      s.corners.emplace_back(std::vector<int>(corners, corners + mesh.triangles->size()));
      const double* x = mesh.vertices.empty() ? nullptr : mesh.vertices.front();
      s.vertices.emplace_back(x ? std::vector<double>(x, x + 3 * mesh.vertex_count) : std::vector<double>());
      s.meshes.push_back({.corners = s.corners.back().data(),
                          .triangles = static_cast<int>(mesh.triangles->rows()),
                          .vertices = static_cast<int>(mesh.vertex_count),
                          .first_vertex = static_cast<int>(s.all_vertices),
                          .first = static_cast<std::uint32_t>(s.all_triangles),
                          .yields = mesh.yields});
      s.all_triangles += static_cast<std::size_t>(mesh.triangles->rows());
      s.all_vertices += static_cast<std::size_t>(mesh.vertex_count);
    }
    s.drawn = DeviceArray<cuda::DrawnMesh>(s.meshes);
    s.large_count = DeviceArray<unsigned>(1);
  });
}

DevicePictures::~DevicePictures() = default;

void DevicePictures::render(const data::CameraIntrinsics& camera,
                            std::span<const Isometry3d> base_from_camera, std::span<const SeenMesh> meshes,
                            const DepthPictures& pictures, Device at) {
  const Pinhole lens = pinhole_of(camera);
  if (base_from_camera.empty()) return;
  ask_device([&] {
    Storage& s = *storage_;
    cuda::use_device(s.device);
    std::vector<cuda::PlacedMesh> placed;
    std::vector<Frame<double>> frames;
    for (std::size_t k = 0; k < base_from_camera.size(); ++k) {
      frames.push_back(frame_of(base_from_camera[k]));
      const Isometry3d camera_from_base = base_from_camera[k].inverse();
      for (std::size_t m = 0; m < meshes.size(); ++m) {
        const SeenMesh& mesh = meshes[m];
        const double* there = s.vertices[m].data();
        const double* x = there ? there : mesh.vertices[mesh.vertices.size() == 1 ? 0 : k];
        placed.push_back({mesh.triangles ? x : nullptr, camera_from_mesh(mesh, k, camera_from_base)});
      }
    }
    const std::size_t pixels = static_cast<std::size_t>(lens.width) * static_cast<std::size_t>(lens.height),
                      each = 2 * pixels * sizeof(std::uint64_t) + s.all_vertices * sizeof(SeenVertex) +
                             s.all_triangles * sizeof(cuda::LargeTriangle),
                      together = std::clamp<std::size_t>(memory_at_once / each, 1,
                                                         std::min(most_at_once, frames.size()));
    s.placed.hold(placed.size());
    s.placed.write(0, placed.data(), placed.size());
    s.frames.hold(frames.size());
    s.frames.write(0, frames.data(), frames.size());
    s.yielding.hold(together * pixels);
    s.solid.hold(together * pixels);
    s.large.hold(together * s.all_triangles);
    s.seen.hold(together * s.all_vertices);
    for (std::size_t first = 0; first < frames.size(); first += together) {
      const std::size_t count = std::min(together, frames.size() - first);
      const DepthPictures to = from_pixel(pictures, first * pixels);
      const cuda::PictureBatch batch{.camera = lens,
                                     .pictures = static_cast<int>(count),
                                     .meshes = static_cast<int>(meshes.size()),
                                     .vertices = static_cast<int>(s.all_vertices),
                                     .drawn = s.drawn.data(),
                                     .placed = s.placed.data() + first * meshes.size(),
                                     .camera_frames = s.frames.data() + first,
                                     .yielding = s.yielding.data(),
                                     .solid = s.solid.data(),
                                     .seen = s.seen.data(),
                                     .to = at == Device::cuda ? to : s.way.take(to, count * pixels)};
      cuda::draw_pictures(batch, s.meshes, {s.large.data(), s.large_count.data()}, cudaStreamPerThread);
      if (at == Device::cpu) s.way.bring(to, count * pixels);
    }
    cuda::check(cudaStreamSynchronize(cudaStreamPerThread));
  });
}

#else

struct DevicePictures::Storage {};

DevicePictures::DevicePictures(int, std::span<const SeenMesh>) {
  throw data::InputError("--device cuda: " + why_no_cuda());
}
DevicePictures::~DevicePictures() = default;
void DevicePictures::render(const data::CameraIntrinsics&, std::span<const Eigen::Isometry3d>,
                            std::span<const SeenMesh>, const DepthPictures&, Device) {}

#endif

}  // namespace flash::sim
