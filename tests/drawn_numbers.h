#pragma once
#include <rapidcheck.h>

#include <Eigen/Core>
#include <cmath>
#include <random>

namespace flash {

// Numbers drawn by rapidcheck inside of a property: evenly, and smaller ones where a case that fails is made
// smaller.

inline int draw_below(int count) { return *rc::gen::resize(rc::kNominalSize, rc::gen::inRange(0, count)); }

inline double draw(double low, double high) {
  constexpr int parts = 1 << 24;
  return low + (high - low) * draw_below(parts) / parts;
}

/// Evenly in the logarithm.
inline double draw_log(double low, double high) { return std::exp(draw(std::log(low), std::log(high))); }

inline bool draw_chance(double share) { return draw(0, 1) > 1 - share; }

inline Eigen::Vector3d draw_direction() {
  const double z = draw(-1, 1), angle = draw(0, 2 * M_PI), along = std::sqrt(1 - z * z);
  return {along * std::cos(angle), along * std::sin(angle), z};
}

/// Evenly in [-size, size], all from one seed: so many draws would be slow to make smaller.
inline Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor> draw_noise(Eigen::Index rows, double size) {
  std::mt19937_64 generator(static_cast<unsigned long>(draw_below(1 << 20)));
  Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor> noise(rows, 3);
  for (double& value : noise.reshaped())
    value = size * (2 * static_cast<double>(generator() >> 11) * 0x1p-53 - 1);
  return noise;
}

}  // namespace flash
