#pragma once
#include <vector>

#include "calib/geometry/closed_form.h"

namespace flash::calib {

struct RobustSeedSettings {
  int triples = 200;          ///< of views that are tried
  int kept = 8;               ///< of the best, refined over all views
  double majority = 0.6;      ///< share of the views that has to agree
  double angle_slack = 0.15;  ///< between the angles of a motion seen by robot and by camera [rad]
  unsigned seed = 1;
};

/// Hand-eye poses on which most views agree, and for each view the candidate that agrees best.
struct RobustSeed {
  HandEyePoses poses;
  std::vector<int> choice;           ///< index into the candidates of each view
  std::vector<ClosingError> errors;  ///< of that candidate
  double rotation = 0;               ///< rms over the majority that agrees best [rad]
  double translation = 0;            ///< likewise [m]
  double score = 0;  ///< sqrt(rotation^2 + (translation / distance of the target)^2), what is minimised
  bool found = false;
};

/// Robust seed: closed forms of three views each, over all their candidates, ranked by the trimmed closing
/// error of all views (least trimmed squares, Rousseeuw and van Driessen 2006: the best are refined by
/// concentration steps with Shah's method on the majority). robot: G of PoseLoop; candidates: poses of the
/// target in the camera, one or more a view, none where the view is to be left out. Not found where fewer
/// than three views have candidates. Views that turn about one axis alone are solved by of_one_axis.
RobustSeed find_robust_seed(const std::vector<Eigen::Isometry3d>& robot,
                            const std::vector<std::vector<Eigen::Isometry3d>>& candidates,
                            const RobustSeedSettings& settings = {});

}  // namespace flash::calib
