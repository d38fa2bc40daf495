#include "sysid/summary.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "data/atomic_file.h"
#include "data/error.h"

namespace flash::sysid {
namespace {

using Json = nlohmann::ordered_json;
constexpr const char* schema = "flash-sysid-summary/1";

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
  json["offset"] = {recording.offset.x(), recording.offset.y(), recording.offset.z()};
  json["yaw"] = recording.yaw;
  json["time_offset"] = recording.time_offset;
  json["nuisance"] = recording.nuisance;
  json["score"] = number(recording.score);
  json["sigma_m"] = number(recording.sigma_m);
  json["sigma_source"] = recording.sigma_source;
  json["horizon_s"] = optional(recording.horizon_s);
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

/// One JSON object of the file, read field by field; messages name the file and the path to the field.
class Fields {
 public:
  Fields(const Json& json, std::string source, std::string path)
      : json_(json), source_(std::move(source)), path_(std::move(path)) {
    if (!json_.is_object()) fail("", "expected an object");
  }

  Fields object(const char* name) const { return {at(name), source_, path(name) + "."}; }

  template <class Read>
  void each(const char* name, const Read& read) const {
    const Json& list = at(name);
    if (!list.is_array() && !list.is_object()) fail(name, "expected a list or an object");
    for (auto item = list.begin(); item != list.end(); ++item) {
      const std::string key = list.is_object() ? item.key() : "";
      const std::string step = list.is_object() ? "." + key : "[" + std::to_string(item - list.begin()) + "]";
      read(key, Fields(item.value(), source_, path(name) + step + "."));
    }
  }

  template <class T>
  void read(const char* name, T& value) const {
    try {
      read_value(at(name), value);
    } catch (const nlohmann::json::exception&) {
      fail(name, "found " + at(name).dump().substr(0, 40) + ", expected another type");
    }
  }

  [[noreturn]] void fail(const std::string& name, const std::string& what) const {
    throw data::input_error(source_, path(name), what);
  }

 private:
  const Json& at(const char* name) const {
    if (!json_.contains(name)) fail(name, "missing");
    return json_.at(name);
  }
  std::string path(const std::string& name) const { return path_ + name; }

  // A number that was not finite is written as null.
  static void read_value(const Json& json, double& value) {
    value = json.is_null() ? INFINITY : json.get<double>();
  }
  static void read_value(const Json& json, std::vector<double>& values) {
    values.clear();
    for (const Json& item : json) read_value(item, values.emplace_back());
  }
  static void read_value(const Json& json, Eigen::Vector3d& value) {
    const auto numbers = json.get<std::array<double, 3>>();
    value = Eigen::Vector3d(numbers[0], numbers[1], numbers[2]);
  }
  static void read_value(const Json& json, Eigen::MatrixXd& matrix) {
    matrix.resize(static_cast<Eigen::Index>(json.size()), static_cast<Eigen::Index>(json.size()));
    for (Eigen::Index i = 0; i < matrix.rows(); ++i)
      for (Eigen::Index j = 0; j < matrix.cols(); ++j)
        read_value(json.at(static_cast<std::size_t>(i)).at(static_cast<std::size_t>(j)), matrix(i, j));
  }
  template <class T>
  static void read_value(const Json& json, std::optional<T>& value) {
    value.reset();
    if (!json.is_null()) value = json.get<T>();
  }
  template <class T>
  static void read_value(const Json& json, T& value) {
    value = json.get<T>();
  }

