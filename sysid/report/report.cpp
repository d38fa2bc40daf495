#include "sysid/report/report.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string_view>

#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/picture/html_page.h"
#include "sysid/observe/registration_parameter.h"
#include "sysid/report/next_steps.h"
#include "sysid/report/parameter_label.h"

namespace flash::embedded {
std::string_view report_template();
std::string_view plotly();
std::string_view plotly_licence();
}  // namespace flash::embedded

namespace flash::sysid {
namespace {

using Json = nlohmann::ordered_json;

Json number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

template <class T>
Json optional(const std::optional<T>& value) {
  return value ? Json(*value) : Json(nullptr);
}

// Whole tenths of a millimetre: a sixth of the size of decimals, and finer than a pixel.
Json tenths_of_millimetres(const data::Points& points, int at_most) {
  Json flat = Json::array();
  const Eigen::Index count = std::min<Eigen::Index>(points.rows(), at_most);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::Index row = i * points.rows() / count;
    for (int k = 0; k < 3; ++k) flat.push_back(static_cast<int>(std::lround(1e4 * points(row, k))));
  }
  return flat;
}

Json numbers(const std::vector<double>& values) {
  Json list = Json::array();
  for (double value : values) list.push_back(number(value));
  return list;
}

void add_label(Json& entry, const std::string& name, bool has_thickness) {
  const ParameterLabel label = parameter_label(name, has_thickness);
  entry["name"] = name;
  entry["label"] = label.label;
  entry["symbol"] = label.symbol;
  entry["unit"] = label.unit;
}

Json parameters_of(const Summary& summary, bool has_thickness) {
  Json list = Json::array();
  for (const ParameterFinding& finding : summary.parameters) {
    Json entry;
    add_label(entry, finding.name, has_thickness);
    entry["estimate"] = optional(finding.estimate);
    entry["interval95"] = optional(finding.interval95);
    entry["identifiable"] = to_string(finding.identifiable);
    entry["bits"] = optional(finding.bits);
    entry["edge"] = to_string(finding.edge);
    entry["note"] = finding.note;
    entry["logarithmic"] = finding.logarithmic;
    entry["values"] = finding.values;
    entry["scores"] = numbers(finding.scores);
    list.push_back(entry);
  }
  return list;
}

Json fixed_of(const Summary& summary, bool has_thickness) {
  Json list = Json::array();
  for (const auto& [name, fixed] : summary.fixed) {
    Json entry;
    add_label(entry, name, has_thickness);
    entry["value"] = fixed.value;
    entry["source"] = fixed.source;
    if (const auto held = summary.held.find(name); held != summary.held.end()) entry["within"] = held->second;
    list.push_back(entry);
  }
  return list;
}

Json recordings_of(const Summary& summary) {
  Json list = Json::array();
  for (const SummaryRecording& recording : summary.recordings) {
    Json frames = Json::array();
    for (const SummaryFrame& frame : recording.frames)
      frames.push_back({{"t", frame.t}, {"score", number(frame.score)}, {"weight", frame.weight}});
    list.push_back(
        {{"name", recording.name},
         {"offset", {recording.offset.x(), recording.offset.y(), recording.offset.z()}},
         {"yaw", recording.yaw},
         {"time_offset", recording.time_offset},
         {"clock", recording.clock ? Json{recording.clock->estimate, recording.clock->sd} : Json(nullptr)},
         {"nuisance", recording.nuisance},
         {"score", number(recording.score)},
         {"noise_m", number(recording.misfit.noise)},
         {"misfit_m", number(recording.misfit.size)},
         {"explained_m", number(recording.misfit.explained)},
         {"fits", model_fits(recording)},
         {"markers", recording.markers ? Json{{"miss_m", recording.markers->miss},
                                              {"motion_m", recording.markers->motion},
                                              {"noise_m", recording.markers->noise}}
                                       : Json(nullptr)},
         {"keyframes", recording.misfit.keyframes},
         {"worth", number(recording.misfit.worth)},
         {"horizon_s", optional(recording.horizon_s)},
         {"horizon_of", recording.horizon_of},
         {"frames", frames}});
  }
  return list;
}

// Columns in the order of the findings; axes of a single value have none.
Json table_of(const Summary& summary, const GridResults& results) {
  std::vector<std::size_t> columns;
  for (const ParameterFinding& finding : summary.parameters)
    for (std::size_t k = 0; k < results.axes.size(); ++k)
      if (results.axes[k].name == finding.name) columns.push_back(k);
  Json values = Json::array(), scores = Json::array();
  if (columns.size() == summary.parameters.size()) {
    for (const CandidateResult& candidate : results.candidates) {
      Json row = Json::array();
      for (std::size_t k : columns) row.push_back(candidate.values[k]);
      values.push_back(row);
      scores.push_back(number(candidate.score));
    }
  }
  return {{"values", values}, {"scores", scores}};
}

// Which bound of the registration which candidate ended at: a row a recording and bound, the candidates in
// order of their score.
Json bounds_of(const GridResults& results) {
  std::vector<const CandidateResult*> candidates;
  for (const CandidateResult& candidate : results.candidates)
    if (std::isfinite(candidate.score)) candidates.push_back(&candidate);
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const auto* a, const auto* b) { return a->score < b->score; });
  Json rows = Json::array();
  for (std::size_t r = 0; r < results.recordings.size(); ++r)
    for (const RegistrationParameter& parameter : registration_parameters) {
      Json hits = Json::array();
      int count = 0;
      for (const CandidateResult* candidate : candidates) {
        const bool hit =
            r < candidate->recordings.size() && is_at_bound(candidate->recordings[r].bounds_hit, parameter);
        hits.push_back(hit ? 1 : 0);
        count += hit;
      }
      if (count > 0)
        rows.push_back({{"recording", results.recordings[r]},
                        {"what", parameter.label},
                        {"best", hits.front() == 1},
                        {"hits", hits}});
    }
  return rows;
}

