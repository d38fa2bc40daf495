#pragma once
#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <span>
#include <vector>

#include "data/mesh/mesh.h"
#include "data/recording/recording.h"
#include "sim/law/surface_foot.h"
#include "sysid/replay/motion.h"
#include "sysid/replay/observation.h"
#include "sysid/replay/sheet_distance.h"

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

/// Score of one keyframe [m]: the mean over its terms of mean distance times cloud_sigma / sigma of the term.
/// One-sided: the simulated surface is not cropped, so hidden or cropped cloth costs nothing; `two_sided`
/// adds keyframe_coverage inside `crop`. Zero where nothing was seen. `feet`: those of the
/// cloud's points, where they are known; else they are searched for.
double keyframe_score(const Motion& motion, const Observation& observation, const Registration& registration,
                      const Objective& objective, const data::CropBox& crop, SheetDistance& sheet,
                      const std::span<const sim::SurfaceFoot>* feet = nullptr);

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
