#include "sysid/infer/nearby.h"

#include "sysid/infer/held.h"
#include "sysid/infer/posterior.h"

namespace flash::sysid {
std::vector<NearbyCandidate> nearby_candidates(const std::vector<double>& values, const GridSettings& grid,
                                               const std::vector<Replay>& replays, double share) {
  std::vector<NearbyCandidate> nearby;
  const auto add = [&](const std::string& name, double value, double width) {
    const bool by_factor = in_own_coordinates({{name, {value}}}).front().logarithmic;
    const double changed = value + share * (by_factor ? value : width);
    nearby.push_back({name, candidate_with(values, grid, name, changed)});
  };
  for (std::size_t k = 0; k < grid.axes.size(); ++k) {
    const Axis& axis = grid.axes[k];
    if (axis.values.size() > 1) add(axis.name, values[k], axis.values.back() - axis.values.front());
  }
  for (const HeldParameter& held : held_parameters(grid, replays, values))
    add(held.name, held.at, held.values[1] - held.values[0]);
  return nearby;
}

}  // namespace flash::sysid
