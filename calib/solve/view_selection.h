#pragma once
#include <string>
#include <vector>

#include "calib/dataset/observation.h"
#include "calib/dataset/symmetry.h"
#include "calib/solve/robust_seed.h"

namespace flash::calib {

struct ViewSelectionSettings {
  RobustSeedSettings robust_seed;
  double outlier = 8;  ///< closing error, in rotation or translation, over the median of the set
};

struct ViewVerdict {
  bool used = true;
  std::string reason;   ///< why not
  bool misfit = false;  ///< left out as it does not fit the others
  int copy_of = -1;     ///< the view of which it is a copy; none: -1
  int symmetry = 0;     ///< by which the points were renumbered
  ClosingError error;
};

struct ViewSelection {
  std::vector<ViewVerdict> views;
  std::vector<Observation> observations;  ///< of all views, renumbered, T_camera_target the chosen pose alone
  RobustSeed robust_seed;
  int renumbered = 0;  ///< used views whose numbering was changed to that of most
};

/// Chooses numbering and planar pose of all views jointly, so that the chain closes best, and names the views
/// that cannot be used: without a target, copies of another, or closing worse than the others.
ViewSelection select_views(Setup setup, const std::vector<Observation>& observations,
                           const std::vector<Symmetry>& symmetries,
                           const ViewSelectionSettings& settings = {});

/// The observations in use, in order; `index` becomes their place in the set.
std::vector<Observation> used_observations(const ViewSelection& selection, std::vector<int>* index = nullptr);

}  // namespace flash::calib
