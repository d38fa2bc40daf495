#include "sysid/infer/nearby.h"

#include "sysid/infer/held.h"
#include "sysid/infer/posterior.h"

namespace flash::sysid {
namespace {

/// What a candidate has of a parameter that is assumed within a factor; 0 of others.
double value_in(const ReplayCandidate& candidate, const MaterialBase& base, const std::string& name) {
  const data::SheetMaterial& sheet = candidate.material;
  if (name == "friction") return candidate.solid ? candidate.solid->friction : sheet.friction;
  if (name == "young")
    return candidate.solid ? candidate.solid->youngs_modulus
                           : sheet.membrane_stiffness / base.thickness.value_or(1.0);
  if (name == "bending") return sheet.bending_rigidity;
  if (name == "areal_density") return sheet.areal_density;
  if (name == "density" && candidate.solid) return candidate.solid->density;
  return 0;
}

/// The value at which a search holds a parameter.
double held_value(const HeldParameter& held, const GridSettings& grid, const ReplayCandidate& candidate) {
  for (const std::vector<Axis>* axes : {&grid.axes, &grid.fixed})
    for (const Axis& axis : *axes)
      if (axis.name == held.name) return axis.values.front();
  const double value = value_in(candidate, grid.base, held.name);
  return value > 0 ? value : 0.5 * (held.values[0] + held.values[1]);
}

}  // namespace

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
  const ReplayCandidate candidate = candidate_at(values, grid);
  for (const HeldParameter& held : held_parameters(grid, replays))
    add(held.name, held_value(held, grid, candidate), held.values[1] - held.values[0]);
  return nearby;
}

}  // namespace flash::sysid
