#pragma once
#include "sysid/motion_model.h"
#include "sysid/profile.h"

namespace flash::sysid {

/// One grid within the searched range, and what its scores say with no regard to solver or interpolation.
struct Zoomed {
  GridResults results;
  GridVerdict verdict;
  std::vector<Eigen::MatrixXd> information;  ///< of the keyframes at the estimate
};

/// Registers and scores modelled motions at every point of a grid. `share`: see MotionModel.
GridResults score_models(const std::vector<ModelledReplay>& models, const std::vector<Axis>& axes,
                         double share, const GridSettings& settings);

/// Grids of some hundred points, each about the estimate of the one before, until the interval of every
/// parameter takes a third to a half of the extent or ends with the searched range. A point costs a score, no
/// simulation. `start`: the first extent, one range an axis of `settings.axes`.
Zoomed zoom(const std::vector<ModelledReplay>& models, double share,
            const std::vector<std::array<double, 2>>& start, const GridSettings& settings,
            std::optional<double> repeatability);

}  // namespace flash::sysid
