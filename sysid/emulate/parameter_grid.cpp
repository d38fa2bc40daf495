#include "sysid/emulate/parameter_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "data/asset/asset.h"
#include "data/files/error.h"
#include "data/files/json_reader.h"
#include "data/files/text.h"
#include "sysid/replay/grasp_mesh.h"
#include "sysid/replay/recorded_grasp.h"

namespace flash::sysid {
namespace {

const Parameter& info_of(const std::string& option, const std::string& name) {
  if (const Parameter* const found = find_parameter(name)) return *found;
  std::vector<std::string> names;
  for (const Parameter& info : known_parameters()) names.push_back(info.name);
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

void check_range(const std::string& option, const Parameter& info, double value) {
  if (value >= info.low && value <= info.high) return;
  throw data::InputError(option + ": found " + data::format_short(value) + ", expected " +
                         data::format_short(info.low) + " to " + data::format_short(info.high) +
                         (info.unit.empty() ? "" : " " + info.unit));
}

}  // namespace

std::string option_of(const std::string& name) {
  std::string option = "--" + name;
  std::replace(option.begin(), option.end(), '_', '-');
  return option;
}

void check_parameter(const std::string& option, const std::string& name) { info_of(option, name); }

Axis parse_axis(const std::string& name, const std::string& specification) {
  const std::string option = option_of(name);
  const Parameter& info = info_of(option, name);
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
                           "\": expected name=value, name=value+-SD or name=value:measured, as friction=0.3");
  const std::string name = text.substr(0, equals);
  const std::string where = "--hold " + name;
  const Parameter& info = info_of(where, name);
  std::string_view word = std::string_view(text).substr(equals + 1);
  const bool measured = word.ends_with(kMeasured);
  if (measured) word.remove_suffix(kMeasured.size());
  const std::size_t sign = word.find(kDeviation);
  const std::optional<double> value = data::parse_number(word.substr(0, sign));
  if (!value || !std::isfinite(*value))
    throw data::InputError(
        where + ": found \"" + std::string(word) +
        "\", expected a number, one with its standard deviation, as 0.31+-0.005, or one with "
        ":measured");
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
  const Parameter::Of of = info_of(option_of(name), name).of;
  if (!base.solid) {
    if (of == Parameter::Of::solid)
      throw data::InputError(option_of(name) +
                             ": found a sheet, expected a solid; a sheet has --areal-density");
    return;
  }
  if (of == Parameter::Of::sheet)
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
  constexpr double kMostCandidates = 1e6;  // Candidates of a search. Work: a refusal.
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
  for (const Axis& axis : axes) {
    if (!axis.name.starts_with("grasp_")) continue;
    const bool of_size = axis.name == "grasp_size";
    if (axis.name == "grasp_stiffness" && axis.values.front() < rigid_pads)
      for (const Replay& replay : replays)
        if (replay.settings.clamp_slopes)
          throw data::InputError(
              "--grasp-stiffness: pads that give way hold no slope; leave out --clamp-slopes");
    const data::GraspShape shape =
        of_size || axis.name == "grasp_stiffness" ? data::GraspShape::clamp : data::GraspShape::pinch;
    const auto acts_on = [&](const Replay& replay) {
      if (of_size) return grasp_size(replay.recording, replay.settings).has_value();
      return std::any_of(
          replay.recording.grasps.begin(), replay.recording.grasps.end(),
          [&](const data::RecordedGrasp& grasp) { return shape_of(grasp, replay.settings) == shape; });
    };
    if (std::any_of(replays.begin(), replays.end(), acts_on)) continue;
    const std::string name = data::to_string(shape);
    throw data::InputError(option_of(axis.name) + ": acts on a grasp of the shape " + name +
                           (of_size ? " at a corner of a sheet" : "") +
                           ", and the recordings have none; choose --grasp-shape " + name +
                           ", or leave it out");
  }
}

ReplayCandidate make_candidate(const MaterialBase& base, const std::vector<Axis>& axes,
                               const std::vector<double>& values) {
  ReplayCandidate candidate{base.material, {}, base.solid};
  bool bending_given = !base.bending_from_thickness;
  for (std::size_t i = 0; i < axes.size(); ++i) {
    info_of(option_of(axes[i].name), axes[i].name).set(candidate, values[i], base);
    bending_given = bending_given || axes[i].name == "bending";
  }
  if (!bending_given) {
    data::SheetMaterial& material = candidate.material;
    const double nu = material.poissons_ratio, thickness = base.thickness.value_or(1.0);
    material.bending_rigidity = material.membrane_stiffness * thickness * thickness / (12 * (1 - nu * nu));
  }
  return candidate;
}

}  // namespace flash::sysid
