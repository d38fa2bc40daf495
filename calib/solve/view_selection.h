#pragma once
#include <string>
#include <vector>

#include "calib/dataset/observation.h"
#include "calib/solve/robust_seed.h"

namespace flash::calib {

/// A turn of the target onto itself: i -> permutation[i], turn * points.col(i) = points.col(permutation[i]).
struct Symmetry {
  std::vector<int> permutation;
  Eigen::Isometry3d turn = Eigen::Isometry3d::Identity();
};

/// Turns by quarters and halves about the middle of a flat grid that map its points onto themselves, the
/// identity first. Colours are not asked: a detector may have numbered a board from the wrong end.
std::vector<Symmetry> grid_symmetries(const Eigen::Matrix3Xd& points);

struct RepairSettings {
  ConsistencySettings consistency;
  double outlier = 8;  ///< closing error, in rotation or translation, over the median of the set
};

struct ViewVerdict {
  bool used = true;
  std::string reason;  ///< why not
  int symmetry = 0;    ///< by which the points were renumbered
  ClosingError error;
};

struct Repair {
  std::vector<ViewVerdict> views;
  std::vector<Observation> observations;  ///< of all views, renumbered, T_camera_target the chosen pose alone
  Consistency consistency;
  int renumbered = 0;  ///< used views whose numbering was changed to that of most
};

/// Chooses numbering and planar pose of all views jointly, so that the chain closes best, and names the views
/// that cannot be used: without a target, copies of another, or closing worse than the others.
Repair repair_views(Setup setup, const std::vector<Observation>& observations,
                    const std::vector<Symmetry>& symmetries, const RepairSettings& settings = {});

/// The observations in use, in order; `index` becomes their place in the set.
std::vector<Observation> used_observations(const Repair& repair, std::vector<int>* index = nullptr);

}  // namespace flash::calib
