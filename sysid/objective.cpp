#include "sysid/objective.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nanoflann.hpp>

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
  positions = (1 - fraction) * from + fraction * to;
  if (velocities) *velocities = (to - from) / motion.step;
}

Eigen::Isometry3d Registration::observed_from_simulated() const {
  Eigen::Isometry3d transform = Eigen::Isometry3d::Identity();
  transform.linear() = Eigen::AngleAxisd(yaw, up).toRotationMatrix();
  transform.translation() = pivot + offset - transform.linear() * pivot;
  return transform;
}

double robust_mean(std::vector<double>& distances, const Robust& robust) {
  if (distances.empty()) return 0;
  std::size_t count = distances.size();
  if (robust.kind == RobustKind::trimmed) {
    count -= static_cast<std::size_t>(robust.trim_fraction * static_cast<double>(count));
    if (count < distances.size())
      std::nth_element(distances.begin(), distances.begin() + count, distances.end());
  }
  double sum = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const double d = distances[i], delta = robust.huber_delta;
    sum += robust.kind == RobustKind::huber && d > delta ? std::sqrt(delta * (2 * d - delta)) : d;
  }
  return sum / static_cast<double>(count);
}

double keyframe_score(const Motion& motion, const Observation& observation, const Registration& registration,
                      const Robust& robust, SurfaceDistance& surface) {
  data::Points positions;
  surface_at(motion, observation.t + registration.time_offset, positions);
  surface.move(positions);
  const Eigen::Isometry3d simulated_from_observed = registration.observed_from_simulated().inverse();
  std::vector<double> distances(observation.points.rows());
  int hint = -1;
  for (Eigen::Index i = 0; i < observation.points.rows(); ++i) {
    const SurfacePoint nearest =
        surface.nearest(simulated_from_observed * observation.points.row(i).transpose(), hint);
    hint = nearest.triangle;
    distances[i] = nearest.distance;
  }
  return robust_mean(distances, robust);
}

std::vector<double> keyframe_scores(const data::Triangles& triangles, const Motion& motion,
                                    const std::vector<Observation>& observations,
                                    const Registration& registration, const Robust& robust) {
  SurfaceDistance surface(triangles, motion.positions.front());
  std::vector<double> scores;
  for (const Observation& observation : observations) {
    scores.push_back(keyframe_score(motion, observation, registration, robust, surface));
  }
  return scores;
}

double weighted_mean_score(const std::vector<double>& scores, const std::vector<Observation>& observations) {
  double sum = 0, weight = 0;
  for (std::size_t i = 0; i < scores.size(); ++i) {
    if (observations[i].points.rows() == 0) continue;
    sum += observations[i].weight * scores[i];
    weight += observations[i].weight;
  }
  return weight > 0 ? sum / weight : std::numeric_limits<double>::infinity();
}

double keyframe_coverage(const Motion& motion, const Observation& observation,
                         const Registration& registration, const Robust& robust, const Eigen::Vector3d& low,
                         const Eigen::Vector3d& high) {
  using Tree = nanoflann::KDTreeEigenMatrixAdaptor<data::Points, 3>;
  if (observation.points.rows() == 0) return 0;
  const Tree tree(3, std::cref(observation.points));
  data::Points positions;
  surface_at(motion, observation.t + registration.time_offset, positions);
  const Eigen::Isometry3d observed_from_simulated = registration.observed_from_simulated();
  std::vector<double> distances;
  for (Eigen::Index i = 0; i < positions.rows(); ++i) {
    const Eigen::Vector3d p = observed_from_simulated * positions.row(i).transpose();
    if ((p.array() < low.array()).any() || (p.array() > high.array()).any()) continue;
    Eigen::Index index;
    double distance2;
    tree.index->knnSearch(p.data(), 1, &index, &distance2);
    distances.push_back(std::sqrt(distance2));
  }
  return robust_mean(distances, robust);
}

}  // namespace flash::sysid
