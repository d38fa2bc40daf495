#include "calib/uncertainty/joint_zeros.h"

#include "calib/solve/linearization.h"

namespace flash::calib {

std::optional<JointZeros> joint_zeros(const Bundle& bundle, const Unknowns& unknowns,
                                      const Eigen::MatrixXd& covariance) {
  const SharedColumns columns = shared_columns(bundle, unknowns);
  if (columns.joint_zeros.empty() || columns.joint_zeros.front() < 0) return std::nullopt;
  const Eigen::VectorXd& zeros = bundle.joint_zeros.front();
  return JointZeros{zeros,
                    covariance.diagonal().segment(columns.joint_zeros.front(), zeros.size()).cwiseSqrt()};
}

}  // namespace flash::calib
