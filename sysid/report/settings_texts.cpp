#include "sysid/report/settings_texts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "data/files/text.h"
#include "sysid/replay/recorded_grasp.h"
#include "sysid/replay/replay_mesh.h"
#include "sysid/report/searched_mesh.h"

namespace flash::sysid {
namespace {

std::string mm(double metres) { return data::format_short(std::round(1e5 * metres) / 100) + " mm"; }

constexpr const char* two_sided_term = "unseen cloth";

/// What was observed, of which the score is a mean: "cloud, contour".
std::string observed_terms(const std::vector<Replay>& replays, const Objective& objective) {
  std::array<double, 5> weights = {};
  for (const Replay& replay : replays)
    for (const Observation& observation : replay.observations) {
      const std::array<double, 5> of_frame = term_weights(observation, objective);
      for (std::size_t k = 0; k < weights.size(); ++k) weights[k] = std::max(weights[k], of_frame[k]);
    }
  constexpr std::array<const char*, 5> kNames = {"cloud", "contour", "markers", "force", two_sided_term};
  std::string terms;
  for (std::size_t k = 0; k < weights.size(); ++k)
    if (weights[k] > 0) terms += (terms.empty() ? "" : ", ") + std::string(kNames[k]);
  return terms;
}

std::string sigmas_of(const Objective& objective) {
  return "cloud " + mm(objective.cloud_sigma) + ", contour " + mm(objective.contour_sigma) + ", markers " +
         mm(objective.marker_sigma) + ", force " + data::format_short(objective.force_sigma) + " N";
}

/// "offset, yaw"; empty where recordings share none.
std::string shared_errors(const SharedRegistration& shared) {
  std::string names;
  for (const auto& [is_shared, name] : {std::pair(shared.offset, "offset"), std::pair(shared.yaw, "yaw"),
                                        std::pair(shared.time, "time-offset")})
    if (is_shared) names += (names.empty() ? "" : ", ") + std::string(name);
  return names;
}

/// Of the grasps as they were simulated, each once: "clamp".
std::string grasp_shapes(const std::vector<Replay>& replays) {
  std::string shapes;
  for (const Replay& replay : replays)
    for (const data::RecordedGrasp& grasp : replay.recording.grasps) {
      const std::string shape = data::to_string(shape_of(grasp, replay.settings));
      if (shapes.find(shape) == std::string::npos) shapes += (shapes.empty() ? "" : ", ") + shape;
    }
  return shapes;
}

bool describes_recording(const std::string& name) {
  const Parameter* const found = find_parameter(name);
  return found != nullptr && !found->material;
}

/// Values that the search told or held of what describes a recording.
std::map<std::string, double> values_of_recording(const nlohmann::json& identification) {
  std::map<std::string, double> values;
  const auto take = [&](const std::string& name, const nlohmann::json& value) {
    if (value.is_number() && describes_recording(name)) values[name] = value.get<double>();
  };
  const nlohmann::json estimate = identification.value("estimate", nlohmann::json()),
                       held = identification.value("fixed", nlohmann::json());
  for (const auto& [name, value] : estimate.items()) take(name, value);
  for (const auto& [name, fixed] : held.items())
    if (fixed.is_object()) take(name, fixed.value("value", nlohmann::json()));
  return values;
}

}  // namespace

std::map<std::string, std::string> settings_texts(const std::vector<Replay>& replays,
                                                  const GridSettings& settings) {
  const Replay& replay = replays.front();
  std::map<std::string, std::string> texts;
  const double scale = replay.settings.cell_scale;
  if (scale < 1) texts["cell_scale"] = data::format_number(scale);
  texts["mesh"] = named_mesh(replay.recording.mesh_spec) +
                  (scale < 1 && !takes_any_cell(replay.recording) ? ", its cells halved (" : " (") +
                  data::format_count(static_cast<std::size_t>(replay.sheet().rest.vertices.rows())) +
                  " vertices)";
  texts["object_mesh"] = named_mesh(replay.object_mesh);
  if (const auto& solid = settings.base.solid) {
    texts["element_type"] = "TETRAHEDRON";
    texts["element_order"] = replay.settings.element_order == data::ElementOrder::quadratic ? "2" : "1";
    texts["constitutive"] = data::to_string(solid->constitutive);
  } else {
    texts["constitutive"] = data::to_string(settings.base.material.constitutive);
    texts["bending_model"] = data::to_string(settings.base.material.bending_model);
  }
  texts["time_step_s"] = data::format_number(replay.settings.solver.time_step);
  texts["max_iterations"] = std::to_string(replay.settings.solver.max_iterations);
  texts["tolerance"] = data::format_number(replay.settings.solver.tolerance);
  if (const auto& layers = replay.settings.self_contact) {
    texts["self_contact_m"] = data::format_number(layers->thickness);
    texts["layer_friction"] = layers->friction < 0 ? "friction" : data::format_number(layers->friction);
  }
  if (settings.base.thickness) texts["thickness_m"] = data::format_number(*settings.base.thickness);
  const Robust& robust = settings.score.objective.robust;
  texts["distance"] =
      robust.kind == RobustKind::trimmed
          ? "mean without the largest " + data::format_short(100 * robust.trim_fraction) + " %"
      : robust.kind == RobustKind::huber ? "Huber, " + data::format_short(1000 * robust.huber_delta) + " mm"
                                         : "mean";
  texts["min_points"] = std::to_string(replay.settings.min_points);
  if (std::isfinite(replay.settings.score_from))
    texts["score_from_s"] = data::format_number(replay.settings.score_from);
  if (std::isfinite(replay.settings.score_to))
    texts["score_to_s"] = data::format_number(replay.settings.score_to);
  if (const std::string shared = shared_errors(settings.score.shared); !shared.empty() && replays.size() > 1)
    texts["share"] = shared;
  texts["observed"] = observed_terms(replays, settings.score.objective);
  texts["sigmas"] = sigmas_of(settings.score.objective);
  if (const std::string shapes = grasp_shapes(replays); !shapes.empty()) {
    texts["grasp_shape"] = shapes;
    texts["grasp_within"] = replay.settings.grasp_within ? mm(*replay.settings.grasp_within) : "as recorded";
    texts["clamp_slopes"] = replay.settings.clamp_slopes ? "yes" : "no";
    if (replay.settings.grasp_cell) texts["grasp_cell"] = mm(*replay.settings.grasp_cell);
  }
  return texts;
}

std::vector<std::string> unlike_the_search(const data::Asset& asset,
                                           const std::map<std::string, std::string>& settings,
                                           const std::vector<Axis>& held) {
  const nlohmann::json identification = nlohmann::json::parse(asset.identification, nullptr, false);
  if (!identification.is_object()) return {};
  const nlohmann::json search = identification.value("solver", nlohmann::json());
  if (!search.is_object() || !search.contains("mesh")) return {};
  const auto searched = [&](const char* name) {
    const bool said = search.contains(name) && search[name].is_string();
    return said ? search[name].get<std::string>() : "none";
  };
  const auto here = [&](const char* name) {
    const auto found = settings.find(name);
    return found == settings.end() ? "none" : found->second;
  };
  std::vector<std::string> lines;
  const auto differs = [&](const std::string& option, const std::string& found, const std::string& had) {
    if (found != had)
      lines.push_back(option + ": found " + found + ", the search behind the asset had " + had);
  };
  constexpr std::array<std::pair<const char*, const char*>, 11> kOptions = {
      {{"grasp_shape", "--grasp-shape"},
       {"grasp_within", "--grasp-within"},
       {"grasp_cell", "--grasp-cell"},
       {"clamp_slopes", "--clamp-slopes"},
       {"time_step_s", "--time-step"},
       {"max_iterations", "--iterations"},
       {"tolerance", "--tolerance"},
       {"self_contact_m", "--self-contact"},
       {"layer_friction", "--layer-friction"},
       {"distance", "--distance"},
       {"sigmas", "--sigma"}}};
  if (here("object_mesh") == searched("object_mesh")) differs("--mesh", here("mesh"), searched("mesh"));
  for (const auto& [name, option] : kOptions) differs(option, here(name), searched(name));
  if (search.contains("min_points")) {  // earlier programs did not say which keyframes counted
    differs("--from", here("score_from_s"), searched("score_from_s"));
    differs("--until", here("score_to_s"), searched("score_to_s"));
    differs("--share", here("share"), searched("share"));
    const auto is_two_sided = [](const std::string& observed) {
      return observed.find(two_sided_term) != std::string::npos ? "yes" : "no";
    };
    differs("--two-sided", is_two_sided(here("observed")), is_two_sided(searched("observed")));
  }
  for (const auto& of_recording : values_of_recording(identification)) {
    const std::string& name = of_recording.first;
    const auto hold =
        std::find_if(held.begin(), held.end(), [&](const Axis& axis) { return axis.name == name; });
    differs("--hold " + name, hold == held.end() ? "none" : data::format_short(hold->values.front()),
            data::format_short(of_recording.second));
  }
  return lines;
}

}  // namespace flash::sysid
