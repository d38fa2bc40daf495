#pragma once
#include <optional>
#include <string>
#include <vector>

#include "calib/geometry/arm_model.h"
#include "calib/solve/bundle_adjustment.h"

namespace flash::calib {

/// By how much an arm differs from its description (error_motions()): its joints were farther than it said,
/// its links longer, beside their priors.
struct JointErrors {
  Eigen::VectorXd estimate, sd, prior_sd;  ///< [rad], then [m]

  Eigen::Vector2d interval(Eigen::Index i) const;  ///< of 95 %
  /// The data at least halve the deviation; else it is as good as the prior.
  bool told(Eigen::Index i) const;
};

/// covariance: of all shared unknowns. None where no joints are known.
std::optional<JointErrors> joint_errors(const Bundle& bundle, const Unknowns& unknowns,
                                        const Eigen::MatrixXd& covariance);

/// A sentence of each that is farther off than was to be expected, the farthest first.
std::vector<std::string> joints_far_off(const JointErrors& errors, const ArmModel& arm);

/// By how much a gripper is off, at a distance from the base, that motions of first order in the zeros put
/// there [m]: half of the squares of those turns.
double second_order(const JointErrors& errors, const ArmModel& arm, double distance);

/// "x", or the three numbers.
std::string direction_name(const Eigen::Vector3d& direction);

}  // namespace flash::calib
