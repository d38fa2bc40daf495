#pragma once
#include <cmath>
#include <cstdint>

#include "sim/law/host_device.h"
#include "sim/law/vector3.h"

namespace flash::sim {

/// A pinhole camera without distortion; pixel (0, 0) is the centre of the upper left pixel.
struct Pinhole {
  int width, height;      ///< [px]
  double fx, fy, cx, cy;  ///< [px]
};

/// What is nearest along the ray through the centre of a pixel.
struct PixelHit {
  double inverse_depth = 0;  ///< 1 over the depth along the optical axis [1/m]; 0: nothing
  std::int32_t mesh = -1;
  std::int32_t triangle = -1;
};

/// Of what is closer to the plane of the camera nothing is drawn [m].
inline constexpr double near_plane = 1e-3;

/// A corner of a triangle in the image.
struct ImageCorner {
  double u, v;           ///< [px]
  double inverse_depth;  ///< [1/m]
};

FLASH_HOST_DEVICE inline ImageCorner image_corner(const Pinhole& camera, const Vector3<double>& seen) {
  const double inverse = 1 / seen.z;
  return {camera.fx * seen.x * inverse + camera.cx, camera.fy * seen.y * inverse + camera.cy, inverse};
}

/// Twice the signed area of (a, b, pixel), from the end of the edge that comes first in the image: the same
/// number, to the last bit, for both triangles that share the edge, but for its sign.
struct ImageEdge {
  double u, v, du, dv;
  bool turned;

  FLASH_HOST_DEVICE ImageEdge(const ImageCorner& a, const ImageCorner& b)
      : turned(b.u < a.u || (b.u == a.u && b.v < a.v)) {
    const ImageCorner &first = turned ? b : a, &last = turned ? a : b;
    u = first.u, v = first.v, du = last.u - first.u, dv = last.v - first.v;
  }
  FLASH_HOST_DEVICE double at(int column, int row) const { return du * (row - v) - dv * (column - u); }
  /// Whether a pixel with that number lies on the side where `outward` is false. One on the edge itself lies
  /// on the first side, as if all pixels were moved by the same very small way: one of two triangles has it.
  FLASH_HOST_DEVICE bool inside(double number, bool outward) const {
    return outward == turned ? number >= 0 : number < 0;
  }
};

// By a cast, as rounding up or down is a call on processors of the first x86-64.
FLASH_HOST_DEVICE inline int first_pixel(double low, int size) {
  if (low <= 0) return 0;
  if (low >= size) return size;
  const int below = static_cast<int>(low);
  return below < low ? below + 1 : below;
}

FLASH_HOST_DEVICE inline int last_pixel(double high, int size) {
  return high < 0 ? -1 : high >= size - 1 ? size - 1 : static_cast<int>(high);
}

FLASH_HOST_DEVICE inline double least(double a, double b, double c) {
  const double ab = a < b ? a : b;
  return ab < c ? ab : c;
}

/// Calls hit(column, row, inverse depth) for each pixel whose centre is in the triangle, which has both
/// sides. 1/z is linear in the image over a triangle.
template <class Hit>
FLASH_HOST_DEVICE void cover(const Pinhole& camera, const ImageCorner& a, const ImageCorner& b,
                             const ImageCorner& c, const Hit& hit) {
  const double area = (b.u - a.u) * (c.v - a.v) - (b.v - a.v) * (c.u - a.u);
  if (!(std::abs(area) > 0 && std::abs(area) < 1e300)) return;  // nor one with a corner that is no number
  const bool outward = area < 0;
  const ImageEdge to_a(b, c), to_b(c, a), to_c(a, b);
  const double share = 1 / area;
  const double of_a = to_a.turned ? -share : share, of_b = to_b.turned ? -share : share,
               of_c = to_c.turned ? -share : share;
  const int u0 = first_pixel(least(a.u, b.u, c.u), camera.width);
  const int u1 = last_pixel(-least(-a.u, -b.u, -c.u), camera.width);
  const int v0 = first_pixel(least(a.v, b.v, c.v), camera.height);
  const int v1 = last_pixel(-least(-a.v, -b.v, -c.v), camera.height);
  for (int row = v0; row <= v1; ++row)
    for (int column = u0; column <= u1; ++column) {
      const double at_a = to_a.at(column, row), at_b = to_b.at(column, row), at_c = to_c.at(column, row);
      if (to_a.inside(at_a, outward) && to_b.inside(at_b, outward) && to_c.inside(at_c, outward))
        hit(column, row,
            at_a * of_a * a.inverse_depth + at_b * of_b * b.inverse_depth + at_c * of_c * c.inverse_depth);
    }
}

/// Where the way from a point before the near plane to one behind it meets the plane.
FLASH_HOST_DEVICE inline Vector3<double> at_near_plane(const Vector3<double>& before,
                                                       const Vector3<double>& behind) {
  const double share = (before.z - near_plane) / (before.z - behind.z);
  return {before.x + share * (behind.x - before.x), before.y + share * (behind.y - before.y), near_plane};
}

/// The same for corners in the frame of the camera [m], of what lies before the near plane.
template <class Hit>
FLASH_HOST_DEVICE void cover(const Pinhole& camera, const Vector3<double>& a, const Vector3<double>& b,
                             const Vector3<double>& c, const Hit& hit) {
  const Vector3<double> corners[3] = {a, b, c};
  ImageCorner cut[4];
  int count = 0;
  for (int k = 0; k < 3; ++k) {
    const Vector3<double>&here = corners[k], &next = corners[(k + 1) % 3];
    const bool here_before = here.z >= near_plane, next_before = next.z >= near_plane;
    if (here_before) cut[count++] = image_corner(camera, here);
    if (here_before != next_before)
      cut[count++] =
          image_corner(camera, here_before ? at_near_plane(here, next) : at_near_plane(next, here));
  }
  for (int k = 2; k < count; ++k) cover(camera, cut[0], cut[k - 1], cut[k], hit);
}

}  // namespace flash::sim
