#include "calib/calibrate/stated_uncertainty.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "calib/uncertainty/view_disagreement.h"

namespace flash::calib {
namespace {

constexpr double kDegree = M_PI / 180;

/// Without what the priors of joints and links leave open of X: another recording of the arm has the same. Of
/// estimates under a prior P, C - C P C scatters.
Matrix6d without_joint_priors(const Matrix6d& of_X, const Refinement& refined, const SharedColumns& columns) {
  if (columns.joint_errors.empty()) return of_X;
  Matrix6d scatter = of_X;
  for (std::size_t arm = 0; arm < columns.joint_errors.size(); ++arm) {
    if (columns.joint_errors[arm] < 0) continue;
    const Eigen::VectorXd weights = joint_error_weights(refined.bundle, arm);
    const Eigen::MatrixXd C = refined.covariance.block(0, columns.joint_errors[arm], 6, weights.size());
    scatter -= C * weights.asDiagonal() * C.transpose();
  }
  // Noise levels are uncertain themselves, which widens C: nothing need be left of a direction.
  constexpr double kLeast = 1e-4;
  const Eigen::LLT<Matrix6d> root(of_X);
  const Matrix6d share = root.matrixL().solve(root.matrixL().solve(scatter).transpose());
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(share);
  const Matrix6d L = root.matrixL() * eigen.eigenvectors();
  return L * eigen.eigenvalues().cwiseMax(kLeast).asDiagonal() * L.transpose();
}

/// The parts of a recording: by how much they disagree beyond noise, factors of variances.
struct Parts {
  double views = 1, halves = 1;
  const SplitCheck* worst = nullptr;  ///< of the halves, where they disagree
};

Parts parts_of(Calibration& result, const BundleSettings& settings, const CalibrateSettings& calibrate) {
  if (result.used.size() < 4 * static_cast<std::size_t>(calibrate.least_views)) return {};
  result.splits = {check_halves(result.refined, settings, Split::interleaved)};
  const std::vector<SplitCheck> systematic = check_systematic(result.refined, settings, 0, calibrate.threads);
  result.splits.insert(result.splits.end(), systematic.begin(), systematic.end());
  Parts parts{.views = camera_disagreement(result.refined, settings)};
  parts.halves = split_inflation(systematic, &parts.worst);
  if (parts.worst != nullptr)
    parts.worst = &result.splits[1 + static_cast<std::size_t>(parts.worst - systematic.data())];
  return parts;
}

}  // namespace

double growth(const Matrix6d& less, const Matrix6d& more) {
  return std::max(1.0, less.ldlt().solve(more).trace() / 6);
}

void tell_smooth_errors(Calibration& result, double grown) {
  constexpr double kTold = 1.5;  // of the deviations
  if (!result.pose_errors.found || grown < kTold * kTold) return;
  char text[320];
  std::snprintf(
      text, sizeof text,
      "the robot's errors change smoothly with its pose, as those of a kinematic model or a lens do: "
      "the part common to all views cannot be observed, so its estimated size was added to the stated "
      "standard deviations, which it raised by a factor of %.1f",
      std::sqrt(grown));
  result.warnings.emplace_back(text);
}

double add_uncertainty(Calibration& result, const SystematicUncertainty& systematic,
                       const BundleSettings& settings) {
  const SharedColumns columns = shared_columns(result.refined.bundle, settings.unknowns);
  result.lens_view_factor = lens_disagreement(result.refined, settings);
  result.shared_covariance = with_lens_raised(systematic.covariance, columns, result.lens_view_factor);
  result.covariance = result.shared_covariance.topLeftCorner<6, 6>();
  result.repeatable = without_joint_priors(
      with_lens_raised(result.refined.covariance, columns, result.lens_view_factor).topLeftCorner<6, 6>(),
      result.refined, columns);
  result.pose_errors = systematic.arms.front();
  return growth(result.repeatable, result.covariance);
}

void check_parts(Calibration& result, double smooth, const BundleSettings& settings,
                 const CalibrateSettings& calibrate) {
  const Parts parts = parts_of(result, settings, calibrate);
  const Matrix6d noise = result.refined.covariance.topLeftCorner<6, 6>();
  const auto missing = [&](const Matrix6d& stated, double factor) {
    return std::max(1.0, factor / growth(noise, stated));
  };
  const double scatter = missing(result.repeatable, std::max(parts.halves, parts.views));
  result.repeatable *= scatter;
  tell_smooth_errors(result, smooth / scatter);
  result.covariance_factor = missing(result.covariance, parts.halves);
  result.covariance *= result.covariance_factor;
  raise_to(result.repeatable, result.covariance);
  if (parts.worst == nullptr || result.covariance_factor == 1) return;
  char text[240];
  std::snprintf(
      text, sizeof text,
      "%s differ by %.1f mm and %.2f deg, more than noise explains: drift, or errors that depend on "
      "the pose; the stated standard deviations were raised by %.1f",
      describe(parts.worst->split).c_str(), 1e3 * parts.worst->apart.head<3>().norm(),
      parts.worst->apart.tail<3>().norm() / kDegree, std::sqrt(result.covariance_factor));
  result.warnings.emplace_back(text);
}

}  // namespace flash::calib
