#pragma once
#include <Eigen/Geometry>
#include <vector>

#include "data/mesh.h"
#include "sysid/surface_distance.h"

namespace flash::sysid {

enum class RobustKind { plain, trimmed, huber };

/// How the distances of one keyframe become one number.
struct Robust {
  RobustKind kind = RobustKind::trimmed;
  double trim_fraction = 0.05;  ///< trimmed: this share of largest distances is left out
  double huber_delta = 0.02;    ///< huber: d up to delta, sqrt(delta (2 d - delta)) beyond [m]
};

/// What was seen at one time.
struct Observation {
  double t = 0;           ///< [s]
  data::Points points{};  ///< inside the crop, base frame [m]
  double weight = 1;      ///< in the mean over keyframes; 0 leaves the keyframe out of score and fit
};

/// Positions of a sheet at equal steps.
struct Motion {
  double start = 0;                     ///< time of the first positions [s]
  double step = 0.01;                   ///< [s]
  std::vector<data::Points> positions;  ///< [m]
};

/// Positions at time t, linear between steps, held outside the simulated span; `velocities` [m/s], when asked
/// for, is the slope used, zero outside the span.
void surface_at(const Motion& motion, double t, data::Points& positions, data::Points* velocities = nullptr);

/// Where the simulation stands against what was observed: p_observed = R (p_simulated - pivot) + pivot +
/// offset, R a turn by `yaw` about `up`, and the simulated time of an observation at t is t + time_offset.
struct Registration {
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  ///< [m]
  double yaw = 0;                                    ///< [rad]
  double time_offset = 0;                            ///< [s]
  Eigen::Vector3d pivot = Eigen::Vector3d::Zero();   ///< given, never fitted [m]
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();     ///< unit, against gravity

  Eigen::Isometry3d observed_from_simulated() const;
};

/// Mean of the distances under `robust`; reorders them. Zero when empty.
double robust_mean(std::vector<double>& distances, const Robust& robust);

/// Score of one keyframe [m]: distances of the observed points to the simulated surface at that time.
/// One-sided: the simulated surface is not cropped, so hidden or cropped cloth costs nothing.
double keyframe_score(const Motion& motion, const Observation& observation, const Registration& registration,
                      const Robust& robust, SurfaceDistance& surface);

/// keyframe_score of each observation; zero where it has no points.
std::vector<double> keyframe_scores(const data::Triangles& triangles, const Motion& motion,
                                    const std::vector<Observation>& observations,
                                    const Registration& registration, const Robust& robust);

/// Weighted mean over the keyframes that carry points; infinity when none does.
double weighted_mean_score(const std::vector<double>& scores, const std::vector<Observation>& observations);

/// The other side, for recordings that see the whole cloth: distances of the vertices inside the crop box
/// `low`..`high` (observed frame, infinite where open) to the nearest observed point [m].
double keyframe_coverage(const Motion& motion, const Observation& observation,
                         const Registration& registration, const Robust& robust, const Eigen::Vector3d& low,
                         const Eigen::Vector3d& high);

}  // namespace flash::sysid
