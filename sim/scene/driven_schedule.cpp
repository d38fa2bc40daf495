#include "sim/scene/driven_schedule.h"

#include <cmath>
#include <utility>

namespace flash::sim {

DrivenSchedule::DrivenSchedule(std::shared_ptr<const Schedule> plan, double time, double time_step)
    : plan_(std::move(plan)), poses_(std::make_shared<Schedule>()), targets_(plan_->frames.size()) {
  poses_->start = plan_->start;
  poses_->time_step = time_step;
  for (std::size_t f = 0; f < targets_.size(); ++f)
    poses_->frames.emplace_back(2, pose_at(*plan_, static_cast<int>(f), time));
}

void DrivenSchedule::set(int frame, const Eigen::Isometry3d& pose) {
  targets_[static_cast<std::size_t>(frame)] = pose;
}

void DrivenSchedule::extend(std::shared_ptr<const Schedule> plan, double time) {
  plan_ = std::move(plan);
  for (std::size_t f = targets_.size(); f < plan_->frames.size(); ++f)
    poses_->frames.emplace_back(2, pose_at(*plan_, static_cast<int>(f), time));
  targets_.resize(plan_->frames.size());
}

void DrivenSchedule::begin_step(double time) {
  constexpr double rounding =
      5e-7;  // of a time that is a sum of steps, in steps: half of what pose_at allows
  Schedule& poses = *poses_;
  const double steps = (time - poses.start) / poses.time_step;
  poses.first = std::lround(steps);
  if (std::abs(steps - static_cast<double>(poses.first)) > rounding) {
    poses.start = time;
    poses.first = 0;
  }
  for (std::size_t f = 0; f < targets_.size(); ++f) {
    std::vector<Eigen::Isometry3d>& two = poses.frames[f];
    two[0] = two[1];
    two[1] = targets_[f] ? *targets_[f] : pose_at(*plan_, static_cast<int>(f), time + poses.time_step);
  }
}

}  // namespace flash::sim
