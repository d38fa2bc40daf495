#include "sysid/observe/score.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nanoflann.hpp>

#include "sysid/observe/keyframe_distances.h"

namespace flash::sysid {

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

std::array<double, 5> term_weights(const Observation& observation, const Objective& objective) {
  std::array<double, 5> weights = {};
  if (observation.points.rows() > 0) weights[0] = 1;
  if (observation.contour.rows() > 0) weights[1] = objective.cloud_sigma / objective.contour_sigma;
  if (observation.markers.rows() > 0) weights[2] = objective.cloud_sigma / objective.marker_sigma;
  if (observation.force) weights[3] = objective.cloud_sigma / objective.force_sigma;
  if (objective.two_sided && observation.points.rows() > 0) weights[4] = 1;
  const auto terms = std::count_if(weights.begin(), weights.end(), [](double weight) { return weight > 0; });
  for (double& weight : weights) weight /= static_cast<double>(std::max<std::ptrdiff_t>(terms, 1));
  return weights;
}

double keyframe_score(const Motion& motion, const Observation& observation, const Registration& registration,
                      const Objective& objective, const data::CropBox& crop, SheetDistance& sheet,
                      const std::span<const sim::SurfaceFoot>* feet) {
  const std::array<double, 5> weights = term_weights(observation, objective);
  KeyframeDistances distances = keyframe_distances(motion, observation, registration, sheet, feet);
  double score = 0;
  if (weights[0] > 0) score += weights[0] * robust_mean(distances.cloud, objective.robust);
  if (weights[1] > 0) score += weights[1] * robust_mean(distances.contour, objective.robust);
  if (weights[2] > 0) score += weights[2] * robust_mean(distances.markers, objective.robust);
  if (weights[3] > 0)
    score +=
        weights[3] * (force_at(motion, observation.t + registration.time_offset) - *observation.force).norm();
  if (weights[4] > 0)
    score += weights[4] * keyframe_coverage(motion, observation, registration, objective.robust, crop);
  return score;
}

std::vector<double> keyframe_scores(const data::Triangles& triangles, const Motion& motion,
                                    const std::vector<Observation>& observations,
                                    const Registration& registration, const Objective& objective,
                                    const data::CropBox& crop) {
  SheetDistance sheet(triangles, motion.positions.front());
  std::vector<double> scores;
  for (const Observation& observation : observations) {
    scores.push_back(keyframe_score(motion, observation, registration, objective, crop, sheet));
  }
  return scores;
}

double weighted_mean_score(const std::vector<double>& scores, const std::vector<Observation>& observations) {
  double sum = 0, weight = 0;
  for (std::size_t i = 0; i < scores.size(); ++i) {
    if (!observations[i].seen()) continue;
    sum += observations[i].weight * scores[i];
    weight += observations[i].weight;
  }
  return weight > 0 ? sum / weight : std::numeric_limits<double>::infinity();
}

double keyframe_coverage(const Motion& motion, const Observation& observation,
                         const Registration& registration, const Robust& robust, const data::CropBox& crop) {
  using Tree = nanoflann::KDTreeEigenMatrixAdaptor<data::Points, 3>;
  if (observation.points.rows() == 0) return 0;
  const Tree tree(3, std::cref(observation.points));
  data::Points positions;
  surface_at(motion, observation.t + registration.time_offset, positions);
  const Eigen::Isometry3d observed_from_simulated = registration.observed_from_simulated();
  std::vector<double> distances;
  for (Eigen::Index i = 0; i < positions.rows(); ++i) {
    const Eigen::Vector3d p = observed_from_simulated * positions.row(i).transpose();
    if (!crop.contains(p)) continue;
    Eigen::Index index;
    double distance2;
    tree.index->knnSearch(p.data(), 1, &index, &distance2);
    distances.push_back(std::sqrt(distance2));
  }
  return robust_mean(distances, robust);
}

}  // namespace flash::sysid
