#pragma once
#include <Eigen/Core>
#include <optional>
#include <vector>

#include "calib/calibrate/calibrate.h"
#include "calib/solve/pose_space.h"

namespace flash::calib {

/// Size of the target and focal length of the camera that saw it, of pairs of poses.
struct PairScales {
  TargetSize size;
  /// Told as a size is. None: it is kept, and the pairs do not exclude it, or no camera saw the targets.
  std::optional<TargetSize> focal_length = {};
  Eigen::Matrix2d covariance =
      Eigen::Matrix2d::Zero();  ///< of the logs of both, of those that are solved for
  Eigen::Matrix2d repeatable = Eigen::Matrix2d::Zero();  ///< likewise, of what another recording would change
  Eigen::Vector2d information = Eigen::Vector2d::Zero();  ///< of what was known beforehand of each
  Eigen::Vector2d kept_sd = Eigen::Vector2d::Zero();      ///< of those that are kept: what they may be off

  SeenScales estimate() const;
};

/// What is known of both and what pairs want, by their deviations; loops: left as they are seen with that.
/// Throws data::InputError where a size is to be solved for and the pairs do not tell it.
PairScales settle_scales(std::vector<PoseLoop>& loops, const std::vector<Observation>& observations,
                         const HandEyePoses& seed, const std::optional<AlongPrior>& along,
                         const CalibrateSettings& settings);

/// How X follows the logs of (size, focal length), about loops that are seen with these.
Eigen::Matrix<double, 6, 2> camera_by_scales(const std::vector<PoseLoop>& loops, const HandEyePoses& poses,
                                             const std::optional<AlongPrior>& along);

/// A size or a focal length that pairs exclude is the cause of whatever else does not fit, and of an answer
/// that depends on it. loops: as settle_scales left them.
void tell_scales(Calibration& result, const std::vector<PoseLoop>& loops,
                 const std::optional<AlongPrior>& along, const CalibrateSettings& settings);

/// Few pairs do not tell a size beside their noise, but whether they close with another one.
void tell_size_of_few(Calibration& result, const std::vector<Observation>& all,
                      const CalibrateSettings& settings);

/// How many targets stand where no camera sees them: behind it, or more than 75 deg off its axis; and of how
/// many.
struct Unseen {
  std::size_t count = 0, of = 0;

  bool plainly() const;  ///< more than outliers may be
};
Unseen unseen_targets(const std::vector<Observation>& observations);

}  // namespace flash::calib
