#pragma once
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "data/asset/material.h"
#include "sysid/replay/replay.h"

namespace flash::sysid {

/// What candidates are built on: the asset's material and how `young` and `bending` are understood.
struct MaterialBase {
  data::SheetMaterial material;
  std::optional<double> thickness;  ///< given: young is E [Pa]; absent: young is E t [N/m]
  bool bending_from_thickness =
      false;  ///< D = E t^3 / (12 (1 - nu^2)) follows young unless bending is an axis
  std::optional<data::SolidMaterial> solid = {};  ///< of a solid, in place of all that; young is E [Pa]
};

/// How a parameter's value, in its unit, is read from a candidate and written into it.
struct ParameterAccess {
  double (*get)(const ReplayCandidate&, const MaterialBase&);
  void (*set)(ReplayCandidate&, double, const MaterialBase&);
};

/// A parameter that can be searched or fixed. Whatever has to do with its unit asks this row, so that all
/// agree.
struct Parameter {
  enum class Of { sheet, solid, both };

  std::string name;  ///< short published name
  std::string unit;  ///< of young see unit_of
  Of of;
  bool material;                ///< belongs to the asset; otherwise it describes the recording (nuisance)
  double low, high;             ///< values outside are refused
  std::array<double, 2> usual;  ///< of young that of E t of a sheet, see usual_range
  ParameterAccess access;
  std::string meaning;

  double get(const ReplayCandidate& candidate, const MaterialBase& base) const {
    return access.get(candidate, base);
  }
  void set(ReplayCandidate& candidate, double value, const MaterialBase& base) const {
    access.set(candidate, value, base);
  }
};

/// young, poisson, bending, bending_ratio, young_ratio, shear_ratio, yield_curvature, friction,
/// areal_density, density, air_drag, stiffness_damping; start_yaw, table_height, grasp_size,
/// grasp_stiffness, grasp_depth, grasp_direction, grasp_pitch.
const std::vector<Parameter>& known_parameters();

/// Null where none has that name.
const Parameter* find_parameter(const std::string& name);

/// The same of a name that is known to be one. Throws std::out_of_range.
const Parameter& parameter_named(const std::string& name);

/// Whether the object of the base has such a parameter, or its recording.
bool is_of(const Parameter& parameter, const MaterialBase& base);

/// "Pa", "N m"; empty where it has none. Of young by what the base says: E [Pa], or E t [N/m].
std::string unit_of(const Parameter& parameter, const MaterialBase& base);

/// What information about a parameter is counted against, whatever was searched; in its unit. 5 to 95 % of
/// woven and knitted fabrics, paper and film: bending of 618 fabrics 1.1 to 110 uN m, membranes of 10 to
/// 2000 N/m, curvatures at which fabric and paper begin to yield 5 to 500 1/m. Solids from soft foam to hard
/// rubber. Of a recording two standard deviations of what is set up by hand: 0.2 rad and 20 mm; a pinch of 5
/// to 50 mm, its ridge within 0.4 rad.
std::array<double, 2> usual_range(const Parameter& parameter, const MaterialBase& base);

}  // namespace flash::sysid
