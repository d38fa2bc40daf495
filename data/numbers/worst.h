#pragma once
#include <limits>

namespace flash::data {

/// The larger one; infinity where either is not a number, which std::max may lose.
inline double worst(double a, double b) {
  return a >= b ? a : b >= a ? b : std::numeric_limits<double>::infinity();
}

}  // namespace flash::data
