#include "sysid/emulate/parameter_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "data/asset.h"
#include "data/error.h"
#include "data/json_reader.h"
#include "data/text.h"

namespace flash::sysid {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kTiny = std::numeric_limits<double>::min();

const ParameterInfo& info_of(const std::string& option, const std::string& name) {
  const std::vector<ParameterInfo>& known = known_parameters();
  const auto found = std::find_if(known.begin(), known.end(), [&](const auto& p) { return p.name == name; });
  if (found != known.end()) return *found;
  std::vector<std::string> names;
  for (const ParameterInfo& info : known) names.push_back(info.name);
  const std::string nearest = data::nearest_name(name, names);
  std::string all;
  for (const std::string& other : names) all += (all.empty() ? "" : ", ") + other;
  throw data::InputError(
      option + ": unknown parameter " +
      (nearest.empty() ? "(expected one of " + all + ")" : "(did you mean \"" + nearest + "\"?)"));
}

double number(const std::string& option, std::string_view word) {
  const std::optional<double> value = data::parse_number(word);
  if (!value || !std::isfinite(*value)) {
    throw data::InputError(option + ": \"" + std::string(word) +
                           "\" is not a number; expected low:high:count[:log], a,b,c or one value");
  }
  return *value;
}

void check_range(const std::string& option, const ParameterInfo& info, double value) {
  if (value >= info.low && value <= info.high) return;
  throw data::InputError(option + ": found " + data::format_short(value) + ", expected " +
                         data::format_short(info.low) + " to " + data::format_short(info.high) +
                         (info.unit.empty() ? "" : " " + info.unit));
}

}  // namespace

const std::vector<ParameterInfo>& known_parameters() {
  static const std::vector<ParameterInfo> parameters = {
      {"young", "Pa or N/m", true, kTiny, 1e13,
       "Young's modulus, or E t where the asset of a sheet has no thickness"},
      {"poisson", "", true, -0.99, 0.5, "Poisson's ratio"},
      {"bending", "N m", true, 0, 1e6, "flexural rigidity D"},
      {"bending_ratio", "", true, 0.01, 100, "woven: D across the warp over D along it"},
      {"young_ratio", "", true, 0.01, 100, "woven: E across the warp over E along it"},
      {"shear_ratio", "", true, 1e-3, 100, "woven: G over that of an isotropic sheet"},
      {"yield_curvature", "1/m", true, 1e-3, 1e6, "curvature at which bending begins to yield"},
      {"friction", "", true, 0, 1e3, "Coulomb coefficient against the table"},
      {"areal_density", "kg/m^2", true, 1e-9, 1e4, "mass per area"},
      {"density", "kg/m^3", true, 1e-6, 1e6, "solid: mass per volume"},
      {"air_drag", "1/s", true, 0, 1e4, "mass-proportional damping"},
      {"stiffness_damping", "s", true, 0, 1e3, "stiffness-proportional damping"},
      {"start_yaw", "rad", false, -kPi, kPi, "turn of the sheet on the table about the gripper"},
      {"table_height", "m", false, -0.5, 0.5, "of table and sheet against the gripper's path"},
      {"grasp_depth", "m", false, kTiny, 0.5, "pinch: size of the folded patch"},
      {"grasp_direction", "rad", false, -kPi, kPi, "pinch: angle of the ridge from the sheet's diagonal"},
      {"grasp_pitch", "rad", false, -kPi, kPi, "pinch: tilt of the ridge"},
  };
  return parameters;
}

std::string option_of(const std::string& name) {
  std::string option = "--" + name;
  std::replace(option.begin(), option.end(), '_', '-');
  return option;
}

void check_parameter(const std::string& option, const std::string& name) { info_of(option, name); }

Axis parse_axis(const std::string& name, const std::string& specification) {
  const std::string option = option_of(name);
  const ParameterInfo& info = info_of(option, name);
  Axis axis{name, {}, false};
  if (specification.find(':') == std::string::npos) {
    for (const std::string_view word : data::split(specification, ","))
      axis.values.push_back(number(option, word));
    std::sort(axis.values.begin(), axis.values.end());
    const auto twice = std::adjacent_find(axis.values.begin(), axis.values.end());
    if (twice != axis.values.end())
      throw data::InputError(option + ": " + data::format_short(*twice) + " is given twice");
  } else {
    const std::vector<std::string_view> parts = data::split(specification, ":");
    axis.logarithmic = parts.size() == 4 && parts[3] == "log";
    if (parts.size() != 3 && !axis.logarithmic && !(parts.size() == 4 && parts[3] == "linear")) {
      throw data::InputError(option + ": \"" + specification +
                             "\": expected low:high:count, with :log at its end or not");
    }
    const double low = number(option, parts[0]), high = number(option, parts[1]),
                 count = number(option, parts[2]);
    if (count < 1 || count > 1e6 || count != std::floor(count)) {
      throw data::InputError(option + ": found the count " + std::string(parts[2]) +
                             ", expected a whole number from 1 to 1,000,000");
    }
    if (!(low < high) && !(low == high && count == 1)) {
      throw data::InputError(option + ": low " + std::string(parts[0]) + " is not below high " +
                             std::string(parts[1]));
    }
    if (axis.logarithmic && low <= 0) {
      throw data::InputError(option + ": a logarithmic axis cannot start at " + std::string(parts[0]));
    }
    const int n = static_cast<int>(count);
    for (int i = 0; i < n; ++i) {
      const double s = n > 1 ? i / static_cast<double>(n - 1) : 0;
      axis.values.push_back(axis.logarithmic ? low * std::pow(high / low, s) : low + s * (high - low));
    }
    if (n > 1) axis.values.back() = high;
  }
  if (axis.values.empty()) throw data::InputError(option + ": no value given");
  for (const double value : axis.values) check_range(option, info, value);
  return axis;
}

