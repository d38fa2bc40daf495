#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include "sysid/emulate/grid_search.h"
#include "sysid/infer/posterior.h"

namespace flash::sysid {

/// Whether a parameter scales with the weight.
bool is_stiffness(const std::string& name);

/// How unsure the weight is that the search holds, a standard deviation of its logarithm, where motion knows
/// stiffnesses as ratios to it alone: an error of the weight is the same factor of each. Zero where it is
/// known or searched, and where a force was measured or a load is attached.
double spread_of_scale(const GridSettings& grid, const std::vector<Replay>& replays);

/// Gives all of `scaled`, axes of the posterior, one factor in each draw, normal in its logarithm with
/// standard deviation `spread`: that of the weight, which is returned. Draws end with `ranges`, those of the
/// search. `seed`: another than that of the posterior's draws, as factors from the same random numbers would
/// go with them.
Eigen::VectorXd scale_together(Posterior& posterior, const std::vector<std::size_t>& scaled, double spread,
                               const std::vector<Axis>& ranges, unsigned seed = 2);

}  // namespace flash::sysid
