#pragma once
#include <optional>

#include "calib/solve/errors_in_variables.h"

namespace flash::calib {

/// A view without which the answer would not be known.
struct LoneView {
  std::size_t pose = 0;
  double growth = 1;                           ///< of X's standard deviation along its worst direction
  Matrix6d covariance = Matrix6d::Identity();  ///< of X, of what is left without it
};

/// The view that X hangs on most, where without it some direction of X would be known several times worse.
/// None of fewer than eight views, all of which count.
std::optional<LoneView> lone_view(const Refinement& refined, const BundleSettings& settings);

}  // namespace flash::calib
