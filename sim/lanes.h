#pragma once
#include <cmath>
#include <cstring>

#include "sim/host_device.h"

namespace flash::sim {

inline constexpr int lane_count = 8;

/// Eight numbers that go through one formula together. A formula written for a type `Real` takes a double or
/// Lanes; what it needs beside + - * / and comparisons follows here for both.
typedef double Lanes __attribute__((vector_size(lane_count * sizeof(double))));

inline Lanes load_lanes(const double* numbers) {
  Lanes lanes;
  std::memcpy(&lanes, numbers, sizeof(lanes));
  return lanes;
}
inline void store_lanes(const Lanes& lanes, double* numbers) { std::memcpy(numbers, &lanes, sizeof(lanes)); }

/// In a fixed order: the same numbers have the same sum.
inline double sum_of(const Lanes& lanes) {
  const double low = (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]);
  return low + ((lanes[4] + lanes[5]) + (lanes[6] + lanes[7]));
}

/// Four numbers: those of a vertex, and one more.
template <typename Scalar>
struct FourOf {
  typedef Scalar type __attribute__((vector_size(4 * sizeof(Scalar))));
};

template <typename Scalar>
typename FourOf<Scalar>::type load_four(const Scalar* numbers) {
  typename FourOf<Scalar>::type four;
  std::memcpy(&four, numbers, sizeof(four));
  return four;
}
template <typename Scalar>
void store_four(const typename FourOf<Scalar>::type& four, Scalar* numbers) {
  std::memcpy(numbers, &four, sizeof(four));
}

FLASH_HOST_DEVICE inline double square_root(double x) { return std::sqrt(x); }
FLASH_HOST_DEVICE inline double logarithm(double x) { return std::log(x); }
FLASH_HOST_DEVICE inline double select(bool condition, double yes, double no) { return condition ? yes : no; }

inline Lanes square_root(const Lanes& x) {
  Lanes y;
  for (int lane = 0; lane < lane_count; ++lane) y[lane] = std::sqrt(x[lane]);
  return y;
}
inline Lanes logarithm(const Lanes& x) {
  Lanes y;
  for (int lane = 0; lane < lane_count; ++lane) y[lane] = std::log(x[lane]);
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

}  // namespace flash::sim
