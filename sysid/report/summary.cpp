#include "sysid/report/summary.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/json_reader.h"
#include "data/files/sha256.h"
#include "data/files/text.h"
#include "sysid/report/summary_checks.h"

namespace flash::sysid {
namespace {

using Json = nlohmann::ordered_json;
constexpr const char* schema = "flash-sysid-summary/2";

/// Of all fields but the digest itself, whatever their order and layout.
std::string digest_of(nlohmann::json fields) {
  fields.erase("digest");
  return data::sha256(fields.dump()).substr(0, 16);
}

Json number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

template <class T>
Json optional(const std::optional<T>& value) {
  return value ? Json(*value) : Json(nullptr);
}

Json numbers(const std::vector<double>& values) {
  Json list = Json::array();
  for (double value : values) list.push_back(number(value));
  return list;
}

Json to_json(const ParameterFinding& finding) {
  Json json;
  json["estimate"] = optional(finding.estimate);
  json["interval95"] = optional(finding.interval95);
  json["identifiable"] = to_string(finding.identifiable);
  json["bits"] = optional(finding.bits);
  json["edge"] = finding.edge == RangeEdge::none ? Json(nullptr) : Json(to_string(finding.edge));
  json["note"] = finding.note;
  json["logarithmic"] = finding.logarithmic;
  json["profile"] = {{"values", numbers(finding.values)}, {"scores", numbers(finding.scores)}};
  return json;
}

Json to_json(const SummaryRecording& recording) {
  Json json;
  json["name"] = recording.name;
  json["sha256"] = recording.sha256;
  if (!recording.mesh.empty()) {
    json["mesh"] = recording.mesh;
    json["own_mesh"] = recording.own_mesh;
    if (!recording.mesh_sha256.empty()) json["mesh_sha256"] = recording.mesh_sha256;
  }
  json["offset"] = {recording.offset.x(), recording.offset.y(), recording.offset.z()};
  json["yaw"] = recording.yaw;
  json["time_offset"] = recording.time_offset;
  json["clock"] = recording.clock
                      ? Json{{"estimate_s", recording.clock->estimate}, {"sd_s", recording.clock->sd}}
                      : Json(nullptr);
  json["nuisance"] = recording.nuisance;
  json["score"] = number(recording.score);
  json["score_on_mesh"] = number(recording.score_on_mesh);
  json["error_cost"] = number(recording.error_cost);
  json["spread_m"] = number(recording.spread);
  json["noise_m"] = number(recording.misfit.noise);
  json["rough_m"] = number(recording.misfit.rough);
  json["misfit_m"] = number(recording.misfit.size);
  json["misfit_rms_m"] = number(recording.misfit.rms);
  json["misfit_explained_m"] = number(recording.misfit.explained);
  json["misfit_reach_s"] = number(recording.misfit.reach_time);
  json["misfit_reach_m"] = number(recording.misfit.reach_sheet);
  json["misfit_gain"] = number(recording.misfit.gain);
  json["misfit_draws"] = Json::array();
  for (const DiscrepancyDraw& draw : recording.misfit.draws)
    json["misfit_draws"].push_back({number(draw.size), number(draw.reach_time), number(draw.reach_sheet)});
  json["model_fits"] = model_fits(recording);
  json["keyframes"] = recording.misfit.keyframes;
  json["keyframes_worth"] = number(recording.misfit.worth);
  json["markers"] = recording.markers ? Json{{"sightings", recording.markers->sightings},
                                             {"miss_m", recording.markers->miss},
                                             {"motion_m", recording.markers->motion},
                                             {"noise_m", recording.markers->noise}}
                                      : Json(nullptr);
  json["horizon_s"] = optional(recording.horizon_s);
  json["horizon_of"] = recording.horizon_of.empty() ? Json(nullptr) : Json(recording.horizon_of);
  json["frames"] = Json::array();
  for (const SummaryFrame& frame : recording.frames)
    json["frames"].push_back({{"t", frame.t}, {"score", number(frame.score)}, {"weight", frame.weight}});
  return json;
}

Json to_json(const Eigen::MatrixXd& matrix) {
  Json rows = Json::array();
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    Json row = Json::array();
    for (Eigen::Index j = 0; j < matrix.cols(); ++j) row.push_back(number(matrix(i, j)));
    rows.push_back(row);
  }
  return rows;
}

// A number that was not finite is written as null.
double finite_or_infinite(const nlohmann::json& value) {
  return value.is_number() ? value.get<double>() : INFINITY;
}
double score_of(const data::JsonObject& json, const char* key) {
  return json.optional_number(key).value_or(INFINITY);
}

std::vector<double> list_of(const data::JsonObject& json, const char* key) {
  if (!json.raw(key).is_array()) throw json.error(key, "a list");
  std::vector<double> values;
  for (const nlohmann::json& value : json.raw(key)) values.push_back(finite_or_infinite(value));
  return values;
}

template <class T>
T typed(const data::JsonObject& json, const char* key, const char* expected) {
  try {
    return json.raw(key).get<T>();
  } catch (const nlohmann::json::exception&) {
    throw json.error(key, expected);
  }
}

Identifiable identifiable_of(const data::JsonObject& json) {
  const std::string name = json.string("identifiable");
  for (Identifiable value :
       {Identifiable::yes, Identifiable::no, Identifiable::lower_bound, Identifiable::upper_bound})
    if (name == to_string(value)) return value;
  throw json.error("identifiable", "yes, no, lower_bound or upper_bound");
}

ParameterFinding read_finding(const std::string& name, const data::JsonObject& json) {
  json.expect_fields(
      {"estimate", "interval95", "identifiable", "bits", "edge", "note", "logarithmic", "profile"});
  ParameterFinding finding;
  finding.name = name;
  finding.estimate = json.optional_number("estimate");
  if (json.has("interval95")) {
    const Eigen::VectorXd interval = json.vector("interval95", 2);
    finding.interval95 = {interval[0], interval[1]};
  }
  finding.identifiable = identifiable_of(json);
  finding.bits = json.optional_number("bits");
  const std::string edge = json.string("edge", "");
  finding.edge = edge == "low" ? RangeEdge::low : edge == "high" ? RangeEdge::high : RangeEdge::none;
  finding.note = json.string("note");
  finding.logarithmic = json.boolean("logarithmic", false);
  const data::JsonObject profile = json.object("profile");
  finding.values = list_of(profile, "values");
  finding.scores = list_of(profile, "scores");
  return finding;
}

SummaryRecording read_recording(const data::JsonObject& json) {
  json.expect_fields({"name",           "sha256",
                      "offset",         "yaw",
                      "time_offset",    "nuisance",
                      "score",          "noise_m",
                      "rough_m",        "misfit_m",
                      "misfit_rms_m",   "misfit_explained_m",
                      "misfit_reach_s", "misfit_reach_m",
                      "misfit_gain",    "model_fits",
                      "keyframes",      "keyframes_worth",
                      "markers",        "horizon_s",
                      "frames",         "misfit_draws",
                      "error_cost",     "spread_m",
                      "score_on_mesh",  "horizon_of",
                      "mesh",           "own_mesh",
                      "mesh_sha256",    "clock"});
  SummaryRecording recording;
  recording.name = json.string("name");
  recording.sha256 = json.string("sha256");
  recording.mesh = json.string("mesh", "");
  recording.own_mesh = json.boolean("own_mesh", false);
  recording.mesh_sha256 = json.string("mesh_sha256", "");
  recording.offset = json.vector("offset", 3);
  recording.yaw = json.number("yaw");
  recording.time_offset = json.number("time_offset");
  if (json.has("clock") && !json.raw("clock").is_null()) {
    const data::JsonObject clock = json.object("clock");
    clock.expect_fields({"estimate_s", "sd_s"});
    recording.clock = {clock.number("estimate_s"), clock.positive("sd_s")};
  }
  recording.nuisance = typed<std::map<std::string, double>>(json, "nuisance", "numbers by name");
  recording.score = score_of(json, "score");
  recording.score_on_mesh = score_of(json, "score_on_mesh");
  // Earlier programs kept neither.
  recording.error_cost = json.optional_number("error_cost").value_or(0);
  recording.spread = json.optional_number("spread_m").value_or(0);
  Misfit& misfit = recording.misfit;
  misfit.noise = score_of(json, "noise_m");
  misfit.size = score_of(json, "misfit_m");
  // Earlier programs stated one noise and one size.
  misfit.rough = json.has("rough_m") ? score_of(json, "rough_m") : misfit.noise;
  misfit.rms = json.has("misfit_rms_m") ? score_of(json, "misfit_rms_m") : misfit.size;
  misfit.explained = score_of(json, "misfit_explained_m");
  misfit.reach_time = score_of(json, "misfit_reach_s");
  misfit.reach_sheet = score_of(json, "misfit_reach_m");
  misfit.gain = score_of(json, "misfit_gain");
  if (json.has("misfit_draws")) {
    for (const auto& [size, reach_time, reach_sheet] :
         typed<std::vector<std::array<double, 3>>>(json, "misfit_draws", "lists of three numbers"))
      misfit.draws.push_back({size, reach_time, reach_sheet});
  }
  if (misfit.draws.empty())  // earlier programs
    misfit.draws = {{misfit.rms, misfit.reach_time, misfit.reach_sheet}};
  if (json.has("markers")) {
    const data::JsonObject markers = json.object("markers");
    markers.expect_fields({"sightings", "miss_m", "motion_m", "noise_m"});
    recording.markers = {markers.integer("sightings"), score_of(markers, "miss_m"),
                         score_of(markers, "motion_m"), score_of(markers, "noise_m")};
  }
  misfit.found = !json.boolean("model_fits", true) && (!recording.markers || recording.markers->follows());
  misfit.keyframes = json.integer("keyframes");
  misfit.worth = score_of(json, "keyframes_worth");
  recording.horizon_s = json.optional_number("horizon_s");
  recording.horizon_of = json.string("horizon_of", "");
  for (const data::JsonObject& frame : json.objects("frames"))
    recording.frames.push_back({frame.number("t"), score_of(frame, "score"), frame.number("weight")});
  return recording;
}

/// `columns`: -1: as many as rows.
Eigen::MatrixXd read_matrix(const data::JsonObject& json, const char* key, Eigen::Index columns = -1) {
  const nlohmann::json& rows = json.raw(key);
  const auto size = static_cast<Eigen::Index>(rows.size());
  if (columns < 0) columns = size;
  Eigen::MatrixXd matrix(size, columns);
  for (Eigen::Index i = 0; i < size; ++i) {
    const nlohmann::json& row = rows[static_cast<std::size_t>(i)];
    if (static_cast<Eigen::Index>(row.size()) != columns)
      throw json.error(key, "rows of " + std::to_string(columns) + " numbers");
    for (Eigen::Index j = 0; j < columns; ++j)
      matrix(i, j) = finite_or_infinite(row[static_cast<std::size_t>(j)]);
  }
  return matrix;
}

/// Refuses files of a later program or of another major version, which may mean other things by a field.
void check_version(const data::JsonObject& json) {
  const auto part = [](const std::string& version, std::size_t k) {
    const std::vector<std::string_view> parts = data::split(version, ".");
    return k < parts.size() ? data::parse_integer(parts[k]) : std::nullopt;
  };
  const std::string found = json.string("tool_version");
  const auto major = part(found, 0), minor = part(found, 1);
  if (!major || !minor || *major != *part(FLASH_VERSION, 0) || *minor > *part(FLASH_VERSION, 1))
    throw json.error("tool_version", "a search by this program, version " FLASH_VERSION ", or one before it");
}

}  // namespace

