#pragma once
#include "sim/law/host_device.h"
#include "sim/law/lanes.h"

namespace flash::sim {
inline namespace FLASH_LEVEL {

/// A vector in space, of numbers or of lanes.
template <typename Real>
struct Vector3 {
  Real x, y, z;

  FLASH_HOST_DEVICE Real& operator[](int axis) { return axis == 0 ? x : axis == 1 ? y : z; }
  FLASH_HOST_DEVICE const Real& operator[](int axis) const { return axis == 0 ? x : axis == 1 ? y : z; }
};

template <typename Real>
FLASH_HOST_DEVICE inline Vector3<Real> operator+(const Vector3<Real>& a, const Vector3<Real>& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <typename Real>
FLASH_HOST_DEVICE inline Vector3<Real> operator-(const Vector3<Real>& a, const Vector3<Real>& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <typename Real>
FLASH_HOST_DEVICE inline Vector3<Real> operator*(const Real& a, const Vector3<Real>& b) {
  return {a * b.x, a * b.y, a * b.z};
}
template <typename Real>
FLASH_HOST_DEVICE inline Real dot(const Vector3<Real>& a, const Vector3<Real>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <typename Real>
FLASH_HOST_DEVICE inline Vector3<Real> cross(const Vector3<Real>& a, const Vector3<Real>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <typename Real>
FLASH_HOST_DEVICE inline Real norm(const Vector3<Real>& a) {
  return square_root(dot(a, a));
}
template <typename Real>
FLASH_HOST_DEVICE inline Vector3<Real> select(const auto& condition, const Vector3<Real>& yes,
                                              const Vector3<Real>& no) {
  return {select(condition, yes.x, no.x), select(condition, yes.y, no.y), select(condition, yes.z, no.z)};
}

/// A rigid frame: its unit axes and its origin in the base frame.
template <typename Real>
struct Frame {
  Vector3<Real> x, y, z, origin;

  FLASH_HOST_DEVICE const Vector3<Real>& axis(int k) const { return k == 0 ? x : k == 1 ? y : z; }
};

/// A direction of the base frame in the frame, and the way back.
template <typename Real>
FLASH_HOST_DEVICE inline Vector3<Real> direction_in(const Frame<Real>& frame,
                                                    const Vector3<Real>& direction) {
  return {dot(frame.x, direction), dot(frame.y, direction), dot(frame.z, direction)};
}
template <typename Real>
FLASH_HOST_DEVICE inline Vector3<Real> direction_from(const Frame<Real>& frame,
                                                      const Vector3<Real>& direction) {
  return direction.x * frame.x + direction.y * frame.y + direction.z * frame.z;
}

/// A place of the base frame in the frame, and the way back.
template <typename Real>
FLASH_HOST_DEVICE inline Vector3<Real> place_in(const Frame<Real>& frame, const Vector3<Real>& place) {
  return direction_in(frame, place - frame.origin);
}
template <typename Real>
FLASH_HOST_DEVICE inline Vector3<Real> place_from(const Frame<Real>& frame, const Vector3<Real>& place) {
  return direction_from(frame, place) + frame.origin;
}

}  // namespace FLASH_LEVEL
}  // namespace flash::sim
