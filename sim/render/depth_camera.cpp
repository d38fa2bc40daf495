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

namespace flash::sim {
namespace {

Pinhole pinhole(const data::CameraIntrinsics& camera) {
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

/// A vertex of a mesh.
struct SeenVertex {
  Vector3<double> place;  ///< in the frame of the camera [m]
  ImageCorner corner;     ///< of one behind the near plane no corner
  bool is_before() const { return place.z >= near_plane; }
};

void transform(const Pinhole& camera, const SeenMesh& mesh, std::size_t picture,
               const Eigen::Isometry3d& camera_from_base, std::vector<SeenVertex>& seen) {
  const Eigen::Isometry3d pose = mesh.base_from_mesh.empty()
                                     ? camera_from_base
                                     : camera_from_base * of_picture(mesh.base_from_mesh, picture);
  const double* vertices = of_picture(mesh.vertices, picture);
  seen.resize(static_cast<std::size_t>(mesh.vertex_count));
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const Eigen::Vector3d at = pose * Eigen::Vector3d(Eigen::Map<const Eigen::Vector3d>(vertices + 3 * i));
    seen[i].place = {at.x(), at.y(), at.z()};
    seen[i].corner = image_corner(camera, seen[i].place);
  }
}

/// Memory of a thread, kept from picture to picture.
struct Canvas {
  std::vector<SeenVertex> seen;
  std::vector<PixelHit> hits;
  std::vector<std::vector<double>>
      shares;  ///< of each mesh that yields, by its triangles: see yielding_share
};

/// What the inverse depth of a triangle has to be multiplied with to get that of its plane where it is moved
/// by `yields` away from the camera: 1/z is proportional to 1 over the distance of the plane from the camera.
double yielding_share(const Vector3<double>& a, const Vector3<double>& b, const Vector3<double>& c,
                      double yields) {
  const Vector3<double> normal = cross(b - a, c - a);
  const double distance = std::abs(dot(normal, a)) / norm(normal);
  return distance / (distance + yields);
}

/// Draws one mesh. Where it meets one that yields, `least(hit)` is the inverse depth from which on it shows.
template <class Least>
void draw(const Pinhole& camera, const SeenMesh& mesh, std::int32_t number, const Least& least,
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
      if (inverse_depth > own.inverse_depth || inverse_depth > least(own)) own = {inverse_depth, number, t};
    };
    if (a.is_before() && b.is_before() && c.is_before())
      cover(camera, a.corner, b.corner, c.corner, hit);
    else
      cover(camera, a.place, b.place, c.place, hit);
    if (mesh.yields > 0)
      canvas.shares[static_cast<std::size_t>(number)].push_back(
          yielding_share(a.place, b.place, c.place, mesh.yields));
  }
}

void draw(const Pinhole& camera, const Eigen::Isometry3d& base_from_camera, std::span<const SeenMesh> meshes,
          std::size_t picture, Canvas& canvas) {
  canvas.hits.assign(static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height), {});
  canvas.shares.assign(meshes.size(), {});
  const Eigen::Isometry3d camera_from_base = base_from_camera.inverse();
  const auto nearest = [](const PixelHit& hit) { return hit.inverse_depth; };
  const auto through = [&](const PixelHit& hit) {
    if (hit.mesh < 0 || meshes[static_cast<std::size_t>(hit.mesh)].yields == 0) return hit.inverse_depth;
    return hit.inverse_depth *
           canvas.shares[static_cast<std::size_t>(hit.mesh)][static_cast<std::size_t>(hit.triangle)];
  };
  for (const bool yielding : {true, false})
    for (std::size_t m = 0; m < meshes.size(); ++m) {
      if (!meshes[m].triangles || (meshes[m].yields > 0) != yielding) continue;
      transform(camera, meshes[m], picture, camera_from_base, canvas.seen);
      if (yielding)
        draw(camera, meshes[m], static_cast<std::int32_t>(m), nearest, canvas);
      else
        draw(camera, meshes[m], static_cast<std::int32_t>(m), through, canvas);
    }
}

/// Picture number `picture` of what the pixels see.
void write(const Pinhole& camera, const Eigen::Isometry3d& base_from_camera,
           const std::vector<PixelHit>& hits, std::size_t picture, const DepthPictures& pictures) {
  std::size_t pixel = picture * hits.size();
  auto hit = hits.begin();
  for (int row = 0; row < camera.height; ++row)
    for (int column = 0; column < camera.width; ++column, ++hit, ++pixel) {
      const bool seen = hit->mesh >= 0;
      const double depth = seen ? 1 / hit->inverse_depth : 0;
      if (pictures.depth) pictures.depth[pixel] = static_cast<float>(depth);
      if (pictures.instance) pictures.instance[pixel] = seen ? static_cast<std::uint8_t>(hit->mesh) : 255;
      if (pictures.triangle) pictures.triangle[pixel] = hit->triangle;
      if (!pictures.distance && !pictures.points) continue;
      const Eigen::Vector3d ray((column - camera.cx) / camera.fx, (row - camera.cy) / camera.fy, 1);
      if (pictures.distance) pictures.distance[pixel] = static_cast<float>(depth * ray.norm());
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
