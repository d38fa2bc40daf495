#include "sim/device_limits.h"

#include <algorithm>
#include <cmath>

#include "data/files/error.h"
#include "sim/cuda/most_obstacles.h"
#include "sim/cuda/most_vertices.h"

namespace flash::sim {

std::string why_not_on_device(const Environment& environment) {
  if (!environment.solids.empty()) return "solids (element_type TETRAHEDRON) are simulated on the CPU alone";
  if (!environment.point_masses.empty()) return "point masses (attached_mass) are simulated on the CPU alone";
  if (environment.self_contact) return "self-contact (self_contact) is simulated on the CPU alone";
  if (std::any_of(environment.materials.begin(), environment.materials.end(),
                  [](const auto& material) { return std::isfinite(material.yield_curvature); }))
    return "bending that yields (yield_curvature) is simulated on the CPU alone";
  if (std::any_of(environment.materials.begin(), environment.materials.end(),
                  [](const auto& material) { return material.weave.is_of_membrane(); }))
    return "woven membranes (young_ratio, shear_ratio) are simulated on the CPU alone";
  if (environment.materials.size() > 1) return "several bodies in one environment";
  if (std::any_of(environment.obstacles.begin(), environment.obstacles.end(),
                  [](const Obstacle& obstacle) { return std::holds_alternative<Mesh>(obstacle.shape); }))
    return "obstacles of shape mesh are met on the CPU alone";
  if (environment.obstacles.size() > most_obstacles)
    return "more than " + std::to_string(most_obstacles) + " obstacles: found " +
           std::to_string(environment.obstacles.size());
  if (environment.state.positions.rows() > cuda::most_vertices)
    return "more than " + std::to_string(cuda::most_vertices) + " vertices: found " +
           std::to_string(environment.state.positions.rows());
  return {};
}

void check_on_device(const std::vector<Environment>& environments, const WorldSettings& settings) {
  if (settings.projective)
    throw data::InputError("--device cuda: the projective method runs on the CPU alone");
  if (environments.empty())
    throw data::InputError("--device cuda: found no environments, expected one or more");
  for (std::size_t e = 0; e < environments.size(); ++e)
    if (const std::string why = why_not_on_device(environments[e]); !why.empty())
      throw data::InputError(
          "--device cuda: " + (environments.size() > 1 ? "environment " + std::to_string(e) + ": " : "") +
          why);
}

}  // namespace flash::sim
