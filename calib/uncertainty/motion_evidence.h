#pragma once
#include <Eigen/Core>
#include <vector>

#include "calib/solve/errors_in_variables.h"
#include "calib/uncertainty/pose_information.h"

namespace flash::calib {

/// Errors of an arm's poses: independent ones, and beside them fields over place and attitude, as
/// CorrelatedPoseErrors has them.
struct ArmErrorLevel {
  double rotation = 0, translation = 0;  ///< of independent errors, standard deviations an axis [rad], [m]
  double smooth = 0;                     ///< of turns by fields [rad]
  double reach = 1;                      ///< of the fields [rad], see squared_distances
};

/// The linearised solution asked of motions of camera or target, all errors of the arm and all shared
/// unknowns integrated out. A motion moves the frame by (dt, dtheta) at each pose; of n poses it is 6 n
/// numbers.
struct MotionTerms {
  double deviance = 0;             ///< -2 log likelihood without a motion, up to a constant
  Eigen::MatrixXd information[2];  ///< 6 n x 6 n, of motions of the camera and of the target
  Eigen::VectorXd pull[2];         ///< 6 n: -2 log likelihood is deviance + m^T information m - 2 m^T pull
};

/// One arm, one camera and one target; see MotionInTime::applies.
class MotionEvidence {
 public:
  MotionEvidence(const Refinement& refined, const BundleSettings& settings);

  MotionTerms at(const ArmErrorLevel& level) const;

  Eigen::Index poses() const { return static_cast<Eigen::Index>(seen_.size()); }

 private:
  std::vector<PoseInformation> seen_;
  Eigen::MatrixXd prior_;   ///< of the shared unknowns
  Eigen::MatrixXd root_;    ///< 6 n x 6: what pictures tell of each pose is root_i root_i^T
  Eigen::MatrixXd fields_;  ///< 6 n x 6 n: covariance of fields that all poses share, of a turn by one radian
  Eigen::MatrixXd squared_;                 ///< distances of poses
  Eigen::MatrixXd rotation_, translation_;  ///< 6 n x 6: of independent errors of unit size
  int columns_[2] = {0, 0};                 ///< of camera and target among the shared unknowns
};

}  // namespace flash::calib
