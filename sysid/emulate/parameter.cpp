#include "sysid/emulate/parameter.h"

#include <algorithm>
#include <limits>
#include <stdexcept>

namespace flash::sysid {
namespace {

using data::SheetMaterial;
using data::SolidMaterial;
using data::Weave;
using Of = Parameter::Of;

constexpr double kPi = 3.14159265358979323846;                // Half a turn [rad]. Work: bounds of angles.
constexpr double kTiny = std::numeric_limits<double>::min();  // Above zero. Work.

using Access = ParameterAccess;

template <double SheetMaterial::*member>
constexpr Access of_sheet = {
    [](const ReplayCandidate& c, const MaterialBase&) { return c.material.*member; },
    [](ReplayCandidate& c, double value, const MaterialBase&) { c.material.*member = value; }};

template <double Weave::*member>
constexpr Access of_weave = {
    [](const ReplayCandidate& c, const MaterialBase&) { return c.material.weave.*member; },
    [](ReplayCandidate& c, double value, const MaterialBase&) { c.material.weave.*member = value; }};

template <double SolidMaterial::*member>
constexpr Access of_solid = {
    [](const ReplayCandidate& c, const MaterialBase&) { return c.solid ? (*c.solid).*member : 0; },
    [](ReplayCandidate& c, double value, const MaterialBase&) {
      if (c.solid) (*c.solid).*member = value;
    }};

template <double SheetMaterial::*sheet, double SolidMaterial::*solid>
constexpr Access of_both = {[](const ReplayCandidate& c, const MaterialBase& base) {
                              return c.solid ? of_solid<solid>.get(c, base) : of_sheet<sheet>.get(c, base);
                            },
                            [](ReplayCandidate& c, double value, const MaterialBase& base) {
                              of_sheet<sheet>.set(c, value, base);
                              of_solid<solid>.set(c, value, base);
                            }};

/// What the recording says reads zero.
double number(const std::optional<double>& value) { return value.value_or(0); }

template <auto member>
constexpr Access of_recording = {
    [](const ReplayCandidate& c, const MaterialBase&) { return number(c.nuisance.*member); },
    [](ReplayCandidate& c, double value, const MaterialBase&) { c.nuisance.*member = value; }};

constexpr Access young = {[](const ReplayCandidate& c, const MaterialBase& base) {
                            return c.solid ? c.solid->youngs_modulus
                                           : c.material.membrane_stiffness / base.thickness.value_or(1.0);
                          },
                          [](ReplayCandidate& c, double value, const MaterialBase& base) {
                            c.material.membrane_stiffness = value * base.thickness.value_or(1.0);
                            if (c.solid) c.solid->youngs_modulus = value;
                          }};

using Range = std::array<double, 2>;

Parameter material(const char* name, const char* unit, Of of, Range allowed, Range usual, Access access,
                   const char* meaning) {
  return {name, unit, of, true, allowed[0], allowed[1], usual, access, meaning};
}

Parameter nuisance(const char* name, const char* unit, Of of, Range allowed, Range usual, Access access,
                   const char* meaning) {
  return {name, unit, of, false, allowed[0], allowed[1], usual, access, meaning};
}

}  // namespace

const std::vector<Parameter>& known_parameters() {
  using S = SheetMaterial;
  using V = SolidMaterial;
  using N = ReplayNuisance;
  static const std::vector<Parameter> parameters = {
      material("young", "Pa or N/m", Of::both, {kTiny, 1e13}, {10, 2000}, young,
               "Young's modulus, or E t where the asset of a sheet has no thickness"),
      material("poisson", "", Of::both, {-0.99, 0.5}, {0, 0.5},
               of_both<&S::poissons_ratio, &V::poissons_ratio>, "Poisson's ratio"),
      material("bending", "N m", Of::sheet, {0, 1e6}, {1.1e-6, 1.1e-4}, of_sheet<&S::bending_rigidity>,
               "flexural rigidity D"),
      material("bending_ratio", "", Of::sheet, {0.01, 100}, {0.2, 5}, of_weave<&Weave::bending_ratio>,
               "woven: D across the warp over D along it"),
      material("young_ratio", "", Of::sheet, {0.01, 100}, {0.2, 5}, of_weave<&Weave::young_ratio>,
               "woven: E across the warp over E along it"),
      material("shear_ratio", "", Of::sheet, {1e-3, 100}, {0.01, 1}, of_weave<&Weave::shear_ratio>,
               "woven: G over that of an isotropic sheet"),
      material("yield_curvature", "1/m", Of::sheet, {1e-3, 1e6}, {5, 500}, of_sheet<&S::yield_curvature>,
               "curvature at which bending begins to yield"),
      material("friction", "", Of::both, {0, 1e3}, {0.1, 1}, of_both<&S::friction, &V::friction>,
               "Coulomb coefficient against the table"),
      material("areal_density", "kg/m^2", Of::sheet, {1e-9, 1e4}, {0.03, 0.5}, of_sheet<&S::areal_density>,
               "mass per area"),
      material("density", "kg/m^3", Of::solid, {1e-6, 1e6}, {100, 2000}, of_solid<&V::density>,
               "solid: mass per volume"),
      material("air_drag", "1/s", Of::both, {0, 1e4}, {0.1, 10}, of_both<&S::air_drag, &V::air_drag>,
               "mass-proportional damping"),
      material("stiffness_damping", "s", Of::both, {0, 1e3}, {1e-4, 1e-1},
               of_both<&S::stiffness_damping, &V::stiffness_damping>, "stiffness-proportional damping"),
      nuisance("start_yaw", "rad", Of::sheet, {-kPi, kPi}, {-0.2, 0.2}, of_recording<&N::start_yaw>,
               "turn of the sheet on the table about the gripper"),
      nuisance("table_height", "m", Of::sheet, {-0.5, 0.5}, {-0.02, 0.02}, of_recording<&N::table_height>,
               "of table and sheet against the gripper's path"),
      nuisance("grasp_size", "m", Of::sheet, {kTiny, 0.5}, {0.005, 0.05}, of_recording<&N::grasp_size>,
               "clamp: size of the patch at a corner"),
      nuisance("grasp_stiffness", "N/m^3", Of::sheet, {1, rigid_pads}, {1e6, 1e11},
               of_recording<&N::grasp_stiffness>, "clamp: pressure of the pads over how far they give way"),
      nuisance("grasp_depth", "m", Of::both, {kTiny, 0.5}, {0.005, 0.05}, of_recording<&N::grasp_depth>,
               "pinch: size of the folded patch"),
      nuisance("grasp_direction", "rad", Of::both, {-kPi, kPi}, {-0.4, 0.4},
               of_recording<&N::grasp_direction>, "pinch: angle of the ridge from the sheet's diagonal"),
      nuisance("grasp_pitch", "rad", Of::both, {-kPi, kPi}, {-0.4, 0.4}, of_recording<&N::grasp_pitch>,
               "pinch: tilt of the ridge"),
  };
  return parameters;
}

const Parameter* find_parameter(const std::string& name) {
  const std::vector<Parameter>& all = known_parameters();
  const auto found = std::find_if(all.begin(), all.end(), [&](const Parameter& p) { return p.name == name; });
  return found == all.end() ? nullptr : &*found;
}

const Parameter& parameter_named(const std::string& name) {
  const Parameter* const found = find_parameter(name);
  if (found == nullptr) throw std::out_of_range("no parameter is called " + name);
  return *found;
}

bool is_of(const Parameter& parameter, const MaterialBase& base) {
  return parameter.of == Of::both || parameter.of == (base.solid ? Of::solid : Of::sheet);
}

std::string unit_of(const Parameter& parameter, const MaterialBase& base) {
  if (parameter.name != "young") return parameter.unit;
  return base.solid || base.thickness ? "Pa" : "N/m";
}

std::array<double, 2> usual_range(const Parameter& parameter, const MaterialBase& base) {
  if (parameter.name != "young") return parameter.usual;
  if (base.solid) return {1e3, 1e8};
  const double thickness = base.thickness.value_or(1.0);
  return {parameter.usual[0] / thickness, parameter.usual[1] / thickness};
}

}  // namespace flash::sysid
