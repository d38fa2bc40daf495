#include "sim/render/depth_camera.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <string>
#include <thread>
#include <utility>

#include "data/files/error.h"
#include "data/files/text.h"
#include "data/machine/parallel.h"
#include "sim/law/rigid_frame.h"

namespace flash::sim {

using Eigen::Isometry3d;

namespace {

/// Of one entry for each picture, or one for all.
template <class Entries>
const auto& of_picture(const Entries& entries, std::size_t picture) {
  return entries[entries.size() == 1 ? 0 : picture];
}

}  // namespace

Pinhole pinhole_of(const data::CameraIntrinsics& camera) {
  if (camera.width < 1 || camera.height < 1)
    throw data::InputError("camera: found a picture of " + std::to_string(camera.width) + " x " +
                           std::to_string(camera.height) + " pixels, expected 1 x 1 or more");
  constexpr double least_focal_length = 1e-3, largest = 1e9;  // rays and their lengths stay finite [px]
  for (const double focal_length : {camera.fx, camera.fy})
    if (!(focal_length >= least_focal_length && focal_length <= largest))
      throw data::InputError("camera: found a focal length of " + data::format_short(focal_length) +
                             " px, expected " + data::format_short(least_focal_length) + " to " +
                             data::format_short(largest));
  for (const double centre : {camera.cx, camera.cy})
    if (!(std::abs(centre) <= largest))
      throw data::InputError("camera: found the centre at " + data::format_short(centre) +
                             " px, expected at most " + data::format_short(largest));
  for (const double coefficient : camera.distortion)
    if (coefficient != 0)
      throw data::InputError(
          "camera: distortion: found a lens with distortion, expected an undistorted camera to render with");
  return {camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy};
}

Frame<double> camera_from_mesh(const SeenMesh& mesh, std::size_t picture,
                               const Isometry3d& camera_from_base) {
  return frame_of(mesh.base_from_mesh.empty() ? camera_from_base
                                              : camera_from_base * of_picture(mesh.base_from_mesh, picture));
}

namespace {

void check_meshes(std::span<const SeenMesh> meshes, std::size_t pictures) {
  if (meshes.size() > most_meshes)
    throw data::InputError("meshes: found " + std::to_string(meshes.size()) + ", expected " +
                           std::to_string(most_meshes) + " at most");
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

void transform(const Pinhole& camera, const SeenMesh& mesh, std::size_t picture,
               const Isometry3d& camera_from_base, std::vector<SeenVertex>& seen) {
  const Frame<double> frame = camera_from_mesh(mesh, picture, camera_from_base);
  const double* vertices = of_picture(mesh.vertices, picture);
  seen.resize(static_cast<std::size_t>(mesh.vertex_count));
  for (std::size_t i = 0; i < seen.size(); ++i) {
    seen[i] = seen_vertex(camera, frame, vertices + 3 * i);
  }
}

/// Memory of a thread, kept from picture to picture.
struct Canvas {
  std::vector<SeenVertex> seen;
  std::vector<PixelHit> hits;
  std::vector<std::vector<double>>
      shares;  ///< of each mesh that yields, by its triangles: see yielding_share
};

/// Draws one mesh. `shows(inverse depth, hit)`: whether it does where a pixel has had that hit.
template <class Shows>
void draw(const Pinhole& camera, const SeenMesh& mesh, std::int32_t number, const Shows& shows,
          Canvas& canvas) {
  const int* corner = mesh.triangles->data();
  const auto triangles = static_cast<std::int32_t>(mesh.triangles->rows());
  for (std::int32_t t = 0; t < triangles; ++t, corner += 3) {
    const SeenVertex &a = canvas.seen[static_cast<std::size_t>(corner[0])],
                     &b = canvas.seen[static_cast<std::size_t>(corner[1])],
                     &c = canvas.seen[static_cast<std::size_t>(corner[2])];
    const auto hit = [&](int column, int row, double inverse_depth) {
      PixelHit& own = canvas.hits[static_cast<std::size_t>(row) * static_cast<std::size_t>(camera.width) +
                                  static_cast<std::size_t>(column)];
      if (shows(inverse_depth, own)) own = {inverse_depth, number, t};
    };
    cover(camera, whole_picture(camera), a, b, c, hit);
    if (mesh.yields > 0)
      canvas.shares[static_cast<std::size_t>(number)].push_back(
          yielding_share(a.place, b.place, c.place, mesh.yields));
  }
}

void draw(const Pinhole& camera, const Isometry3d& base_from_camera, std::span<const SeenMesh> meshes,
          std::size_t picture, Canvas& canvas) {
  canvas.hits.assign(static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height), {});
  canvas.shares.assign(meshes.size(), {});
  const Isometry3d camera_from_base = base_from_camera.inverse();
  const auto nearer = [](double inverse_depth, const PixelHit& hit) {
    return is_nearer(inverse_depth, hit.inverse_depth);
  };
  const auto through = [&](double inverse_depth, const PixelHit& hit) {
    if (nearer(inverse_depth, hit)) return true;
    if (hit.mesh < 0 || meshes[static_cast<std::size_t>(hit.mesh)].yields == 0) return false;
    const double share =
        canvas.shares[static_cast<std::size_t>(hit.mesh)][static_cast<std::size_t>(hit.triangle)];
    return inverse_depth > hit.inverse_depth * share;
  };
  for (const bool yielding : {true, false})
    for (std::size_t m = 0; m < meshes.size(); ++m) {
      if (!meshes[m].triangles || (meshes[m].yields > 0) != yielding) continue;
      transform(camera, meshes[m], picture, camera_from_base, canvas.seen);
      if (yielding)
        draw(camera, meshes[m], static_cast<std::int32_t>(m), nearer, canvas);
      else
        draw(camera, meshes[m], static_cast<std::int32_t>(m), through, canvas);
    }
}

/// Picture number `picture` of what the pixels see.
void write(const Pinhole& camera, const Isometry3d& base_from_camera, const std::vector<PixelHit>& hits,
           std::size_t picture, const DepthPictures& pictures) {
  const Frame<double> camera_frame = frame_of(base_from_camera);
  std::size_t pixel = picture * hits.size();
  auto hit = hits.begin();
  for (int row = 0; row < camera.height; ++row)
    for (int column = 0; column < camera.width; ++column)
      write_pixel(camera, camera_frame, *hit++, column, row, pixel++, pictures);
}

}  // namespace

std::vector<PixelHit> see(const data::CameraIntrinsics& camera, const Isometry3d& base_from_camera,
                          std::span<const SeenMesh> meshes) {
  Canvas canvas;
  draw(pinhole_of(camera), base_from_camera, meshes, 0, canvas);
  return std::move(canvas.hits);
}

void render(const data::CameraIntrinsics& camera, std::span<const Isometry3d> base_from_camera,
            std::span<const SeenMesh> meshes, const DepthPictures& pictures, int threads) {
  const Pinhole lens = pinhole_of(camera);
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
