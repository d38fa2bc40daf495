#include "sim/render/depth_camera.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <string>
#include <thread>
#include <utility>

#include "data/files/error.h"
#include "data/machine/parallel.h"

namespace flash::sim {
namespace {

Pinhole pinhole(const data::CameraIntrinsics& camera) {
  if (camera.width < 1 || camera.height < 1)
    throw data::InputError("camera: found a picture of " + std::to_string(camera.width) + " x " +
                           std::to_string(camera.height) + " pixels, expected 1 x 1 or more");
  if (!(camera.fx > 0 && camera.fy > 0 && std::isfinite(camera.fx) && std::isfinite(camera.fy)))
    throw data::InputError("camera: found the focal lengths " + std::to_string(camera.fx) + " and " +
                           std::to_string(camera.fy) + " px, expected finite ones above 0");
  if (!std::isfinite(camera.cx) || !std::isfinite(camera.cy))
    throw data::InputError("camera: found the centre " + std::to_string(camera.cx) + ", " +
                           std::to_string(camera.cy) + " px, expected finite numbers");
  for (const double coefficient : camera.distortion)
    if (coefficient != 0)
      throw data::InputError(
          "camera: distortion: found a lens with distortion, expected an undistorted camera to render with");
  return {camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy};
}

/// Of one entry for each picture, or one for all.
template <class Entries>
const auto& of_picture(const Entries& entries, std::size_t picture) {
  return entries[entries.size() == 1 ? 0 : picture];
}

void check_meshes(std::span<const SeenMesh> meshes, std::size_t pictures) {
  if (meshes.size() > 255)
    throw data::InputError("meshes: found " + std::to_string(meshes.size()) + ", expected 255 at most");
  const auto expect = [&](const char* what, std::size_t found) {
    if (found != 1 && found != pictures)
      throw data::InputError(std::string("meshes: found ") + what + " for " + std::to_string(found) +
                             " pictures, expected 1 or " + std::to_string(pictures));
  };
  for (const SeenMesh& mesh : meshes) {
    if (!mesh.triangles) continue;
    expect("vertices", mesh.vertices.size());
    if (!mesh.base_from_mesh.empty()) expect("poses", mesh.base_from_mesh.size());
  }
}

/// The vertices of a mesh in the frame of the camera.
void transform(const SeenMesh& mesh, std::size_t picture, const Eigen::Isometry3d& camera_from_base,
               std::vector<Vector3<double>>& seen) {
  const Eigen::Isometry3d pose = mesh.base_from_mesh.empty()
                                     ? camera_from_base
                                     : camera_from_base * of_picture(mesh.base_from_mesh, picture);
  const double* vertices = of_picture(mesh.vertices, picture);
  seen.resize(static_cast<std::size_t>(mesh.vertex_count));
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const Eigen::Vector3d at = pose * Eigen::Vector3d(Eigen::Map<const Eigen::Vector3d>(vertices + 3 * i));
    seen[i] = {at.x(), at.y(), at.z()};
  }
}

/// Memory of a thread, kept from picture to picture.
struct Canvas {
  std::vector<Vector3<double>> seen;
  std::vector<PixelHit> hits;
};

void draw(const Pinhole& camera, const Eigen::Isometry3d& base_from_camera, std::span<const SeenMesh> meshes,
          std::size_t picture, Canvas& canvas) {
  canvas.hits.assign(static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height), {});
  const Eigen::Isometry3d camera_from_base = base_from_camera.inverse();
  for (std::size_t m = 0; m < meshes.size(); ++m) {
    if (!meshes[m].triangles) continue;
    transform(meshes[m], picture, camera_from_base, canvas.seen);
    const int* corner = meshes[m].triangles->data();
    for (Eigen::Index t = 0; t < meshes[m].triangles->rows(); ++t, corner += 3) {
      const PixelHit own{0, static_cast<std::int32_t>(m), static_cast<std::int32_t>(t)};
      const auto at = [&](int k) -> const Vector3<double>& {
        return canvas.seen[static_cast<std::size_t>(corner[k])];
      };
      cover(camera, at(0), at(1), at(2), [&](int column, int row, double inverse_depth) {
        PixelHit& hit = canvas.hits[static_cast<std::size_t>(row) * static_cast<std::size_t>(camera.width) +
                                    static_cast<std::size_t>(column)];
        if (inverse_depth > hit.inverse_depth) hit = {inverse_depth, own.mesh, own.triangle};
      });
    }
  }
}

/// Picture number `picture` of what the pixels see.
void write(const Pinhole& camera, const Eigen::Isometry3d& base_from_camera,
           const std::vector<PixelHit>& hits, std::size_t picture, const DepthPictures& pictures) {
  for (std::size_t i = 0; i < hits.size(); ++i) {
    const PixelHit& hit = hits[i];
    const std::size_t pixel = picture * hits.size() + i;
    const auto width = static_cast<std::size_t>(camera.width);
    const std::size_t row = i / width, column = i % width;
    const Eigen::Vector3d ray((static_cast<double>(column) - camera.cx) / camera.fx,
                              (static_cast<double>(row) - camera.cy) / camera.fy, 1);
    const bool seen = hit.mesh >= 0;
    const double depth = seen ? 1 / hit.inverse_depth : 0;
    if (pictures.depth) pictures.depth[pixel] = static_cast<float>(depth);
    if (pictures.distance) pictures.distance[pixel] = static_cast<float>(depth * ray.norm());
    if (pictures.instance) pictures.instance[pixel] = seen ? static_cast<std::uint8_t>(hit.mesh) : 255;
    if (pictures.triangle) pictures.triangle[pixel] = hit.triangle;
    if (pictures.points)
      Eigen::Map<Eigen::Vector3f>(pictures.points + 3 * pixel) =
          seen ? Eigen::Vector3f((base_from_camera * (depth * ray).eval()).cast<float>())
               : Eigen::Vector3f(Eigen::Vector3f::Zero());
  }
}

}  // namespace

std::vector<PixelHit> see(const data::CameraIntrinsics& camera, const Eigen::Isometry3d& base_from_camera,
                          std::span<const SeenMesh> meshes) {
  Canvas canvas;
  draw(pinhole(camera), base_from_camera, meshes, 0, canvas);
  return std::move(canvas.hits);
}

void check_camera(const data::CameraIntrinsics& camera) { pinhole(camera); }

void render(const data::CameraIntrinsics& camera, std::span<const Eigen::Isometry3d> base_from_camera,
            std::span<const SeenMesh> meshes, const DepthPictures& pictures, int threads) {
  const Pinhole lens = pinhole(camera);
  const std::size_t count = base_from_camera.size();
  check_meshes(meshes, count);
  // A worker keeps its memory from picture to picture.
  if (threads <= 0) threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  const std::size_t workers = std::min(static_cast<std::size_t>(threads), count);
  std::atomic<std::size_t> next = 0;
  data::for_each_in_parallel(workers, threads, [&](std::size_t) {
    Canvas canvas;
    for (std::size_t i = next++; i < count; i = next++) {
      draw(lens, base_from_camera[i], meshes, i, canvas);
      write(lens, base_from_camera[i], canvas.hits, i, pictures);
    }
  });
}

}  // namespace flash::sim
