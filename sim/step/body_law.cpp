#include "sim/step/body_law.h"

#include <stdexcept>
#include <string>

#include "data/asset/asset.h"
#include "data/files/error.h"
#include "sim/law/membrane.h"
#include "sim/law/solid.h"

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
    BodyLaw& law = laws.back();
    law.hinges = std::span(plan.hinges).subspan(law.place.first_hinge, law.place.hinge_count);
    if (law.solid == nullptr && material.weave.is_of_membrane() &&
        material.constitutive != data::Constitutive::tri_stvk)
      throw data::input_error("young_ratio, shear_ratio", "constitutive",
                              std::string("found ") + data::to_string(material.constitutive) +
                                  ", expected TRI_STVK, the only one that is woven");
    if (!law.yields()) continue;
    if (material.bending_model != data::BendingModel::hinge)
      throw data::input_error("yield_curvature", "bending_model",
                              std::string("found ") + data::to_string(material.bending_model) +
                                  ", expected hinge, the only one that yields");
    if (environment.state.rest_angles.empty()) continue;
    law.yielded.assign(law.hinges.begin(), law.hinges.end());
    for (std::size_t e = 0; e < law.yielded.size(); ++e)
      law.yielded[e].rest_angle = environment.state.rest_angles[law.place.first_hinge + e];
  }
  return laws;
}

double largest_stiffness(const BodyPlan& place, const data::SheetMaterial& material,
                         const BendingOperator& bending) {
  const SheetLame lame = sheet_lame(material.largest_stiffness(), material.poissons_ratio);
  return (lame.lambda + 2 * lame.mu) * place.largest_entry +
         material.bending_rigidity * bending.largest_entry;
}

double largest_stiffness(const BodyLaw& law, double h) {
  const double damped = 1 + law.stiffness_damping() / h;
  if (law.solid == nullptr) return damped * largest_stiffness(law.place, law.material, law.bending);
  const SolidLame lame = solid_of(*law.solid).lame;
  return damped * (lame.lambda + 2 * lame.mu) * law.place.largest_entry;
}

}  // namespace flash::sim
