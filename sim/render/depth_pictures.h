#pragma once
#include <cstddef>
#include <cstdint>

#include "sim/render/triangle_pixels.h"

namespace flash::sim {

/// Where pictures go, dense, picture after picture; null: not wanted.
struct DepthPictures {
  float* depth = nullptr;            ///< height x width each, along the optical axis [m]; 0: nothing
  float* distance = nullptr;         ///< along the ray [m]; 0: nothing
  std::uint8_t* instance = nullptr;  ///< number of the mesh; 255: nothing
  std::int32_t* triangle = nullptr;  ///< of the mesh; -1: nothing
  float* points = nullptr;           ///< height x width x 3 each, in the base frame [m]; 0 0 0: nothing
};

/// A vertex of a mesh, as a camera sees it.
struct SeenVertex {
  Vector3<double> place;  ///< in the frame of the camera [m]
  ImageCorner corner;     ///< of one behind the near plane no corner

  FLASH_HOST_DEVICE bool is_before() const { return place.z >= near_plane; }
};

/// `frame`: of the mesh, in that of the camera; `x`: x y z of the vertex [m].
FLASH_HOST_DEVICE inline SeenVertex seen_vertex(const Pinhole& camera, const Frame<double>& frame,
                                                const double* x) {
  const Vector3<double> place = place_from(frame, {x[0], x[1], x[2]});
  return {place, image_corner(camera, place)};
}

/// Calls hit(column, row, inverse depth) for each pixel of `within` whose centre is in the triangle.
template <class Hit>
FLASH_HOST_DEVICE void cover(const Pinhole& camera, const PixelWindow& within, const SeenVertex& a,
                             const SeenVertex& b, const SeenVertex& c, const Hit& hit) {
  if (a.is_before() && b.is_before() && c.is_before())
    cover(within, a.corner, b.corner, c.corner, hit);
  else
    cover(camera, within, a.place, b.place, c.place, hit);
}

/// Of two hits of a pixel the nearer one shows, and the first where both are as near in single precision.
FLASH_HOST_DEVICE inline bool is_nearer(double inverse_depth, double than) {
  return static_cast<float>(inverse_depth) > static_cast<float>(than);
}

/// What the inverse depth of a triangle has to be multiplied with to get that of its plane where it is moved
/// by `yields` [m] away from the camera: 1/z is proportional to 1 over the distance of the plane from the
/// camera.
FLASH_HOST_DEVICE inline double yielding_share(const Vector3<double>& a, const Vector3<double>& b,
                                               const Vector3<double>& c, double yields) {
  const Vector3<double> normal = cross(b - a, c - a);
  const double distance = std::abs(dot(normal, a)) / norm(normal);
  return distance / (distance + yields);
}

/// What a pixel sees goes to place number `pixel` of the pictures.
FLASH_HOST_DEVICE inline void write_pixel(const Pinhole& camera, const Frame<double>& camera_frame,
                                          const PixelHit& hit, int column, int row, std::size_t pixel,
                                          const DepthPictures& pictures) {
  const bool seen = hit.mesh >= 0;
  const double depth = seen ? 1 / hit.inverse_depth : 0;
  if (pictures.depth) pictures.depth[pixel] = static_cast<float>(depth);
  if (pictures.instance) pictures.instance[pixel] = seen ? static_cast<std::uint8_t>(hit.mesh) : 255;
  if (pictures.triangle) pictures.triangle[pixel] = hit.triangle;
  if (!pictures.distance && !pictures.points) return;
  const Vector3<double> ray{(column - camera.cx) / camera.fx, (row - camera.cy) / camera.fy, 1};
  if (pictures.distance) pictures.distance[pixel] = static_cast<float>(depth * norm(ray));
  if (!pictures.points) return;
  const Vector3<double> place = seen ? place_from(camera_frame, depth * ray) : Vector3<double>{0, 0, 0};
  for (int k = 0; k < 3; ++k) pictures.points[3 * pixel + k] = static_cast<float>(place[k]);
}

}  // namespace flash::sim
