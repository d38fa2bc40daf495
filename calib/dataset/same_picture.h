#pragma once
#include "calib/dataset/observation.h"

namespace flash::calib {

/// Whether two observations are of one picture: noise alone would move some corner by more.
inline bool of_same_picture(const Observation& a, const Observation& b) {
  constexpr double kSame = 1e-6;  // [px]
  return a.pixels.cols() > 0 && a.points == b.points && (a.pixels - b.pixels).cwiseAbs().maxCoeff() < kSame;
}

}  // namespace flash::calib
