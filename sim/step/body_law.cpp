#include "sim/step/body_law.h"

#include <stdexcept>

namespace flash::sim {

std::vector<BodyLaw> body_laws(const SheetPlan& plan, const Environment& environment) {
  std::vector<BodyLaw> laws;
  for (int b = 0; b < static_cast<int>(plan.bodies.size()); ++b) {
    const data::SheetMaterial& material = environment.materials[b];
    const auto solid = environment.solids.find(b);
    const bool has_material = solid != environment.solids.end();
    if (has_material != plan.bodies[b].body.is_solid())
      throw std::invalid_argument("environment: the bodies in `solids` have to be those of tetrahedra");
    laws.push_back({plan.bodies[b], material, bending_operator(plan, material, b),
                    has_material ? &solid->second : nullptr});
  }
  return laws;
}

}  // namespace flash::sim
