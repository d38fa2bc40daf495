#pragma once
#include <cmath>
#include <random>

namespace flash::sysid {

/// Random numbers that are the same with every standard library, whose own distributions differ.
class RandomNumbers {
 public:
  explicit RandomNumbers(unsigned seed) : bits_(seed) {}

  /// Evenly in [0, 1).
  double uniform() { return static_cast<double>(bits_() >> 11U) * 0x1p-53; }

  /// Of mean 0 and variance 1, by Box and Muller.
  double normal() {
    const double radius = std::sqrt(-2 * std::log(1 - uniform()));
    return radius * std::cos(2 * M_PI * uniform());
  }

 private:
  std::mt19937_64 bits_;
};

}  // namespace flash::sysid
