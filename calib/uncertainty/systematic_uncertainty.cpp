#include "calib/uncertainty/systematic_uncertainty.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "calib/solve/linearization.h"
#include "calib/uncertainty/pose_information.h"

namespace flash::calib {

SystematicUncertainty systematic_uncertainty(const Refinement& refined, const BundleSettings& settings,
                                             const PoseErrorModel& model) {
  SystematicUncertainty result{refined.covariance, model.arms, {}};
  result.caution.assign(refined.bundle.targets.size(), 1);
  if (settings.unknowns.joint_errors) return result;  // which the covariance holds
  const std::vector<PoseInformation> all = pose_informations(refined, settings);
  const Bundle& bundle = refined.bundle;
  const SharedColumns columns = shared_columns(bundle, settings.unknowns);
  const Eigen::Index s = refined.covariance.rows();
  Eigen::MatrixXd information = linearize(bundle, refined.noise, settings).prior.topLeftCorner(s, s);
  Eigen::MatrixXd data = Eigen::MatrixXd::Zero(s, s);
  std::vector<Eigen::MatrixXd> gains;  // of the shared unknowns by what the prior says of a pose
  for (const PoseInformation& pose : all) {
    const Eigen::LDLT<Matrix6d> ldlt(pose.H + pose.prior);
    data += pose.H_ss - pose.H_s.transpose() * ldlt.solve(pose.H_s);
    gains.push_back(pose.H_s.transpose() * ldlt.solve(pose.prior));
  }
  information += data;
  // What the errors of the poses add to the score of the shared unknowns.
  Eigen::MatrixXd more = Eigen::MatrixXd::Zero(s, s);
  for (std::size_t arm = 0; arm < model.arms.size(); ++arm) {
    if (model.covariance[arm].size() == 0) continue;
    const std::vector<std::size_t>& poses = model.poses[arm];
    Eigen::MatrixXd rows(s, 6 * static_cast<Eigen::Index>(poses.size()));
    for (std::size_t i = 0; i < poses.size(); ++i) {
      rows.middleCols<6>(6 * static_cast<Eigen::Index>(i)) = gains[poses[i]];
      // In place of the independent errors that the solution was made with.
      more -= model.arms[arm].share * gains[poses[i]] *
              all[poses[i]].prior.ldlt().solve(gains[poses[i]].transpose());
    }
    more += rows * model.covariance[arm] * rows.transpose();
  }
  const Eigen::LDLT<Eigen::MatrixXd> shared(information);
  result.covariance += shared.solve(shared.solve(more).transpose());
  for (std::size_t target = 0; target < bundle.targets.size(); ++target) {
    const int column = columns.scales[target];
    if (column < 0) continue;
    // The prior counts for what it is, however much it weighs in the solution.
    const double weight = std::pow(prior_scale_sd(bundle.priors, target), -2);
    const Eigen::VectorXd gain = weight * shared.solve(Eigen::VectorXd::Unit(s, column));
    const double known = known_scale_sd(bundle.priors, target);
    if (std::isfinite(known))
      result.covariance += (std::pow(known, 2) - 1 / weight) * gain * gain.transpose();
    constexpr double kUnknown = 1e-2;  // a size known to a factor of ten: pictures may tell nothing of it
    Eigen::MatrixXd alone = data;
    for (const int other : columns.scales) alone(other, other) += kUnknown;
    const Eigen::VectorXd row = alone.ldlt().solve(Eigen::VectorXd::Unit(s, column));
    result.caution[target] = std::sqrt(std::max(1.0, 1 + row.dot(more * row) / row[column]));
  }
  return result;
}

}  // namespace flash::calib
