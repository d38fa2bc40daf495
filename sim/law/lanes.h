#pragma once
#include <cmath>
#include <cstring>

#include "sim/law/host_device.h"
#include "sim/law/level_namespace.h"

namespace flash::sim {
inline namespace FLASH_LEVEL {

/// Size of a vector register [bytes].
#if defined(__AVX512F__)
inline constexpr int vector_bytes = 64;
#elif defined(__AVX2__)
inline constexpr int vector_bytes = 32;
#else
inline constexpr int vector_bytes = 16;
#endif

/// Numbers that one register takes.
template <typename Scalar>
inline constexpr int lanes_of = vector_bytes / static_cast<int>(sizeof(Scalar));

inline constexpr int lane_count = lanes_of<double>;

/// A register of numbers that go through one formula together. A formula written for a type `Real` takes a
/// double or Lanes; what it needs beside + - * / and comparisons follows here for both.
typedef double Lanes __attribute__((vector_size(vector_bytes)));

inline Lanes load_lanes(const double* numbers) {
  Lanes lanes;
  memcpy(&lanes, numbers, sizeof(lanes));
  return lanes;
}
inline void store_lanes(const Lanes& lanes, double* numbers) { memcpy(numbers, &lanes, sizeof(lanes)); }

// These call the C library: the C++ library's functions are inline for some types.
FLASH_HOST_DEVICE inline float square_root(float x) { return ::sqrtf(x); }
FLASH_HOST_DEVICE inline double square_root(double x) { return ::sqrt(x); }
FLASH_HOST_DEVICE inline double logarithm(double x) { return ::log(x); }
FLASH_HOST_DEVICE inline double select(bool condition, double yes, double no) { return condition ? yes : no; }

inline Lanes square_root(const Lanes& x) {
  Lanes y;
  for (int lane = 0; lane < lane_count; ++lane) y[lane] = ::sqrt(x[lane]);
  return y;
}
inline Lanes logarithm(const Lanes& x) {
  Lanes y;
  for (int lane = 0; lane < lane_count; ++lane) y[lane] = ::log(x[lane]);
  return y;
}
template <typename Condition>
Lanes select(const Condition& condition, const Lanes& yes, const Lanes& no) {
  return condition ? yes : no;
}

template <typename Real>
FLASH_HOST_DEVICE inline Real larger_of(const Real& a, const Real& b) {
  return select(a > b, a, b);
}
template <typename Real>
FLASH_HOST_DEVICE inline Real magnitude(const Real& x) {
  return select(x < 0.0, Real(-x), x);
}
/// `size`, which is not negative, with the sign of x; zero counts as positive.
template <typename Real>
FLASH_HOST_DEVICE inline Real with_sign(const Real& size, const Real& x) {
  return select(x < 0.0, Real(-size), size);
}

}  // namespace FLASH_LEVEL
}  // namespace flash::sim
