#include "sysid/design/usual_ranges.h"

#include <algorithm>
#include <string>

namespace flash::sysid {
namespace {

double own_value(const MaterialBase& base, const std::string& name) {
  const data::SheetMaterial& m = base.material;
  if (name == "young") return m.membrane_stiffness / base.thickness.value_or(1.0);
  if (name == "poisson") return m.poissons_ratio;
  if (name == "bending") return make_candidate(base, {}, {}).material.bending_rigidity;
  if (name == "bending_ratio") return m.weave.bending_ratio;
  if (name == "young_ratio") return m.weave.young_ratio;
  if (name == "shear_ratio") return m.weave.shear_ratio;
  if (name == "yield_curvature") return m.yield_curvature;
  if (name == "friction") return m.friction;
  if (name == "areal_density") return m.areal_density;
  if (name == "air_drag") return m.air_drag;
  if (name == "stiffness_damping") return m.stiffness_damping;
  return 0;
}

}  // namespace

std::vector<Axis> usual_ranges(const MaterialBase& base) {
  const double young = own_value(base, "young"), bending = own_value(base, "bending");
  return {{"young", {0.2 * young, 5 * young}, true},
          {"poisson", {0, 0.45}, false},
          {"bending", {0.1 * bending, 10 * bending}, true},
          {"friction", {0.15, 0.6}, true}};
}

std::vector<double> values_in_range(const MaterialBase& base, const std::vector<Axis>& axes) {
  std::vector<double> values;
  for (const Axis& axis : axes)
    values.push_back(std::clamp(own_value(base, axis.name), axis.values.front(), axis.values.back()));
  return values;
}

}  // namespace flash::sysid
