#include <cmath>

#include "data/files/atomic_file.h"
#include "data/files/json_reader.h"
#include "data/mesh/procedural_mesh.h"
#include "data/recording/recording.h"

namespace flash::data {
namespace {

using Json = nlohmann::ordered_json;

template <int size>
Json numbers(const Eigen::Matrix<double, size, 1>& values) {
  Json list = Json::array();
  for (const double value : values) list.push_back(std::isfinite(value) ? Json(value) : Json(nullptr));
  return list;
}

Json select_json(const Selection& selection) {
  Json select = Json::object();
  if (selection.corner) select["corner"] = *selection.corner;
  if (!selection.vertices.empty()) select["vertices"] = selection.vertices;
  if (selection.position) select["position"] = numbers(*selection.position);
  if (selection.box)
    select["box"] = {{"min", numbers<3>(selection.box->min())}, {"max", numbers<3>(selection.box->max())}};
  else
    select["within"] = selection.within;
  return select;
}

void add_supports(const Recording& recording, Json& json) {
  const auto time = [&](double t) { return std::isfinite(t) ? Json(recording.origin + t) : Json(nullptr); };
  for (const RecordedSupport& support : recording.supports)
    json["supports"].push_back({{"name", support.name},
                                {"from", time(support.from)},
                                {"to", time(support.to)},
                                {"select", select_json(support.select)}});
  for (const RecordedLoad& load : recording.loads)
    json["loads"].push_back({{"select", select_json(load.select)}, {"attached_mass", load.attached_mass}});
}

Json grasp_json(const RecordedGrasp& grasp, double origin) {
  Json json = {{"gripper", grasp.gripper}, {"from", origin + grasp.from}};
  json["to"] = std::isfinite(grasp.to) ? Json(origin + grasp.to) : Json(nullptr);
  json["select"] = select_json(grasp.select);
  json["shape"] = to_string(grasp.shape);
  if (grasp.shape == GraspShape::pinch) {
    json["depth"] = grasp.depth;
    if (!grasp.direction.isZero()) json["direction"] = numbers(grasp.direction);
    json["pitch"] = grasp.pitch;
  }
  return json;
}

}  // namespace

void save_recording(const Recording& recording, const std::string& path) {
  const auto named = [&](const std::string& file) { return relative_path(file, path); };
  Json json = {{"schema", "flash-recording/1"}, {"name", recording.name}, {"kind", recording.kind}};
  json["gravity"] = numbers(recording.gravity);

  Json object;
  object["mesh"] =
      is_made_on_the_spot(recording.mesh_spec) ? recording.mesh_spec : named(recording.mesh_spec);
  object["asset"] = recording.asset.empty() ? Json(nullptr) : Json(named(recording.asset));
  if (recording.start_mesh.empty())
    object["start"] = {{"T_base_object", numbers(to_vector(recording.base_from_object))}};
  else
    object["start"] = {{"mesh", named(recording.start_mesh)}};
  json["object"] = object;

  if (recording.has_table)
    json["table"] = {{"point", numbers(recording.table_point)}, {"normal", numbers(recording.table_normal)}};
  json["trajectories"] = Json::object();
  for (const auto& [name, file] : recording.trajectory_paths) json["trajectories"][name] = named(file);
  json["grasps"] = Json::array();
  for (const RecordedGrasp& grasp : recording.grasps)
    json["grasps"].push_back(grasp_json(grasp, recording.origin));
  add_supports(recording, json);
  const RecordedMarkers& markers = recording.markers;
  if (!markers.tracks_path.empty()) {
    json["markers"]["tracks"] = named(markers.tracks_path);
    if (!markers.placed_path.empty()) json["markers"]["placed"] = named(markers.placed_path);
    if (!markers.on_support.empty()) json["markers"]["on_support"] = markers.on_support;
  }
  if (recording.camera)
    json["camera"] = {{"intrinsics", named(recording.camera->intrinsics_path)},
                      {"T_base_camera", numbers(to_vector(recording.camera->base_from_camera))},
                      {"depth_scale", recording.camera->depth_scale}};
  if (recording.camera && !recording.camera->warnings.empty())
    json["camera"]["warnings"] = recording.camera->warnings;
  json["crop"] = {{"min", numbers(recording.crop.min)}, {"max", numbers(recording.crop.max)}};

  json["keyframes"] = Json::array();
  for (const RecordedKeyframe& keyframe : recording.keyframes) {
    Json entry = {{"t", recording.origin + keyframe.time}};
    const auto put = [&](const char* key, const std::string& file) {
      if (!file.empty()) entry[key] = named(file);
    };
    put("cloud", keyframe.cloud);
    put("depth", keyframe.depth);
    put("mask", keyframe.mask);
    put("markers", keyframe.markers);
    put("contour", keyframe.contour);
    if (keyframe.force) entry["force"] = numbers(*keyframe.force);
    if (keyframe.sample >= 0 && entry.size() == 1) continue;  // the tracks make it
    json["keyframes"].push_back(entry);
  }
  const NuisanceBounds& bounds = recording.nuisance;
  json["nuisance"] = {{"offset_m", numbers(bounds.offset)},
                      {"yaw_rad", bounds.yaw},
                      {"time_s", bounds.time},
                      {"table_height_m", bounds.table_height},
                      {"start_yaw_rad", bounds.start_yaw}};
  write_atomically(path, format_json(json));
}

}  // namespace flash::data