bool young_is_in_pascal(const Summary& summary) {
  return summary.settings.count("thickness_m") > 0 || summary.settings.count("element_type") > 0;
}

double duration_of(const SummaryRecording& recording) {
  double first = INFINITY, last = -INFINITY;
  for (const SummaryFrame& frame : recording.frames) {
    if (frame.weight <= 0) continue;
    first = std::min(first, frame.t);
    last = std::max(last, frame.t);
  }
  return std::max(0.0, last - first);
}

bool model_fits(const SummaryRecording& recording) {
  constexpr double kTold = 1e-5;  // [m]
  const Misfit& misfit = recording.misfit;
  return (!misfit.found || misfit.size < misfit.explained + kTold) &&
         (!recording.markers || recording.markers->follows());
}

std::string summary_text(const Summary& summary) {
  Json json;
  json["schema"] = schema;
  json["tool_version"] = summary.tool_version;
  json["best"] = {{"parameters", summary.best},
                  {"membrane_stiffness", number(summary.membrane_stiffness)},
                  {"score", number(summary.best_score)},
                  {"score_on_mesh", number(summary.score_on_mesh)}};
  json["axes"] = Json::array();
  json["parameters"] = Json::object();
  for (const ParameterFinding& finding : summary.parameters) {
    json["axes"].push_back(finding.name);
    json["parameters"][finding.name] = to_json(finding);
  }
  json["fixed"] = Json::object();
  for (const auto& [name, fixed] : summary.fixed) {
    json["fixed"][name] = {{"value", fixed.value}, {"source", fixed.source}};
    if (fixed.deviation) json["fixed"][name]["deviation"] = *fixed.deviation;
  }
  json["held"] = Json::object();
  for (const auto& [name, between] : summary.held) json["held"][name] = between;
  json["covariance_log"] = to_json(summary.covariance_log);
  json["samples"] = to_json(summary.samples);
  if (summary.sample_weights.size() > 0)
    json["sample_weights"] =
        std::vector<double>(summary.sample_weights.begin(), summary.sample_weights.end());
  json["next_experiments"] = Json::array();
  for (const NextExperiment& next : summary.next_experiments)
    json["next_experiments"].push_back({{"experiment", next.name},
                                        {"bits", number(next.bits)},
                                        {"spread_before", next.spread_before},
                                        {"spread", next.spread}});
  json["recordings"] = Json::array();
  for (const SummaryRecording& recording : summary.recordings)
    json["recordings"].push_back(to_json(recording));
  json["by_points"] = summary.by_points;
  json["solver_check"] = Json::array();
  for (const SolverCheck& check : summary.solver_check)
    json["solver_check"].push_back(
        {{"what", check.what}, {"surface_change_m", number(check.surface_change_m)}, {"shift", check.shift}});
  if (summary.agreement)
    json["agreement"] = {{"excess", number(summary.agreement->excess)},
                         {"chance", number(summary.agreement->chance)},
                         {"alone", summary.agreement->alone},
                         {"spreads", summary.agreement->spreads}};
  json["settings"] = summary.settings;
  json["asset"] = summary.asset;
  json["candidates"] = summary.candidates;
  json["unconverged"] = summary.unconverged;
  json["device"] = summary.device;
  json["wall_seconds"] = summary.wall_seconds;
  json["warnings"] = summary.warnings;
  json["exit_code"] = summary.exit_code;
  json["results_digest"] = summary.results_digest;
  if (!summary.residuals_digest.empty()) {
    json["residuals_digest"] = summary.residuals_digest;
    json["open_information"] = numbers(summary.open_information);
  }
  json["digest"] = digest_of(nlohmann::json::parse(data::format_json(json)));  // of numbers as they are read
  return data::format_json(json);
}

