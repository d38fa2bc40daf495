#include "calib/target_size.h"

#include <cmath>

#include "calib/linearization.h"

namespace flash::calib {

bool clearly_off(const ScaleCheck& scale) {
  constexpr double kClearly = 3, kPrint = 0.03;
  const double off = std::abs(scale.estimate - 1);
  return off > kClearly * scale.sd && off <= kPrint;
}

std::vector<ScaleCheck> check_scales(const Refinement& refined, const RefineSettings& settings) {
  RefineSettings with_scale = settings;
  with_scale.estimate_pivots = false;
  with_scale.noise = refined.noise;
  with_scale.bundle.unknowns.scales = true;
  const Refinement scaled = refine(refined.bundle, with_scale);
  std::vector<ScaleCheck> checks;
  for (const int column : shared_columns(scaled.bundle, with_scale.bundle.unknowns).scales)
    checks.push_back({scaled.bundle.scales[checks.size()], std::sqrt(scaled.covariance(column, column))});
  return checks;
}

}  // namespace flash::calib
