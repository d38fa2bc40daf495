#include "calib/solve/target_size.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "calib/solve/linearization.h"

namespace flash::calib {

bool clearly_off(const ScaleCheck& scale) {
  constexpr double kClearly = 3, kPrint = 0.03;
  const double off = std::abs(scale.estimate - 1);
  return off > kClearly * scale.sd && off <= kPrint;
}

namespace {

/// Of each target's size at this solution. Lengths that the robot only seems to move, three a view with the
/// size of its noise, look like knowledge of the size and pull it down by their share: `least` times as much
/// must be left.
bool told(const Refinement& refined, const BundleSettings& settings, const std::vector<int>& columns,
          double least) {
  const double seeming = 3 * static_cast<double>(refined.bundle.poses.size());
  const Eigen::MatrixXd information =
      solve_linear(linearize(refined.bundle, refined.noise, settings), to_components(refined.noise))
          .information;
  const Eigen::LDLT<Eigen::MatrixXd> factor(information);
  return std::all_of(columns.begin(), columns.end(), [&](int column) {
    const double variance = factor.solve(Eigen::VectorXd::Unit(information.rows(), column))[column];
    return variance > 0 && variance * least * seeming < 1;
  });
}

}  // namespace

std::vector<ScaleCheck> check_scales(const Refinement& refined, const RefineSettings& settings) {
  RefineSettings with_scale = settings;
  with_scale.estimate_pivots = false;
  with_scale.noise = refined.noise;
  with_scale.bundle.unknowns.scales = true;
  const std::vector<int> columns = shared_columns(refined.bundle, with_scale.bundle.unknowns).scales;
  // A size that is badly wrong reads as noise of the robot until it is free: first only what cannot be
  // solved.
  if (!told(refined, with_scale.bundle, columns, 1)) return {};
  const Refinement scaled = refine(refined.bundle, with_scale);
  const bool collapsed = std::any_of(scaled.bundle.scales.begin(), scaled.bundle.scales.end(),
                                     [](double scale) { return !(scale > 0.5 && scale < 2); });
  if (collapsed || !told(scaled, with_scale.bundle, columns, 100)) return {};
  std::vector<ScaleCheck> checks;
  for (const int column : columns)
    checks.push_back({scaled.bundle.scales[checks.size()], std::sqrt(scaled.covariance(column, column))});
  return checks;
}

}  // namespace flash::calib