void save_summary(const Summary& summary, const std::string& path) {
  data::write_atomically(path, summary_text(summary));
}

Summary load_summary(const std::string& path) {
  const nlohmann::json file = data::load_json(path);
  const data::JsonObject json(file, path);
  if (json.string("schema") != schema) throw json.error("schema", schema);
  json.expect_fields({"schema",
                      "tool_version",
                      "best",
                      "axes",
                      "parameters",
                      "fixed",
                      "samples",
                      "covariance_log",
                      "recordings",
                      "by_points",
                      "solver_check",
                      "settings",
                      "asset",
                      "candidates",
                      "unconverged",
                      "device",
                      "wall_seconds",
                      "warnings",
                      "exit_code",
                      "results_digest",
                      "digest",
                      "next_experiments",
                      "held",
                      "agreement",
                      "sample_weights",
                      "residuals_digest",
                      "open_information"});
  check_version(json);
  Summary summary;
  summary.tool_version = json.string("tool_version");
  const data::JsonObject best = json.object("best");
  summary.best = typed<std::map<std::string, double>>(best, "parameters", "numbers by name");
  summary.membrane_stiffness = score_of(best, "membrane_stiffness");
  summary.best_score = score_of(best, "score");
  // Earlier programs had one score.
  summary.score_on_mesh = best.has("score_on_mesh") ? score_of(best, "score_on_mesh") : summary.best_score;
  const data::JsonObject parameters = json.object("parameters");
  for (const std::string& name : typed<std::vector<std::string>>(json, "axes", "a list of names"))
    summary.parameters.push_back(read_finding(name, parameters.object(name.c_str())));
  for (const auto& [name, fixed] : json.members("fixed")) {
    summary.fixed[name] = {fixed.number("value"), fixed.string("source")};
    if (fixed.has("deviation")) summary.fixed[name].deviation = fixed.number("deviation");
  }
  if (json.has("held"))  // earlier programs named none
    summary.held =
        typed<std::map<std::string, std::array<double, 2>>>(json, "held", "pairs of numbers by name");
  summary.covariance_log = read_matrix(json, "covariance_log");
  summary.samples = read_matrix(json, "samples", static_cast<Eigen::Index>(summary.parameters.size()));
  if (json.has("sample_weights"))
    summary.sample_weights = json.vector("sample_weights", static_cast<int>(summary.samples.rows()));
  if (json.has("next_experiments"))  // earlier programs ranked none
    for (const data::JsonObject& next : json.objects("next_experiments")) {
      next.expect_fields({"experiment", "bits", "spread_before", "spread"});
      const auto numbers_of = [&](const char* key) {
        return typed<std::map<std::string, double>>(next, key, "numbers by name");
      };
      summary.next_experiments.push_back({next.string("experiment"), score_of(next, "bits"),
                                          numbers_of("spread_before"), numbers_of("spread")});
    }
  for (const data::JsonObject& recording : json.objects("recordings"))
    summary.recordings.push_back(read_recording(recording));
  summary.by_points = json.boolean("by_points", false);  // earlier programs did not say
  for (const data::JsonObject& check : json.objects("solver_check"))
    summary.solver_check.push_back(
        {check.string("what"), score_of(check, "surface_change_m"),
         check.has("shift") ? typed<std::map<std::string, double>>(check, "shift", "numbers by name")
                            : std::map<std::string, double>{}});
  if (json.has("agreement")) {
    const data::JsonObject agreement = json.object("agreement");
    agreement.expect_fields({"excess", "chance", "alone", "spreads"});
    const auto lists = [&](const char* key) {
      return typed<std::vector<std::vector<double>>>(agreement, key, "lists of numbers");
    };
    summary.agreement = {score_of(agreement, "excess"), score_of(agreement, "chance"), lists("alone"),
                         lists("spreads")};
  }
  summary.settings = typed<std::map<std::string, std::string>>(json, "settings", "texts by name");
  summary.asset = json.string("asset");
  summary.candidates = json.integer("candidates");
  summary.unconverged = json.integer("unconverged");
  summary.device = json.string("device");
  summary.wall_seconds = json.number("wall_seconds");
  summary.warnings = typed<std::vector<std::string>>(json, "warnings", "a list of texts");
  summary.exit_code = json.integer("exit_code");
  summary.results_digest = json.string("results_digest", "");
  summary.residuals_digest = json.string("residuals_digest", "");
  if (!summary.residuals_digest.empty()) summary.open_information = list_of(json, "open_information");
  check_values(summary, path);
  if (const std::string digest = digest_of(file); json.string("digest", "") != digest)
    throw json.error(
        "digest", '"' + digest + "\", as of its other fields: one was edited; grid --resume writes it anew");
  return summary;
}

}  // namespace flash::sysid
