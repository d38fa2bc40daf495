#include "sysid/report/export_asset.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "data/asset/asset_mesh.h"
#include "data/files/error.h"
#include "data/files/json_reader.h"
#include "sim/scene/sheet.h"
#include "sim/scene/solid.h"
#include "sysid/report/next_steps.h"

namespace flash::sysid {
namespace {

using Json = nlohmann::ordered_json;

Json number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

// Names and matrix together: the order of the rows must not depend on another field.
Json covariance(const Summary& summary) {
  if (summary.covariance_log.size() == 0) return nullptr;
  Json json = {{"parameters", Json::array()}, {"matrix", Json::array()}};
  for (const ParameterFinding& finding : summary.parameters) json["parameters"].push_back(finding.name);
  for (Eigen::Index i = 0; i < summary.covariance_log.rows(); ++i) {
    Json row = Json::array();
    for (Eigen::Index j = 0; j < summary.covariance_log.cols(); ++j)
      row.push_back(number(summary.covariance_log(i, j)));
    json["matrix"].push_back(row);
  }
  return json;
}

/// Draws of the posterior, to train on: parameters trade off along valleys that ranges do not show.
/// `weight`: name of what they differ in where it is not known.
Json samples(const Summary& summary, const char* weight) {
  if (summary.samples.rows() == 0) return nullptr;
  Json json = {{"parameters", Json::array()}, {"values", Json::array()}};
  for (const ParameterFinding& finding : summary.parameters) json["parameters"].push_back(finding.name);
  const bool weighed = summary.sample_weights.size() == 0;
  if (!weighed) json["parameters"].push_back(weight);
  for (Eigen::Index i = 0; i < summary.samples.rows(); ++i) {
    Json row = Json::array();
    for (Eigen::Index j = 0; j < summary.samples.cols(); ++j) row.push_back(number(summary.samples(i, j)));
    if (!weighed) row.push_back(number(summary.sample_weights[i]));
    json["values"].push_back(row);
  }
  return json;
}

/// What an object has under a name, where that is a text.
std::string text_of(const Json& object, const std::string& name, const std::string& otherwise) {
  const auto found = object.find(name);
  return found != object.end() && found->is_string() ? found->get<std::string>() : otherwise;
}

/// Where the base has its values from: by its own identification, or assumed.
std::string source_of(const data::Asset& base, const std::string& name) {
  const Json known = Json::parse(base.identification, nullptr, false);
  if (!known.is_object()) return "assumed";
  const Json* const fixed = known.contains("fixed") ? &known["fixed"] : nullptr;
  if (fixed && fixed->is_object() && fixed->contains(name) && (*fixed)[name].is_object())
    return text_of((*fixed)[name], "source", "assumed");
  const Json* const verdicts = known.contains("identifiable") ? &known["identifiable"] : nullptr;
  if (verdicts && verdicts->is_object() && text_of(*verdicts, name, "no") != "no") return "identified";
  return "assumed";
}

std::string identification(const data::Asset& base, const std::map<std::string, double>& base_values,
                           const Summary& summary) {
  Json json;
  json["recordings"] = Json::array();
  std::optional<double> horizon;
  for (const SummaryRecording& recording : summary.recordings) {
    json["recordings"].push_back(
        {{"name", recording.name},
         {"sha256", recording.sha256},
         {"score_m", number(recording.score_on_mesh)},
         {"horizon_s", recording.horizon_s ? Json(*recording.horizon_s) : Json(nullptr)}});
    if (!recording.mesh.empty() && !recording.own_mesh) json["recordings"].back()["mesh"] = recording.mesh;
    if (!recording.mesh_sha256.empty() && !recording.own_mesh)
      json["recordings"].back()["mesh_sha256"] = recording.mesh_sha256;
    if (const auto size = recording.nuisance.find("grasp_size"); size != recording.nuisance.end())
      json["recordings"].back()["grasp_size_m"] = size->second;
    if (recording.horizon_s) horizon = std::min(horizon.value_or(*recording.horizon_s), *recording.horizon_s);
  }
  for (const char* part : {"estimate", "interval95", "identifiable", "fixed"}) json[part] = Json::object();
  for (const ParameterFinding& finding : summary.parameters) {
    const bool known = finding.identifiable != Identifiable::no;
    json["estimate"][finding.name] = known && finding.estimate ? Json(*finding.estimate) : Json(nullptr);
    json["interval95"][finding.name] =
        known && finding.interval95 ? Json(*finding.interval95) : Json(nullptr);
    json["identifiable"][finding.name] = to_string(finding.identifiable);
  }
  for (const auto& [name, fixed] : summary.fixed)
    json["fixed"][name] = {{"value", fixed.value}, {"source", fixed.source}};
  for (const ParameterFinding& finding : summary.parameters)
    if (finding.identifiable == Identifiable::no && base_values.count(finding.name))
      json["fixed"][finding.name] = {{"value", base_values.at(finding.name)},
                                     {"source", source_of(base, finding.name)}};
  json["covariance_log"] = covariance(summary);
  const bool solid = base.element_type == data::ElementType::tetrahedron;
  json["samples"] = samples(summary, solid ? "density" : "areal_density");
  json["score_m"] = number(summary.score_on_mesh);
  json["horizon_s"] = horizon ? Json(*horizon) : Json(nullptr);
  json["solver"] = summary.settings;
  json["tool_version"] = summary.tool_version;
  json["randomization"] = randomization_ranges(summary);
  json["caveats"] = caveats(summary);
  return data::format_json(json);
}

/// The parameters as the asset has them, by name.
std::map<std::string, double> values_of_sheet(const data::Asset& asset) {
  const double area = sim::make_sheet(data::load_rest_mesh(asset)).vertex_area.sum();
  const data::SheetMaterial material = data::resolve_sheet(asset, area).material;
  std::map<std::string, double> values = {{"young", asset.young},
                                          {"poisson", asset.poisson},
                                          {"bending", material.bending_rigidity},
                                          {"bending_ratio", asset.weave.bending_ratio},
                                          {"young_ratio", asset.weave.young_ratio},
                                          {"shear_ratio", asset.weave.shear_ratio},
                                          {"friction", asset.friction},
                                          {"areal_density", material.areal_density},
                                          {"air_drag", asset.air_drag},
                                          {"stiffness_damping", asset.stiffness_damping}};
  if (asset.yield_curvature) values["yield_curvature"] = *asset.yield_curvature;
  return values;
}

std::map<std::string, double> values_of_solid(const data::Asset& asset) {
  const double volume = sim::make_solid(data::load_asset_tet_mesh(asset)).vertex_volume.sum();
  return {{"young", asset.young},
          {"poisson", asset.poisson},
          {"density", data::resolve_solid(asset, volume).material.density},
          {"friction", asset.friction},
          {"air_drag", asset.air_drag},
          {"stiffness_damping", asset.stiffness_damping}};
}

}  // namespace

std::map<std::string, std::array<double, 2>> randomization_ranges(const Summary& summary) {
  std::map<std::string, std::array<double, 2>> ranges;
  for (const ParameterFinding& finding : summary.parameters) {
    if (finding.values.empty()) continue;
    const std::array<double, 2> searched = {finding.values.front(), finding.values.back()};
    ranges[finding.name] =
        finding.identifiable == Identifiable::no ? searched : finding.interval95.value_or(searched);
  }
  return ranges;
}

data::Asset tuned_asset(const data::Asset& base, const Summary& summary) {
  if (summary.best.empty())
    throw data::InputError("summary.json: best: the search found no candidate to export");
  data::Asset asset = base;
  const auto mesh = summary.settings.find("object_mesh");
  if (mesh != summary.settings.end()) asset.mesh = mesh->second;
  const bool solid = asset.element_type == data::ElementType::tetrahedron;
  const std::map<std::string, double> base_values = solid ? values_of_solid(asset) : values_of_sheet(asset);

  std::map<std::string, double> values = summary.best;
  bool bending_found = summary.fixed.count("bending") > 0, yield_is_told = true;
  for (const ParameterFinding& finding : summary.parameters) {
    if (finding.identifiable == Identifiable::yes && finding.estimate)
      values[finding.name] = *finding.estimate;
    if (finding.identifiable == Identifiable::no && base_values.count(finding.name))
      values[finding.name] = base_values.at(finding.name);
    yield_is_told &= finding.name != "yield_curvature" || finding.identifiable != Identifiable::no;
    bending_found |= finding.name == "bending" && finding.identifiable != Identifiable::no;
  }
  asset.format = data::AssetFormat::flash_1;
  asset.young = values.at("young");
  asset.poisson = values.at("poisson");
  asset.identification = identification(base, base_values, summary);
  if (solid) {
    asset.friction = values.at("friction");
    asset.air_drag = values.at("air_drag");
    asset.stiffness_damping = values.at("stiffness_damping");
    asset.density = values.at("density");
    asset.mass.reset();
    asset.object_mass.reset();
    return asset;
  }
  const auto take = [&](const char* name, double& ratio) {
    if (const auto value = values.find(name); value != values.end()) ratio = value->second;
  };
  take("bending_ratio", asset.weave.bending_ratio);
  take("young_ratio", asset.weave.young_ratio);
  take("shear_ratio", asset.weave.shear_ratio);
  if (const auto yield = values.find("yield_curvature"); yield != values.end() && yield_is_told)
    asset.yield_curvature = yield->second;
  asset.friction = values.at("friction");
  asset.air_drag = values.at("air_drag");
  asset.stiffness_damping = values.at("stiffness_damping");
  asset.published_bending.reset();
  const bool follows_young = base.thickness && !base.bending_rigidity && !base.published_bending;
  if (!follows_young || bending_found) asset.bending_rigidity = values.at("bending");
  asset.density.reset();
  asset.mass.reset();
  asset.object_mass.reset();
  asset.areal_density = values.at("areal_density");
  return asset;
}

}  // namespace flash::sysid
