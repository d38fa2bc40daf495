#include "sysid/replay/motion.h"

#include <algorithm>
#include <cmath>

namespace flash::sysid {

void surface_at(const Motion& motion, double t, data::Points& positions, data::Points* velocities) {
  const std::size_t last = motion.positions.size() - 1;
  const double steps = (t - motion.start) / motion.step;
  if (!(steps > 0) || last == 0) {
    positions = motion.positions.front();
    if (velocities) *velocities = data::Points::Zero(positions.rows(), 3);
    return;
  }
  if (steps >= static_cast<double>(last)) {
    positions = motion.positions[last];
    if (velocities) *velocities = data::Points::Zero(positions.rows(), 3);
    return;
  }
  const auto below = static_cast<std::size_t>(steps);
  const double fraction = steps - static_cast<double>(below);
  const data::Points &from = motion.positions[below], &to = motion.positions[below + 1];
  if (fraction < kSameStep) {
    positions = from;
  } else if (fraction > 1 - kSameStep) {
    positions = to;
  } else {
    positions = (1 - fraction) * from + fraction * to;
  }
  if (!velocities) return;
  if (from.rows() == to.rows()) {
    *velocities = (to - from) / motion.step;
  } else {
    *velocities = data::Points::Zero(positions.rows(), 3);
  }
}

std::pair<std::size_t, std::size_t> steps_at(const Motion& motion, double t) {
  const std::size_t last = motion.positions.size() - 1;
  const double steps = (t - motion.start) / motion.step;
  if (!(steps > 0) || last == 0) return {0, 0};
  if (steps >= static_cast<double>(last)) return {last, last};
  const auto below = static_cast<std::size_t>(steps);
  const double fraction = steps - static_cast<double>(below);
  if (fraction < kSameStep) return {below, below};
  if (fraction > 1 - kSameStep) return {below + 1, below + 1};
  return {below, below + 1};
}

bool has_surface_at(const Motion& motion, double t) {
  const auto [first, last] = steps_at(motion, t);
  return motion.positions[first].rows() > 0 && motion.positions[last].rows() > 0;
}

Eigen::Vector3d force_at(const Motion& motion, double t) {
  if (motion.forces.empty()) return Eigen::Vector3d::Zero();
  const double last = static_cast<double>(motion.forces.size());
  const double step = std::clamp(std::round((t - motion.start) / motion.step), 1.0, last);
  return motion.forces[static_cast<std::size_t>(step) - 1];
}

}  // namespace flash::sysid
