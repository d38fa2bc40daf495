#include "calib/uncertainty/joint_errors.h"

#include "calib/solve/linearization.h"

namespace flash::calib {

Eigen::Vector2d JointErrors::interval(Eigen::Index i) const {
  constexpr double k95 = 1.96;
  return {estimate[i] - k95 * sd[i], estimate[i] + k95 * sd[i]};
}

bool JointErrors::told(Eigen::Index i) const {
  constexpr double kTold = 0.5;
  return sd[i] <= kTold * prior_sd[i];
}

std::optional<JointErrors> joint_errors(const Bundle& bundle, const Unknowns& unknowns,
                                        const Eigen::MatrixXd& covariance) {
  const SharedColumns columns = shared_columns(bundle, unknowns);
  if (columns.joint_errors.empty() || columns.joint_errors.front() < 0) return std::nullopt;
  const Eigen::VectorXd& errors = bundle.joint_errors.front();
  return JointErrors{errors,
                     covariance.diagonal().segment(columns.joint_errors.front(), errors.size()).cwiseSqrt(),
                     bundle.joint_error_sd.front()};
}

}  // namespace flash::calib