  const Json& json_;
  std::string source_, path_;
};

Identifiable identifiable_of(const Fields& fields) {
  std::string name;
  fields.read("identifiable", name);
  for (Identifiable value :
       {Identifiable::yes, Identifiable::no, Identifiable::lower_bound, Identifiable::upper_bound})
    if (name == to_string(value)) return value;
  fields.fail("identifiable", "found \"" + name + "\", expected yes, no, lower_bound or upper_bound");
}

ParameterFinding read_finding(const std::string& name, const Fields& fields) {
  ParameterFinding finding;
  finding.name = name;
  fields.read("estimate", finding.estimate);
  fields.read("interval95", finding.interval95);
  finding.identifiable = identifiable_of(fields);
  std::optional<std::string> edge;
  fields.read("edge", edge);
  finding.edge = !edge ? RangeEdge::none : *edge == "low" ? RangeEdge::low : RangeEdge::high;
  fields.read("note", finding.note);
  fields.read("logarithmic", finding.logarithmic);
  const Fields profile = fields.object("profile");
  profile.read("values", finding.values);
  profile.read("scores", finding.scores);
  return finding;
}

SummaryRecording read_recording(const Fields& fields) {
  SummaryRecording recording;
  fields.read("name", recording.name);
  fields.read("sha256", recording.sha256);
  fields.read("offset", recording.offset);
  fields.read("yaw", recording.yaw);
  fields.read("time_offset", recording.time_offset);
  fields.read("nuisance", recording.nuisance);
  fields.read("score", recording.score);
  fields.read("sigma_m", recording.sigma_m);
  fields.read("sigma_source", recording.sigma_source);
  fields.read("horizon_s", recording.horizon_s);
  fields.each("frames", [&](const std::string&, const Fields& frame) {
    SummaryFrame& read = recording.frames.emplace_back();
    frame.read("t", read.t);
    frame.read("score", read.score);
    frame.read("weight", read.weight);
  });
  return recording;
}

}  // namespace

std::string to_string(Identifiable identifiable) {
  switch (identifiable) {
    case Identifiable::yes:
      return "yes";
    case Identifiable::lower_bound:
      return "lower_bound";
    case Identifiable::upper_bound:
      return "upper_bound";
    case Identifiable::no:
      break;
  }
  return "no";
}

std::string to_string(RangeEdge edge) {
  return edge == RangeEdge::low ? "low" : edge == RangeEdge::high ? "high" : "";
}

std::string summary_text(const Summary& summary) {
  Json json;
  json["schema"] = schema;
  json["tool_version"] = summary.tool_version;
  json["best"] = {{"parameters", summary.best},
                  {"membrane_stiffness", number(summary.membrane_stiffness)},
                  {"score", number(summary.best_score)}};
  json["level95"] = number(summary.level95);
  json["parameters"] = Json::object();
  for (const ParameterFinding& finding : summary.parameters)
    json["parameters"][finding.name] = to_json(finding);
  json["fixed"] = Json::object();
  for (const auto& [name, fixed] : summary.fixed)
    json["fixed"][name] = {{"value", fixed.value}, {"source", fixed.source}};
  json["covariance_log"] = to_json(summary.covariance_log);
  json["recordings"] = Json::array();
  for (const SummaryRecording& recording : summary.recordings)
    json["recordings"].push_back(to_json(recording));
  json["solver_check"] = Json::object();
  for (const SolverCheck& check : summary.solver_check)
    json["solver_check"][check.what] = {{"score", number(check.score)},
                                        {"surface_change_m", number(check.surface_change_m)}};
  json["settings"] = summary.settings;
  json["asset"] = summary.asset;
  json["candidates"] = summary.candidates;
  json["unconverged"] = summary.unconverged;
  json["device"] = summary.device;
  json["wall_seconds"] = summary.wall_seconds;
  json["warnings"] = summary.warnings;
  json["exit_code"] = summary.exit_code;
  return json.dump(2) + "\n";
}

void save_summary(const Summary& summary, const std::string& path) {
  data::write_atomically(path, summary_text(summary));
}

Summary load_summary(const std::string& path) {
  const Json json = Json::parse(data::read_file(path), nullptr, false);
  if (json.is_discarded()) throw data::InputError(path + ": not a JSON file");
  const Fields fields(json, path, "");
  std::string found;
  fields.read("schema", found);
  if (found != schema) fields.fail("schema", "found \"" + found + "\", expected \"" + schema + "\"");

  Summary summary;
  fields.read("tool_version", summary.tool_version);
  const Fields best = fields.object("best");
  best.read("parameters", summary.best);
  best.read("membrane_stiffness", summary.membrane_stiffness);
  best.read("score", summary.best_score);
  fields.read("level95", summary.level95);
  fields.each("parameters", [&](const std::string& name, const Fields& finding) {
    summary.parameters.push_back(read_finding(name, finding));
  });
  fields.each("fixed", [&](const std::string& name, const Fields& fixed) {
    fixed.read("value", summary.fixed[name].value);
    fixed.read("source", summary.fixed[name].source);
  });
  fields.read("covariance_log", summary.covariance_log);
  fields.each("recordings", [&](const std::string&, const Fields& recording) {
    summary.recordings.push_back(read_recording(recording));
  });
  fields.each("solver_check", [&](const std::string& what, const Fields& check) {
    SolverCheck& read = summary.solver_check.emplace_back();
    read.what = what;
    check.read("score", read.score);
    check.read("surface_change_m", read.surface_change_m);
  });
  fields.read("settings", summary.settings);
  fields.read("asset", summary.asset);
  fields.read("candidates", summary.candidates);
  fields.read("unconverged", summary.unconverged);
  fields.read("device", summary.device);
  fields.read("wall_seconds", summary.wall_seconds);
  fields.read("warnings", summary.warnings);
  fields.read("exit_code", summary.exit_code);
  return summary;
}

}  // namespace flash::sysid
