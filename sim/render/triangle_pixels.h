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

/// Pixels from a first to a last column, and from a first to a last row; none where a last one is before its
/// first.
struct PixelWindow {
  int first_column, last_column, first_row, last_row;
};

FLASH_HOST_DEVICE inline PixelWindow whole_picture(const Pinhole& camera) {
  return {0, camera.width - 1, 0, camera.height - 1};
}

FLASH_HOST_DEVICE inline double least(double a, double b, double c) {
  const double ab = a < b ? a : b;
  return ab < c ? ab : c;
}

/// Those of `within` that a triangle may cover.
FLASH_HOST_DEVICE inline PixelWindow window_of(const PixelWindow& within, const ImageCorner& a,
                                               const ImageCorner& b, const ImageCorner& c) {
  const int column = first_pixel(least(a.u, b.u, c.u), within.last_column + 1);
  const int row = first_pixel(least(a.v, b.v, c.v), within.last_row + 1);
  return {column > within.first_column ? column : within.first_column,
          last_pixel(-least(-a.u, -b.u, -c.u), within.last_column + 1),
          row > within.first_row ? row : within.first_row,
          last_pixel(-least(-a.v, -b.v, -c.v), within.last_row + 1)};
}

/// Twice the area of a triangle in the image [px^2], with the sign of its turn; 0 where there is none to be
/// seen.
FLASH_HOST_DEVICE inline double image_area(const ImageCorner& a, const ImageCorner& b, const ImageCorner& c) {
  const double area = (b.u - a.u) * (c.v - a.v) - (b.v - a.v) * (c.u - a.u);
  return std::abs(area) > 0 && std::abs(area) < 1e300 ? area : 0;  // nor of a corner that is no number
}

/// Calls hit(column, row, inverse depth) for each pixel of `within` whose centre is in the triangle, which
/// has both sides. 1/z is linear in the image over a triangle.
template <class Hit>
FLASH_HOST_DEVICE void cover(const PixelWindow& within, const ImageCorner& a, const ImageCorner& b,
                             const ImageCorner& c, const Hit& hit) {
  const double area = image_area(a, b, c);
  if (area == 0) return;
  const bool outward = area < 0;
  const ImageEdge to_a(b, c), to_b(c, a), to_c(a, b);
  const double share = 1 / area;
  const double of_a = to_a.turned ? -share : share, of_b = to_b.turned ? -share : share,
               of_c = to_c.turned ? -share : share;
  const double lowest = least(a.inverse_depth, b.inverse_depth, c.inverse_depth),
               highest = -least(-a.inverse_depth, -b.inverse_depth, -c.inverse_depth);
  const PixelWindow window = window_of(within, a, b, c);
  for (int row = window.first_row; row <= window.last_row; ++row)
    for (int column = window.first_column; column <= window.last_column; ++column) {
      const double at_a = to_a.at(column, row), at_b = to_b.at(column, row), at_c = to_c.at(column, row);
      if (to_a.inside(at_a, outward) && to_b.inside(at_b, outward) && to_c.inside(at_c, outward)) {
        const double inverse_depth =
            at_a * of_a * a.inverse_depth + at_b * of_b * b.inverse_depth + at_c * of_c * c.inverse_depth;
        // Of a triangle that is seen from its edge the area is rounding, and so are its shares.
        hit(column, row, inverse_depth < lowest ? lowest : inverse_depth > highest ? highest : inverse_depth);
      }
    }
}

/// Where the way from a point before the near plane to one behind it meets the plane.
FLASH_HOST_DEVICE inline Vector3<double> at_near_plane(const Vector3<double>& before,
                                                       const Vector3<double>& behind) {
  const double share = (before.z - near_plane) / (before.z - behind.z);
  return {before.x + share * (behind.x - before.x), before.y + share * (behind.y - before.y), near_plane};
}

/// A triangle of the frame of the camera [m] as far as it lies before the near plane: the corners of what is
/// left, in the image, in turn. Returns how many there are, 4 at most.
FLASH_HOST_DEVICE inline int cut_at_near_plane(const Pinhole& camera, const Vector3<double>& a,
                                               const Vector3<double>& b, const Vector3<double>& c,
                                               ImageCorner (&cut)[4]) {
  const Vector3<double> corners[3] = {a, b, c};
  int count = 0;
  for (int k = 0; k < 3; ++k) {
    const Vector3<double>&here = corners[k], &next = corners[(k + 1) % 3];
    const bool here_before = here.z >= near_plane, next_before = next.z >= near_plane;
    if (here_before) cut[count++] = image_corner(camera, here);
    if (here_before != next_before)
      cut[count++] =
          image_corner(camera, here_before ? at_near_plane(here, next) : at_near_plane(next, here));
  }
  return count;
}

/// The same for corners in the frame of the camera [m], of what lies before the near plane.
template <class Hit>
FLASH_HOST_DEVICE void cover(const Pinhole& camera, const PixelWindow& within, const Vector3<double>& a,
                             const Vector3<double>& b, const Vector3<double>& c, const Hit& hit) {
  ImageCorner cut[4];
  const int count = cut_at_near_plane(camera, a, b, c, cut);
  for (int k = 2; k < count; ++k) cover(within, cut[0], cut[k - 1], cut[k], hit);
}

}  // namespace flash::sim
