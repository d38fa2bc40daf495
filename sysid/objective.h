#pragma once
#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <vector>

#include "data/mesh.h"
#include "data/recording.h"
#include "sysid/sheet_queries.h"

namespace flash::sysid {

enum class RobustKind { plain, trimmed, huber };

/// How the distances of one keyframe become one number.
struct Robust {
  RobustKind kind = RobustKind::trimmed;
  double trim_fraction = 0.05;  ///< trimmed: this share of largest distances is left out
  double huber_delta = 0.02;    ///< huber: d up to delta, sqrt(delta (2 d - delta)) beyond [m]
};

/// What a score is made of. A keyframe may be observed in several ways, each a term of its own: the mean
/// distance of cloud points to the surface, of outline points to its border, of marks to where they were put,
/// and the difference of the gripper's force. A term counts in proportion to how sure it is.
struct Objective {
  Robust robust;
  double cloud_sigma = 1e-3;    ///< [m]
  double contour_sigma = 1e-3;  ///< [m]
  double marker_sigma = 1e-3;   ///< [m]
  double force_sigma = 0.02;    ///< [N]
  bool two_sided = false;       ///< one term more: simulated cloth inside the crop where none was seen
};

/// What was seen at one time.
struct Observation {
  double t = 0;                            ///< [s]
  data::Points points{};                   ///< inside the crop, base frame [m]
  double weight = 1;                       ///< in the mean over keyframes; 0 leaves it out of score and fit
  data::Points contour{};                  ///< of the outline, inside the crop [m]
  data::Points markers{};                  ///< [m]
  std::vector<SurfacePoint> marks{};       ///< where on the sheet each of `markers` was put
  std::optional<Eigen::Vector3d> force{};  ///< last gripper on sheet [N]

  /// Whether there is anything to compare with.
  bool seen() const { return count() > 0; }
  /// Of points, and one for a force.
  Eigen::Index count() const {
    return points.rows() + contour.rows() + markers.rows() + (force.has_value() ? 1 : 0);
  }
};

/// Positions of a sheet at equal steps. Where only keyframes are wanted, positions in between may be empty,
/// never the first.
struct Motion {
  double start = 0;                     ///< time of the first positions [s]
  double step = 0.01;                   ///< [s]
  std::vector<data::Points> positions;  ///< [m]
  std::vector<Eigen::Vector3d>
      forces{};  ///< last gripper on sheet, in each step: one fewer than positions [N]
};

/// Share of a step within which a time is that of the step itself.
constexpr double kSameStep = 1e-6;

/// Positions at time t, linear between steps, held outside the simulated span; `velocities` [m/s], when asked
/// for, is the slope used, zero outside the span and where a neighbour is empty.
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

/// The last gripper's force on the sheet in the step that ends at t, rounded; zero where there is no grasp.
Eigen::Vector3d force_at(const Motion& motion, double t);

/// Score of one keyframe [m]: the mean over its terms of mean distance times cloud_sigma / sigma of the term.
/// One-sided: the simulated surface is not cropped, so hidden or cropped cloth costs nothing; `two_sided`
/// adds keyframe_coverage inside `crop`. Zero where nothing was seen.
double keyframe_score(const Motion& motion, const Observation& observation, const Registration& registration,
                      const Objective& objective, const data::CropBox& crop, SheetQueries& sheet);

/// keyframe_score of each observation.
std::vector<double> keyframe_scores(const data::Triangles& triangles, const Motion& motion,
                                    const std::vector<Observation>& observations,
                                    const Registration& registration, const Objective& objective,
                                    const data::CropBox& crop = {});

/// Share of each term in the score of a keyframe: in the order cloud, contour, markers, force, two-sided.
std::array<double, 5> term_weights(const Observation& observation, const Objective& objective);

/// Weighted mean over the keyframes that carry points; infinity when none does.
double weighted_mean_score(const std::vector<double>& scores, const std::vector<Observation>& observations);

/// The other side, for recordings that see the whole cloth: distances of the vertices inside the crop box
/// (observed frame) to the nearest observed point [m].
double keyframe_coverage(const Motion& motion, const Observation& observation,
                         const Registration& registration, const Robust& robust, const data::CropBox& crop);

}  // namespace flash::sysid
