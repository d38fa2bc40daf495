#pragma once
#include <Eigen/Cholesky>
#include <functional>
#include <map>
#include <utility>
#include <vector>

#include "calib/solve/errors_in_variables.h"
#include "calib/solve/reml.h"

namespace flash::calib {

/// A motion of a shape in time that is normal about none, with these standard deviations an axis.
struct UncertainMotion {
  std::vector<double> shape;
  double turn_sd = 0, shift_sd = 0;  ///< [rad], [m]
  double of_noise = 0;               ///< beside these, that many of the robot's own in both
};

/// What a solution's views say of a camera or a target that did not stand still: at pose i its frame stood
/// moved by shape[i] * motion, (dt, dtheta) [m, rad], from where the solution has it. The motion's six
/// unknowns are added to the linearised solution. Its likelihood is the largest over how much smaller the
/// robot's errors become beside it. Where the robot has next to none, corners alone have to tell it.
class MotionInTime {
 public:
  /// Corrections are unknowns, and there is one arm and one camera; see `applies`.
  MotionInTime(const Refinement& refined, const BundleSettings& settings);
  static bool applies(const Bundle& bundle, const BundleSettings& settings);

  struct Fit {
    Eigen::VectorXd motion;  ///< six numbers for each shape
    double fall = 0;         ///< of -2 log likelihood
  };
  /// Several shapes together; empty where they determine nothing.
  Fit fit(const std::vector<std::vector<double>>& shapes, bool camera) const;

  /// Squared length, in its own standard deviations, of the motion that a shape wants at the noise as it is:
  /// chi-square with six degrees of freedom where there was none.
  double misfit(const std::vector<double>& shape) const;

  /// -2 log likelihood with such motions integrated out, up to a constant that is the same for all.
  double deviance(const std::vector<UncertainMotion>& motions, bool camera) const;

  /// By how much X moves, along its own axes, where a motion of unit size and that shape took place, but is
  /// not solved for; `solved`: another that is, or none.
  Matrix6d shift_of_camera(const std::vector<double>& shape, const std::vector<double>& solved,
                           bool camera) const;
  /// By how much the covariance of X grows where a motion of that shape is solved for.
  Matrix6d growth(const std::vector<double>& shape, bool camera) const;

  double numbers() const { return numbers_; }  ///< that the robot's errors are told by

 private:
  /// How many steps smaller than estimated the robot's errors are, in rotation and in translation.
  using Shares = std::pair<int, int>;
  /// The linearised solution at such noise.
  struct Level {
    Level(const LinearModel& model, const std::vector<double>& sigmas);
    std::vector<Eigen::MatrixXd> grams;
    Eigen::MatrixXd all;  ///< their sum, and what is known beforehand
    Eigen::LDLT<Eigen::MatrixXd> shared;
    double deviance = 0;                   ///< -2 log likelihood without a motion, up to a constant
    double rotation = 0, translation = 0;  ///< the robot's noise [rad], [m]
  };
  struct Joint {
    Eigen::MatrixXd cross;        ///< of shared unknowns and motions
    Eigen::MatrixXd information;  ///< of motions, shared unknowns eliminated
    Eigen::VectorXd pull;
  };
  const Level& level(const Shares& shares) const;
  /// Where the deviance is least, and how large it is.
  std::pair<Shares, double> least_deviance(const std::function<double(const Level&)>& deviance) const;
  Joint joint(const Level& level, const std::vector<std::vector<double>>& shapes, bool camera) const;

  LinearModel model_;
  NoiseLevels noise_;
  mutable std::map<Shares, Level> levels_;  ///< those that were asked for
  double still_ = 0;                        ///< the least deviance without a motion
  int camera_column_ = 0, target_column_ = 0;
  double numbers_ = 0;
};

/// More than what the errors of an arm in use that two halves of a recording do not share put between them:
/// 0.1 deg, and what they amount to at the target.
bool beyond_usual(const Bundle& bundle, const Vector6d& motion);

}  // namespace flash::calib