Hold parse_hold(const std::string& text) {
  constexpr std::string_view kMeasured = ":measured", kDeviation = "+-";
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos)
    throw data::InputError("--hold: \"" + text +
                           "\": expected name=value or name=value:measured, as friction=0.3");
  const std::string name = text.substr(0, equals);
  const std::string where = "--hold " + name;
  const ParameterInfo& info = info_of(where, name);
  std::string_view word = std::string_view(text).substr(equals + 1);
  const bool measured = word.ends_with(kMeasured);
  if (measured) word.remove_suffix(kMeasured.size());
  const std::size_t sign = word.find(kDeviation);
  const std::optional<double> value = data::parse_number(word.substr(0, sign));
  if (!value || !std::isfinite(*value))
    throw data::InputError(where + ": found \"" + std::string(word) +
                           "\", expected a number, or one with :measured");
  check_range(where, info, *value);
  Hold hold{{name, {*value}, false}, measured};
  if (sign == std::string_view::npos) return hold;
  const std::string_view behind = word.substr(sign + kDeviation.size());
  hold.deviation = data::parse_number(behind);
  if (!hold.deviation || !(*hold.deviation > 0) || !std::isfinite(*hold.deviation))
    throw data::InputError(where + ": found \"" + std::string(behind) +
                           "\", expected a standard deviation above 0, as 0.3+-0.02");
  return hold;
}

std::vector<std::vector<double>> cartesian_product(const std::vector<Axis>& axes) {
  std::vector<std::vector<double>> candidates = {{}};
  for (const Axis& axis : axes) {
    std::vector<std::vector<double>> longer;
    longer.reserve(candidates.size() * axis.values.size());
    for (const std::vector<double>& candidate : candidates) {
      for (const double value : axis.values) {
        longer.push_back(candidate);
        longer.back().push_back(value);
      }
    }
    candidates = std::move(longer);
  }
  return candidates;
}

std::vector<double> values_of(const std::vector<Axis>& axes, int id) {
  auto rest = static_cast<std::size_t>(id);
  std::vector<double> values(axes.size());
  for (std::size_t k = axes.size(); k-- > 0; rest /= axes[k].values.size())
    values[k] = axes[k].values[rest % axes[k].values.size()];
  return values;
}

double count_candidates(const std::vector<Axis>& axes) {
  double count = 1;
  for (const Axis& axis : axes) count *= static_cast<double>(axis.values.size());
  return count;
}

namespace {

/// Refuses what a solid does not have, or a sheet.
void check_kind(const Axis& axis, const MaterialBase& base) {
  const std::string& name = axis.name;
  if (!base.solid) {
    if (name == "density")
      throw data::InputError("--density: found a sheet, expected a solid; a sheet has --areal-density");
    return;
  }
  for (const char* own : {"bending", "bending_ratio", "young_ratio", "shear_ratio", "yield_curvature",
                          "areal_density", "start_yaw", "table_height"})
    if (name == own)
      throw data::InputError(option_of(name) + ": found a solid, expected a sheet" +
                             (name == "areal_density" ? "; a solid has --density" : ""));
  if (name == "poisson" && axis.values.back() >= 0.5)
    throw data::InputError("--poisson: found " + data::format_short(axis.values.back()) +
                           ", expected below 0.5 for a solid");
}

}  // namespace

