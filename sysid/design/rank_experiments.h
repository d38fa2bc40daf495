#pragma once
#include <functional>
#include <string>
#include <vector>

#include "sysid/design/plan.h"

namespace flash::sysid {

/// What could be recorded next, by the information that it is expected to add (PlannedExperiment::bits), best
/// first: each of the recordings at hand once more, called "NAME again", and the virtual experiments with the
/// first recording's sheet, on cells large enough for some hundred vertices. What diverges is left out.
/// `known`: see PlanSettings. `told`: the name of each that is begun.
std::vector<PlannedExperiment> rank_experiments(const std::vector<Replay>& replays,
                                                const PlanSettings& settings, const MotionStore& store,
                                                const std::function<void(const std::string&)>& told = {});

/// Covariance of draws, a draw a row of values in the order of `axes`, in the coordinates of those axes that
/// have more than one value.
Eigen::MatrixXd covariance_of_draws(const std::vector<Axis>& axes, const Eigen::MatrixXd& draws);

}  // namespace flash::sysid
