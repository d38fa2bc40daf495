#pragma once
#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "calib/calibrate/calibrate.h"

namespace flash::calib {

enum class PlanCriterion {
  determinant,  ///< smallest volume of the uncertain region (D-optimal)
  trace         ///< smallest sum of variances, a radian counting as the target's distance (A-optimal)
};

struct PlanSettings {
  int poses = 5;
  PlanCriterion criterion = PlanCriterion::trace;
  Eigen::Vector3d lower = Eigen::Vector3d::Constant(-1e9);  ///< of the gripper in the base [m]
  Eigen::Vector3d upper = Eigen::Vector3d::Constant(1e9);
  double reach =
      0.10;  ///< how far beyond the box of the poses already used candidates go, where bounds allow [m]
  double tilt = 0.8;  ///< of the gripper from the mean orientation, at most [rad]
  double turn = 1.6;  ///< about its axis from the mean orientation, at most [rad]
  /// Of an arm that cannot tilt: turns about its axis alone, the place along it aside.
  bool one_axis = false;
  double margin = 0.05;   ///< of the target's points from the edge of the picture, as a share of its width
  double steepest = 1.1;  ///< angle between line of sight and the target's normal, at most [rad]
  int candidates = 600;
  unsigned seed = 1;
};

struct PlannedPose {
  Eigen::Isometry3d T_base_gripper = Eigen::Isometry3d::Identity();
  double translation_sd = 0;  ///< of X once this pose and those before it are taken, rms of three axes [m]
  double rotation_sd = 0;     ///< likewise [rad]
};

struct Plan {
  double translation_sd = 0, rotation_sd = 0;  ///< of X as it is
  std::vector<PlannedPose> poses;              ///< in the order of their worth
  int visible = 0;                             ///< candidates that see the whole target
};

/// Next poses, one after the other, each the candidate that lowers the predicted covariance of X most: the
/// information of a view about X and all else that was solved for (lens, size, warp), with the noise levels
/// of the calibration and its robot correction marginalised, is added to what is there. Candidates are
/// turned from the poses used and aimed at the target, are kept within the bounds, and must see all of the
/// target. A place along the axis of turns that is not told counts, unless no pose could tell it. Throws
/// data::InputError where no candidate sees the target, and where an arm of one axis turned about two.
Plan plan_poses(const Calibration& calibration, const Eigen::Matrix3Xd& points,
                const PlanSettings& settings = {});

}  // namespace flash::calib
