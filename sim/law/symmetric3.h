#pragma once
#include "sim/law/vector3.h"

namespace flash::sim {
inline namespace FLASH_LEVEL {

/// A symmetric 3 x 3 matrix.
struct Symmetric3 {
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;

  FLASH_HOST_DEVICE double at(int row, int column) const {
    const int low = row < column ? row : column, high = row < column ? column : row;
    if (low == 0) return high == 0 ? xx : high == 1 ? xy : xz;
    if (low == 1) return high == 1 ? yy : yz;
    return zz;
  }
};

FLASH_HOST_DEVICE inline Symmetric3 identity3() { return {1, 0, 0, 1, 0, 1}; }

/// v v^T.
FLASH_HOST_DEVICE inline Symmetric3 square(const Vector3<double>& v) {
  return {v.x * v.x, v.x * v.y, v.x * v.z, v.y * v.y, v.y * v.z, v.z * v.z};
}

/// (a b^T + b a^T) / 2.
FLASH_HOST_DEVICE inline Symmetric3 symmetric_product(const Vector3<double>& a, const Vector3<double>& b) {
  return {a.x * b.x, 0.5 * (a.x * b.y + a.y * b.x), 0.5 * (a.x * b.z + a.z * b.x),
          a.y * b.y, 0.5 * (a.y * b.z + a.z * b.y), a.z * b.z};
}

FLASH_HOST_DEVICE inline Symmetric3 operator+(const Symmetric3& a, const Symmetric3& b) {
  return {a.xx + b.xx, a.xy + b.xy, a.xz + b.xz, a.yy + b.yy, a.yz + b.yz, a.zz + b.zz};
}
FLASH_HOST_DEVICE inline Symmetric3 operator-(const Symmetric3& a, const Symmetric3& b) {
  return {a.xx - b.xx, a.xy - b.xy, a.xz - b.xz, a.yy - b.yy, a.yz - b.yz, a.zz - b.zz};
}
FLASH_HOST_DEVICE inline Symmetric3 operator*(double a, const Symmetric3& b) {
  return {a * b.xx, a * b.xy, a * b.xz, a * b.yy, a * b.yz, a * b.zz};
}
FLASH_HOST_DEVICE inline Vector3<double> operator*(const Symmetric3& a, const Vector3<double>& v) {
  return {a.xx * v.x + a.xy * v.y + a.xz * v.z, a.xy * v.x + a.yy * v.y + a.yz * v.z,
          a.xz * v.x + a.yz * v.y + a.zz * v.z};
}

/// P A P.
FLASH_HOST_DEVICE inline Symmetric3 restricted(const Symmetric3& a, const Symmetric3& p) {
  const Vector3<double> x = p * (a * Vector3<double>{p.xx, p.xy, p.xz}),
                        y = p * (a * Vector3<double>{p.xy, p.yy, p.yz}),
                        z = p * (a * Vector3<double>{p.xz, p.yz, p.zz});
  return {x.x, y.x, z.x, y.y, z.y, z.z};
}

FLASH_HOST_DEVICE inline bool is_zero(const Symmetric3& a) {
  return a.xx == 0 && a.xy == 0 && a.xz == 0 && a.yy == 0 && a.yz == 0 && a.zz == 0;
}

/// Norm of all nine entries.
FLASH_HOST_DEVICE inline double norm(const Symmetric3& a) {
  return square_root(a.xx * a.xx + a.yy * a.yy + a.zz * a.zz + 2 * (a.xy * a.xy + a.xz * a.xz + a.yz * a.yz));
}

}  // namespace FLASH_LEVEL
}  // namespace flash::sim