Json overlays_of(const std::vector<Overlay>& overlays, int max_cloud_points) {
  Json list = Json::array();
  for (const Overlay& overlay : overlays) {
    Json frames = Json::array();
    for (const OverlayFrame& frame : overlay.frames)
      frames.push_back(
          {{"t", frame.t},
           {"score", frame.cloud.rows() > 0 ? number(frame.score) : Json(nullptr)},
           {"mesh", tenths_of_millimetres(frame.vertices, static_cast<int>(frame.vertices.rows()))},
           {"cloud", tenths_of_millimetres(frame.cloud, max_cloud_points)}});
    const std::vector<int> triangles(overlay.triangles.data(),
                                     overlay.triangles.data() + overlay.triangles.size());
    list.push_back({{"name", overlay.name}, {"triangles", triangles}, {"frames", frames}});
    if (!overlay.start_picture.empty()) list.back()["start"] = overlay.start_picture;
  }
  return list;
}

Json map_axes(const Summary& summary, const std::array<std::string, 2>& names) {
  if (!names[0].empty() && names[0] == names[1])
    throw data::InputError("--map: found " + names[0] + " twice, expected two parameters");
  Json axes = Json::array();
  for (const std::string& name : names) {
    if (name.empty()) continue;
    std::string known;
    std::size_t k = 0;
    while (k < summary.parameters.size() && summary.parameters[k].name != name)
      known += (k ? ", " : "") + summary.parameters[k].name, ++k;
    if (k == summary.parameters.size())
      throw data::InputError("--map: " + name + " was not searched (searched: " + known + ")");
    axes.push_back(k);
  }
  return axes;
}

}  // namespace

std::string render_report(const Summary& summary, const GridResults& results,
                          const std::vector<Overlay>& overlays, const ReportSettings& settings) {
  const bool has_thickness = young_is_in_pascal(summary);
  Json json;
  json["parameters"] = parameters_of(summary, has_thickness);
  json["fixed"] = fixed_of(summary, has_thickness);
  json["recordings"] = recordings_of(summary);
  json["score"] = number(summary.best_score);
  json["score_on_mesh"] = number(summary.score_on_mesh);
  json["candidates"] = summary.candidates;
  json["unconverged"] = summary.unconverged;
  json["exit_code"] = summary.exit_code;
  json["warnings"] = summary.warnings;
  json["unknowns"] = standing_unknowns(summary);
  json["next_steps"] = next_steps(summary);
  json["bounds"] = bounds_of(results);
  json["by_points"] = summary.by_points;
  json["solver_check"] = Json::array();
  for (const SolverCheck& check : summary.solver_check)
    json["solver_check"].push_back({{"what", check.what},
                                    {"label", solver_check_label(check.what)},
                                    {"surface_change_m", number(check.surface_change_m)},
                                    {"shift", check.shift}});
  json["settings"] = summary.settings;
  json["table"] = table_of(summary, results);
  json["map_axes"] = map_axes(summary, settings.map_axes);
  json["replays"] = overlays_of(overlays, settings.max_cloud_points);
  char footer[160];
  std::snprintf(footer, sizeof footer, "flash-sysid %s · device %s · %.0f s", summary.tool_version.c_str(),
                summary.device.c_str(), summary.wall_seconds);
  json["footer"] = footer;
  const std::string text = data::inside_script(json.dump(-1, ' ', false, Json::error_handler_t::replace));
  return data::fill_page(
      embedded::report_template(),
      {{"@DATA@", text}, {"@PLOTLY_LICENCE@", embedded::plotly_licence()}, {"@PLOTLY@", embedded::plotly()}});
}

void write_report(const Summary& summary, const GridResults& results, const std::vector<Overlay>& overlays,
                  const ReportSettings& settings, const std::string& path) {
  data::write_atomically(path, render_report(summary, results, overlays, settings));
}

}  // namespace flash::sysid
