#pragma once
#include <Eigen/Core>
#include <cmath>
#include <random>

namespace flash::sim {

/// Draws that do not depend on the standard library's distributions. A call draws for one argument only, or
/// for several in braces: compilers differ in the order of the others.
class Lot {
 public:
  explicit Lot(unsigned long seed) : generator_(seed) {}
  double uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(generator_() >> 11) * 0x1p-53;
  }
  double log_uniform(double low, double high) { return std::exp(uniform(std::log(low), std::log(high))); }
  int below(int count) { return static_cast<int>(generator_() % static_cast<unsigned long>(count)); }
  bool chance(double share) { return uniform(0, 1) < share; }
  Eigen::Vector3d direction() {
    Eigen::Vector3d v;
    do v = {uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)};
    while (v.norm() > 1 || v.norm() < 0.1);
    return v.normalized();
  }

 private:
  std::mt19937_64 generator_;
};

}  // namespace flash::sim
