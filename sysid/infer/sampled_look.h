#pragma once
#include <optional>
#include <vector>

#include "sysid/infer/adaptive_design.h"
#include "sysid/infer/importance_sampling.h"

namespace flash::sysid {

/// What weighted draws of the coordinates of the searched axes say. The axes go from one end of the box to
/// the other; one of one value is not searched. The estimate is the mean of the draws under the eighth power
/// of their density, which is near its mode and hardly depends on single draws.
Posterior posterior_of(const std::vector<Axis>& axes, const WeightedDraws& draws);

/// What `narrow` finds, by importance sampling over the likelihood in place of grids: few draws while the
/// extent moves, then as many as ImportanceSettings asks for.
Look sampled_look(const Emulator& emulator, const Extent& start, const std::vector<double>& at,
                  const std::vector<Axis>& axes, const GridSettings& grid,
                  std::optional<double> repeatability, const std::vector<KnownError>& errors,
                  const TellWork& told = {});

}  // namespace flash::sysid
