#include "calib/solve/time_offset.h"

#include <algorithm>
#include <cmath>

#include "calib/solve/robust_seed.h"

namespace flash::calib {
namespace {

constexpr double kLargestGap = 0.5;  // between poses that are interpolated [s]

bool covers(const data::Trajectory& stream, double from, double to) {
  if (stream.times.empty() || from < stream.times.front() || to > stream.times.back()) return false;
  auto next = std::upper_bound(stream.times.begin(), stream.times.end(), from);
  for (; next != stream.times.end(); ++next) {
    if (*next - *std::prev(next) > kLargestGap) return false;
    if (*next >= to) break;
  }
  return true;
}

double score_at(Setup setup, const std::vector<Observation>& views, const std::vector<Symmetry>& symmetries) {
  std::vector<Eigen::Isometry3d> robot;
  std::vector<std::vector<Eigen::Isometry3d>> candidates(views.size());
  for (std::size_t i = 0; i < views.size(); ++i) {
    robot.push_back(pose_loop(setup, views[i].T_base_gripper, Eigen::Isometry3d::Identity()).G);
    for (const Symmetry& symmetry : symmetries)
      for (const Eigen::Isometry3d& T : views[i].T_camera_target)
        candidates[i].push_back(T * symmetry.turn.inverse());
  }
  const RobustSeed robust_seed = find_robust_seed(robot, candidates, {.triples = 40, .kept = 2});
  return robust_seed.found ? robust_seed.score : 1e9;
}

}  // namespace

std::optional<Motion> motion_at(const data::Trajectory& stream, double t, double half) {
  if (!covers(stream, t - half, t + half)) return std::nullopt;
  Motion motion;
  motion.pose = data::pose_at(stream, t);
  motion.velocity = (motion_between(motion.pose, data::pose_at(stream, t + half)) -
                     motion_between(motion.pose, data::pose_at(stream, t - half))) /
                    (2 * half);
  return motion;
}

std::vector<Observation> placed(const data::Trajectory& stream, const std::vector<double>& stamps, double tau,
                                std::vector<Observation> views, std::vector<std::size_t>* beyond) {
  if (beyond) beyond->clear();
  for (std::size_t i = 0; i < views.size(); ++i) {
    const std::optional<Motion> motion = motion_at(stream, stamps[i] + tau);
    if (motion) {
      views[i].T_base_gripper = motion->pose;
      views[i].velocity = motion->velocity;
    } else {
      views[i].T_camera_target.clear();
      if (beyond) beyond->push_back(i);
    }
  }
  return views;
}

double coarse_offset(Setup setup, const data::Trajectory& stream, const std::vector<double>& stamps,
                     const std::vector<Observation>& views, const std::vector<Symmetry>& symmetries) {
  constexpr double kStep = 0.02, kClearly = 1.5;
  constexpr int kSteps = 15;
  const auto score = [&](double tau) {
    return score_at(setup, placed(stream, stamps, tau, views), symmetries);
  };
  double best = 0, least = score(0) / kClearly;
  for (int step = -kSteps; step <= kSteps; ++step) {
    if (step == 0) continue;
    const double found = score(step * kStep);
    if (found >= least) continue;
    least = found;
    best = step * kStep;
  }
  return best;
}

double rms_speed(const std::vector<Observation>& views) {
  constexpr double kReach = 0.5;  // [m]
  double sum = 0, count = 0;
  for (const Observation& view : views) {
    if (view.T_camera_target.empty()) continue;
    sum += view.velocity.head<3>().squaredNorm() + kReach * kReach * view.velocity.tail<3>().squaredNorm();
    ++count;
  }
  return std::sqrt(sum / std::max(1.0, count));
}

}  // namespace flash::calib
