#include "calib/calibrate/stated_uncertainty.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "calib/uncertainty/view_disagreement.h"

namespace flash::calib {
namespace {

constexpr double kDegree = M_PI / 180;

/// By how much the variances of `more` are larger than those of `less`, in the mean over their directions.
double growth(const Matrix6d& less, const Matrix6d& more) {
  return std::max(1.0, less.ldlt().solve(more).trace() / 6);
}

}  // namespace

void add_uncertainty(Calibration& result, const SystematicUncertainty& systematic,
                     const BundleSettings& settings) {
  const SharedColumns columns = shared_columns(result.refined.bundle, settings.unknowns);
  const double lens = lens_disagreement(result.refined, settings);
  result.lens_view_factor = lens;
  result.shared_covariance = with_lens_raised(systematic.covariance, columns, lens);
  result.covariance = result.shared_covariance.topLeftCorner<6, 6>();
  result.repeatable = with_lens_raised(result.refined.covariance, columns, lens).topLeftCorner<6, 6>();
  const CorrelatedPoseErrors& errors = result.pose_errors.emplace(systematic.arms.front());
  constexpr double kTold = 1.5;  // of the deviations
  const double grown = growth(result.repeatable, result.covariance);
  if (!errors.found || grown < kTold * kTold) return;
  char text[320];
  std::snprintf(
      text, sizeof text,
      "the robot's errors change smoothly with its pose, as those of a kinematic model or a lens do: "
      "the part common to all views cannot be observed, so its estimated size was added to the stated "
      "standard deviations, which it raised by a factor of %.1f",
      std::sqrt(grown));
  result.warnings.emplace_back(text);
}

void check_parts(Calibration& result, const BundleSettings& settings, const CalibrateSettings& calibrate) {
  if (result.used.size() < 4 * static_cast<std::size_t>(calibrate.least_views)) return;
  const std::vector<SplitCheck> systematic = check_systematic(result.refined, settings, 0, calibrate.threads);
  result.splits = {check_halves(result.refined, settings, Split::interleaved)};
  result.splits.insert(result.splits.end(), systematic.begin(), systematic.end());
  const SplitCheck* worst = nullptr;
  const double of_halves = split_inflation(systematic, &worst),
               of_views = camera_disagreement(result.refined, settings);
  const Matrix6d noise = result.refined.covariance.topLeftCorner<6, 6>();
  const auto missing = [&](const Matrix6d& stated, double factor) {
    return std::max(1.0, factor / growth(noise, stated));
  };
  result.repeatable *= missing(result.repeatable, std::max(of_halves, of_views));
  result.covariance *= missing(result.covariance, of_views);
  result.covariance_factor = missing(result.covariance, of_halves);
  if (worst == nullptr || result.covariance_factor == 1) return;
  result.covariance *= result.covariance_factor;
  char text[240];
  std::snprintf(
      text, sizeof text,
      "%s differ by %.1f mm and %.2f deg, more than noise explains: drift, or errors that depend on "
      "the pose; the stated standard deviations were raised by %.1f",
      describe(worst->split).c_str(), 1e3 * worst->apart.head<3>().norm(),
      worst->apart.tail<3>().norm() / kDegree, std::sqrt(result.covariance_factor));
  result.warnings.emplace_back(text);
}

}  // namespace flash::calib
