#include "sim/step/body_law.h"

namespace flash::sim {

std::vector<BodyLaw> body_laws(const SheetPlan& plan, const Environment& environment) {
  std::vector<BodyLaw> laws;
  for (int b = 0; b < static_cast<int>(plan.bodies.size()); ++b) {
    const data::SheetMaterial& material = environment.materials[b];
    laws.push_back({plan.bodies[b], material,
                    bending_operator(plan, material.bending_model, material.poissons_ratio, b)});
  }
  return laws;
}

}  // namespace flash::sim
