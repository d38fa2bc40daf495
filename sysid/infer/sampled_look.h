#pragma once
#include <functional>
#include <optional>
#include <vector>

#include "sysid/infer/adaptive_design.h"
#include "sysid/infer/surrogate_sampling.h"

namespace flash::sysid {

/// What weighted draws of the coordinates of the searched axes say. The axes go from one end of the box to
/// the other; one of one value is not searched. The estimate is the mean of the draws under the eighth power
/// of their density, which is near its mode and hardly depends on single draws.
Posterior posterior_of(const std::vector<Axis>& axes, const WeightedDraws& draws);

/// Makes the log density of the coordinates of the searched axes that is linear about values, over an extent.
using DensityAbout = std::function<LogDensities(const std::vector<double>& values, const Extent& extent)>;

struct Sampled {
  Posterior posterior;
  SurrogateDraws of;
  int asked = 0;  ///< points at which densities were asked for
};

/// Importance sampling over extents, each about the estimate of the one before, until next_extent keeps one:
/// few draws while it moves. Draws `before` of a density like the first are the first points to be asked for.
Sampled sample_extents(const DensityAbout& density, const Extent& start, const std::vector<double>& at,
                       const std::vector<Axis>& axes, const WeightedDraws* before = nullptr);

/// What `narrow` finds, by importance sampling over the likelihood in place of grids. `before`: draws of a
/// look at the same parameters with other errors or motions.
Look sampled_look(const Emulator& emulator, const Extent& start, const std::vector<double>& at,
                  const std::vector<Axis>& axes, const GridSettings& grid,
                  std::optional<double> repeatability, const std::vector<KnownError>& errors,
                  const TellWork& told = {}, const WeightedDraws* before = nullptr);

}  // namespace flash::sysid
