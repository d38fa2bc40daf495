#pragma once
#include <optional>

#include "calib/solve/bundle_adjustment.h"

namespace flash::calib {

/// By how much the joints of an arm were farther than it said, beside its priors: where its zeros are off.
struct JointZeros {
  Eigen::VectorXd estimate, sd;  ///< [rad]
};

/// covariance: of all shared unknowns. None where no joints are known.
std::optional<JointZeros> joint_zeros(const Bundle& bundle, const Unknowns& unknowns,
                                      const Eigen::MatrixXd& covariance);

}  // namespace flash::calib
