#include "calib/uncertainty/target_size.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "calib/solve/linearization.h"
#include "data/numbers/chi_square.h"

namespace flash::calib {
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

/// The solution with nothing known of the sizes; none where the data do not tell them.
std::optional<Refinement> without_prior(Refinement refined, RefineSettings settings, double begun) {
  settings.estimate_pivots = false;
  settings.noise = refined.noise;
  settings.bundle.unknowns.scales = true;
  refined.bundle.priors.scale_sd.clear();
  const std::vector<int> columns = shared_columns(refined.bundle, settings.bundle.unknowns).scales;
  // A size that is badly wrong reads as noise of the robot until it is free: first only what cannot be
  // solved.
  if (!told(refined, settings.bundle, columns, 1)) return std::nullopt;
  Refinement scaled = refine(refined.bundle, settings);
  const bool measured = std::all_of(scaled.bundle.scales.begin(), scaled.bundle.scales.end(),
                                    [begun](double size) { return measurable_size(size / begun); });
  if (!measured || !told(scaled, settings.bundle, columns, 100)) return std::nullopt;
  return scaled;
}

}  // namespace

bool TargetSize::far_off() const {
  constexpr double kFar = 3;
  return wanted && std::isfinite(prior_sd) &&
         std::abs(wanted->estimate - 1) > kFar * std::hypot(wanted->sd, prior_sd);
}

SizedRefinement refine_sizes(Refinement refined, const RefineSettings& settings, double begun) {
  const bool unknown = settings.bundle.unknowns.scales;
  const PoseErrorModel errors = fit_pose_errors(refined, settings.bundle);
  SizedRefinement result{std::move(refined), {}, {}};
  result.systematic = systematic_uncertainty(result.refined, settings.bundle, errors);
  if (unknown && !result.refined.bundle.priors.scale_sd.empty()) {
    RefineSettings again = settings;
    again.estimate_pivots = false;
    again.noise = result.refined.noise;
    result.refined.bundle.priors.caution = result.systematic.caution;
    result.refined = refine(std::move(result.refined.bundle), again);
    result.systematic = systematic_uncertainty(result.refined, settings.bundle, errors);
  }
  const std::optional<Refinement> free = without_prior(result.refined, settings, begun);
  Unknowns with_scales = settings.bundle.unknowns;
  with_scales.scales = true;
  const Bundle& bundle = result.refined.bundle;
  const std::vector<int> columns = shared_columns(bundle, with_scales).scales;
  for (std::size_t target = 0; target < bundle.scales.size(); ++target) {
    TargetSize& size = result.sizes.emplace_back();
    const int column = columns[target];
    size.estimate = bundle.scales[target];
    size.prior_sd = unknown ? known_scale_sd(bundle.priors, target) : 0;
    if (unknown) size.sd = std::sqrt(result.systematic.covariance(column, column));
    if (free)
      size.wanted = {free->bundle.scales[target],
                     result.systematic.caution[target] * std::sqrt(free->covariance(column, column))};
    if (!size.far_off()) continue;
    const Vector6d apart = motion_between(bundle.cameras.front(), free->bundle.cameras.front());
    const Matrix6d covariance = result.systematic.covariance.topLeftCorner<6, 6>(),
                   scatter = result.refined.covariance.topLeftCorner<6, 6>();
    // A print that is off by so much is not that one, whatever hides in the robot's errors.
    constexpr double kGross = 0.05;
    const bool gross = std::abs(size.wanted->estimate - 1) > kGross;
    const Matrix6d& bears = gross ? scatter : covariance;
    result.disputed = result.disputed || apart.dot(bears.ldlt().solve(apart)) > data::chi_square_95_of_6;
  }
  return result;
}

namespace {

/// Of the shared unknowns, which follow each size by as much as it may be off.
Eigen::MatrixXd following_sizes(const Refinement& refined, const BundleSettings& settings,
                                const std::vector<double>& variances) {
  BundleSettings with_scales = settings;
  with_scales.unknowns.scales = true;
  Bundle bundle = refined.bundle;
  bundle.priors.scale_sd.clear();
  const std::vector<int> scales = shared_columns(bundle, with_scales.unknowns).scales;
  Eigen::MatrixXd information =
      solve_linear(linearize(bundle, refined.noise, with_scales), to_components(refined.noise)).information;
  std::vector<Eigen::Index> kept;  // columns of the other unknowns
  for (Eigen::Index column = 0; column < information.cols(); ++column)
    if (std::find(scales.begin(), scales.end(), static_cast<int>(column)) == scales.end())
      kept.push_back(column);
  const Eigen::LDLT<Eigen::MatrixXd> others(information(kept, kept));
  const bool solved = settings.unknowns.scales;
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(refined.covariance.rows(), refined.covariance.cols());
  for (std::size_t target = 0; target < variances.size(); ++target) {
    const Eigen::VectorXd shift = others.solve(information(kept, scales[target]));
    Eigen::VectorXd all = Eigen::VectorXd::Zero(covariance.rows());
    if (solved) {
      all(kept) = shift;
      all[scales[target]] = -1;
    } else {
      all = shift;
    }
    covariance += variances[target] * all * all.transpose();
  }
  return covariance;
}

}  // namespace

Eigen::MatrixXd covariance_of_kept_sizes(const Refinement& refined, const BundleSettings& settings,
                                         const std::vector<TargetSize>& sizes,
                                         const std::vector<double>& sd) {
  std::vector<double> variances;
  for (std::size_t target = 0; target < sizes.size(); ++target) {
    double& variance = variances.emplace_back(sd[target] * sd[target]);
    if (const auto& wanted = sizes[target].wanted)
      variance += std::max(0.0, std::pow(wanted->estimate - 1, 2) - std::pow(wanted->sd, 2) - variance);
  }
  return following_sizes(refined, settings, variances);
}

Eigen::MatrixXd covariance_of_disputed_sizes(const Refinement& refined, const BundleSettings& settings,
                                             const std::vector<TargetSize>& sizes) {
  constexpr double kAgree = 2;  // deviations
  std::vector<double> variances;
  for (const TargetSize& size : sizes) {
    double& variance = variances.emplace_back(0);
    if (!size.wanted || !std::isfinite(size.prior_sd)) continue;
    const double apart = std::abs(size.wanted->estimate - 1),
                 agree = kAgree * std::hypot(size.wanted->sd, size.prior_sd);
    if (apart <= agree) continue;
    const double farther =
        std::max(std::abs(size.estimate - 1), std::abs(size.wanted->estimate - size.estimate));
    variance = std::pow(farther / apart, 2) * (apart * apart - agree * agree);
  }
  return following_sizes(refined, settings, variances);
}

std::string size_sentence(const TargetSize& size) {
  char known[40] = "was to be kept", text[320];
  if (size.prior_sd > 0) std::snprintf(known, sizeof known, "is known to %.2g %%", 100 * size.prior_sd);
  std::snprintf(
      text, sizeof text,
      "the estimated size of the target is %.4f +- %.4f (2 sd) of the stated one, which %s: measure a "
      "square; "
      "if the print is right, check the focal length and the unit of the robot's poses; the answer is for "
      "%.4f (--target-size solved takes the estimate)",
      size.wanted->estimate, 2 * size.wanted->sd, known, size.estimate);
  return text;
}

}  // namespace flash::calib
