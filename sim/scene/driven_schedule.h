#pragma once
#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <vector>

#include "sim/scene/schedule.h"

namespace flash::sim {

/// A schedule whose poses are given from outside, step by step. It holds the two between which a step goes. A
/// frame that is given none follows the plan, at the ends of steps.
///
/// Poses that are those of the plan lead to the same steps, bitwise, where the plan has a pose for the end of
/// each step. The count of the steps goes from the plan's start while rounding allows.
class DrivenSchedule {
 public:
  /// `time`: where all frames are as the plan says [s].
  DrivenSchedule(std::shared_ptr<const Schedule> plan, double time, double time_step);

  /// The frame will be at `pose` at the end of the next step, and stays there until it is given another.
  void set(int frame, const Eigen::Isometry3d& pose);

  /// Follows `plan`, which has further frames behind those that are there. `time`: where these begin [s].
  void extend(std::shared_ptr<const Schedule> plan, double time);

  /// Goes on to the step that starts at `time` [s].
  void begin_step(double time);

  /// A copy shares its poses until it has its own.
  void own_poses() { poses_ = std::make_shared<Schedule>(*poses_); }

  /// Its poses are those of the step at hand.
  std::shared_ptr<const Schedule> schedule() const { return poses_; }

 private:
  std::shared_ptr<const Schedule> plan_;
  std::shared_ptr<Schedule> poses_;                        ///< at the start and at the end of a step
  std::vector<std::optional<Eigen::Isometry3d>> targets_;  ///< of frames that are given poses
};

}  // namespace flash::sim