void check_axes(const std::vector<Axis>& axes, const MaterialBase& base) {
  const data::SheetMaterial& material = base.material;
  bool young = false, poisson = false;
  for (std::size_t i = 0; i < axes.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (axes[i].name == axes[j].name) throw data::InputError(option_of(axes[i].name) + ": given twice");
    }
    check_kind(axes[i], base);
    if (axes[i].name == "bending_ratio" && material.bending_model != data::BendingModel::plate)
      throw data::InputError("--bending-ratio: found bending_model " +
                             std::string(data::to_string(material.bending_model)) +
                             ", expected plate, the only one that is woven");
    if ((axes[i].name == "young_ratio" || axes[i].name == "shear_ratio") &&
        material.constitutive != data::Constitutive::tri_stvk)
      throw data::InputError(option_of(axes[i].name) + ": found constitutive " +
                             data::to_string(material.constitutive) +
                             ", expected TRI_STVK, the only one that is woven");
    if (axes[i].name == "yield_curvature" && material.bending_model != data::BendingModel::hinge)
      throw data::InputError("--yield-curvature: found bending_model " +
                             std::string(data::to_string(material.bending_model)) +
                             ", expected hinge, the only one that yields");
    young = young || (axes[i].name == "young" && axes[i].values.size() > 1);
    poisson = poisson || (axes[i].name == "poisson" && axes[i].values.size() > 1);
  }
  constexpr double kMostCandidates = 1e6;
  if (count_candidates(axes) > kMostCandidates) {
    std::string names;
    for (const Axis& axis : axes)
      if (axis.values.size() > 1) names += (names.empty() ? "" : ", ") + option_of(axis.name);
    throw data::InputError(
        names + ": found " + data::format_short(count_candidates(axes)) + " candidates, expected at most " +
        data::format_count(static_cast<std::size_t>(kMostCandidates)) + ": search fewer values");
  }
  if (material.constitutive == data::Constitutive::tri_arap && young && poisson) {
    throw data::InputError(
        "--young, --poisson: under TRI_ARAP the motion depends on them only through E / (1 + nu), so that no "
        "recording "
        "can tell them apart; hold one (--hold poisson=0.3), or use TRI_COROTATED");
  }
}

void check_grasp_axes(const std::vector<Axis>& axes, const std::vector<Replay>& replays) {
  for (const Replay& replay : replays)
    for (const data::RecordedGrasp& grasp : replay.recording.grasps)
      if (replay.settings.grasp_shape.value_or(grasp.shape) == data::GraspShape::pinch) return;
  for (const Axis& axis : axes)
    if (axis.name.starts_with("grasp_"))
      throw data::InputError(option_of(axis.name) +
                             ": acts on a grasp of the shape pinch, and the recordings have none; choose "
                             "--grasp-shape pinch, or leave it out");
}

namespace {

void set_values(const std::vector<Axis>& axes, const std::vector<double>& values,
                data::SolidMaterial& material) {
  for (std::size_t i = 0; i < axes.size(); ++i) {
    const std::string& name = axes[i].name;
    if (name == "young") material.youngs_modulus = values[i];
    if (name == "poisson") material.poissons_ratio = values[i];
    if (name == "density") material.density = values[i];
    if (name == "friction") material.friction = values[i];
    if (name == "air_drag") material.air_drag = values[i];
    if (name == "stiffness_damping") material.stiffness_damping = values[i];
  }
}

}  // namespace

ReplayCandidate make_candidate(const MaterialBase& base, const std::vector<Axis>& axes,
                               const std::vector<double>& values) {
  ReplayCandidate candidate{base.material, {}, base.solid};
  if (candidate.solid) set_values(axes, values, *candidate.solid);
  data::SheetMaterial& material = candidate.material;
  const double thickness = base.thickness.value_or(1.0);
  bool bending_given = !base.bending_from_thickness;
  for (std::size_t i = 0; i < axes.size(); ++i) {
    const std::string& name = axes[i].name;
    const double value = values[i];
    if (name == "young") material.membrane_stiffness = value * thickness;
    if (name == "poisson") material.poissons_ratio = value;
    if (name == "bending") {
      material.bending_rigidity = value;
      bending_given = true;
    }
    if (name == "bending_ratio") material.weave.bending_ratio = value;
    if (name == "young_ratio") material.weave.young_ratio = value;
    if (name == "shear_ratio") material.weave.shear_ratio = value;
    if (name == "yield_curvature") material.yield_curvature = value;
    if (name == "friction") material.friction = value;
    if (name == "areal_density") material.areal_density = value;
    if (name == "air_drag") material.air_drag = value;
    if (name == "stiffness_damping") material.stiffness_damping = value;
    if (name == "start_yaw") candidate.nuisance.start_yaw = value;
    if (name == "table_height") candidate.nuisance.table_height = value;
    if (name == "grasp_depth") candidate.nuisance.grasp_depth = value;
    if (name == "grasp_direction") candidate.nuisance.grasp_direction = value;
    if (name == "grasp_pitch") candidate.nuisance.grasp_pitch = value;
  }
  if (!bending_given) {
    const double nu = material.poissons_ratio;
    material.bending_rigidity = material.membrane_stiffness * thickness * thickness / (12 * (1 - nu * nu));
  }
  return candidate;
}

}  // namespace flash::sysid
