#include "data/recording/recording.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <set>

#include "data/camera/extrinsics.h"
#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/json_reader.h"
#include "data/files/text.h"
#include "data/mesh/mesh_io.h"
#include "data/mesh/procedural_mesh.h"
#include "data/mesh/tet_faces.h"
#include "data/recording/frame_files.h"
#include "data/recording/gravity.h"
#include "data/recording/recording_markers.h"

namespace flash::data {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Nothing that a robot arm handles is larger: above it, lengths are taken for millimetres [m].
constexpr double kLargestSize = 20.0;

/// Nothing that is done to a sheet takes longer: above it, times are taken for those of another clock [s].
constexpr double kLongestRecording = 1e5;

/// Clocks that differ more are not set at all [s].
constexpr double kLargestClockError = 60.0;

Eigen::Isometry3d read_pose(const JsonObject& object, const char* key) {
  const Eigen::VectorXd pose = object.vector(key, 7);
  if (std::abs(pose.tail<4>().norm() - 1) > 1e-3)
    throw object.error(key, "[x, y, z, qx, qy, qz, qw] with a unit quaternion");
  return from_vector(pose);
}

double diagonal(const Points& points) {
  return points.rows() == 0 ? 0 : (points.colwise().maxCoeff() - points.colwise().minCoeff()).norm();
}

std::string existing_file(const JsonObject& object, const char* key, const std::string& source) {
  const std::string path = resolve_path(object.string(key), source);
  if (!std::filesystem::exists(path))
    throw input_error(source, object.name_of(key), "file " + path + " does not exist");
  return path;
}

void read_object(const JsonObject& file, Recording& recording) {
  const JsonObject object = file.object("object");
  object.expect_fields({"mesh", "asset", "start", "note"});
  const std::string mesh = object.string("mesh");
  load_object_mesh(is_made_on_the_spot(mesh) ? mesh : existing_file(object, "mesh", recording.source),
                   recording.source, object.name_of("mesh"), recording);
  const double size = diagonal(recording.mesh.vertices);
  if (size > kLargestSize)
    throw object.error(
        "mesh", "metres: the mesh is " + format_short(size) + " m across (millimetres read as metres?)");
  if (object.has("asset")) recording.asset = existing_file(object, "asset", recording.source);

  recording.start = recording.mesh.vertices;
  if (!object.has("start")) return;
  if (object.raw("start").is_string()) {
    recording.start_mesh = existing_file(object, "start", recording.source);
  } else {
    const JsonObject start = object.object("start");
    start.expect_fields({"T_base_object", "mesh", "note"});
    if (start.has("T_base_object") == start.has("mesh"))
      throw input_error(recording.source, "object.start", "expected either T_base_object or mesh");
    if (start.has("mesh")) recording.start_mesh = existing_file(start, "mesh", recording.source);
    if (start.has("T_base_object")) recording.base_from_object = read_pose(start, "T_base_object");
  }
  if (!recording.start_mesh.empty()) {
    recording.start = load_geometry(recording.start_mesh).points;
    if (recording.start.rows() != recording.mesh.vertices.rows())
      throw input_error(recording.source, "object.start",
                        "found " + format_count(static_cast<std::size_t>(recording.start.rows())) +
                            " vertices in " + recording.start_mesh + ", expected " +
                            format_count(static_cast<std::size_t>(recording.mesh.vertices.rows())) +
                            " as in object.mesh");
    return;
  }
  recording.start *= recording.base_from_object.linear().transpose();
  recording.start.rowwise() += recording.base_from_object.translation().transpose();
}

void read_table(const JsonObject& file, Recording& recording) {
  recording.has_table = file.has("table");
  if (!recording.has_table) return;
  const JsonObject table = file.object("table");
  table.expect_fields({"point", "normal"});
  recording.table_point = table.vector("point", 3);
  recording.table_normal = table.direction("normal", Eigen::Vector3d::UnitZ());
}

void read_trajectories(const JsonObject& file, Recording& recording) {
  if (!file.has("trajectories")) return;
  const JsonObject trajectories = file.object("trajectories");
  for (const auto& [name, value] : trajectories.value().items()) {
    const std::string path = existing_file(trajectories, name.c_str(), recording.source);
    const Trajectory trajectory = load_trajectory(path);
    for (const Eigen::Isometry3d& pose : trajectory.poses)
      if (pose.translation().norm() > kLargestSize)
        throw InputError(
            path + ": reaches " + format_short(pose.translation().norm()) +
            " m from the origin, expected metres in the robot's base frame (millimetres read as metres?)");
    for (const std::string& jumps : find_jumps(trajectory, path)) recording.doubts.push_back(jumps);
    recording.trajectories[name] = trajectory;
    recording.trajectory_paths[name] = path;
  }
}

GraspShape read_shape(const JsonObject& grasp) {
  const std::optional<GraspShape> shape = parse_grasp_shape(grasp.string("shape", "clamp"));
  if (!shape) throw grasp.error("shape", "clamp, point or pinch");
  return *shape;
}

void read_grasps(const JsonObject& file, Recording& recording) {
  for (const JsonObject& object : file.objects("grasps")) {
    object.expect_fields({"gripper", "from", "to", "select", "shape", "depth", "direction", "pitch", "note"});
    RecordedGrasp grasp;
    grasp.gripper = object.string("gripper");
    if (!recording.trajectories.contains(grasp.gripper)) {
      std::string known;
      for (const auto& [name, trajectory] : recording.trajectories)
        known += (known.empty() ? "" : ", ") + name;
      throw object.error("gripper", "a name of trajectories: " + (known.empty() ? "there are none" : known));
    }
    grasp.from = object.number("from", -kInfinity);
    grasp.to = object.number("to", kInfinity);
    if (!(grasp.to > grasp.from)) throw object.error("to", "a time after from, or null");
    grasp.select = read_selection(object, recording.mesh.vertices.rows());
    for (const RecordedGrasp& other : recording.grasps)
      if (other.gripper == grasp.gripper && other.from < grasp.to && grasp.from < other.to &&
          other.select.corner == grasp.select.corner && other.select.vertices == grasp.select.vertices &&
          other.select.position == grasp.select.position && !grasp.select.box)
        throw object.error("select", "what this gripper does not hold already at that time");
    grasp.shape = read_shape(object);
    grasp.depth = object.positive("depth", grasp.depth);
    if (object.has("direction")) grasp.direction = object.direction("direction", grasp.direction);
    grasp.pitch = object.number("pitch", 0.0);
    recording.grasps.push_back(grasp);
  }
}

void read_supports(const JsonObject& file, Recording& recording) {
  const auto read = [&](const JsonObject& object) {
    Selection select = read_selection(object, recording.mesh.vertices.rows());
    if (select.position)
      throw input_error(object.source(), object.name_of("select"), "expected corner, vertices or box");
    return select;
  };
  for (const JsonObject& object : file.objects("supports")) {
    object.expect_fields({"name", "from", "to", "select", "note"});
    RecordedSupport support;
    support.name = object.string("name", support.name);
    support.from = object.number("from", -kInfinity);
    support.to = object.number("to", kInfinity);
    if (!(support.to > support.from)) throw object.error("to", "a time after from, or null");
    support.select = read(object);
    recording.supports.push_back(support);
  }
  for (const JsonObject& object : file.objects("loads")) {
    object.expect_fields({"attached_mass", "select", "note"});
    recording.loads.push_back({read(object), object.positive("attached_mass")});
  }
}

void read_camera(const JsonObject& file, Recording& recording) {
  if (!file.has("camera")) return;
  const JsonObject object = file.object("camera");
  object.expect_fields({"intrinsics", "T_base_camera", "depth_scale", "warnings"});
  RecordedCamera camera;
  camera.intrinsics_path = existing_file(object, "intrinsics", recording.source);
  camera.intrinsics = load_camera_intrinsics(camera.intrinsics_path);
  camera.base_from_camera = read_pose(object, "T_base_camera");
  camera.depth_scale = object.positive("depth_scale", camera.depth_scale);
  camera.warnings = read_warnings(object);
  recording.camera = camera;
}

void read_crop(const JsonObject& file, Recording& recording) {
  if (!file.has("crop")) return;
  const JsonObject crop = file.object("crop");
  crop.expect_fields({"min", "max"});
  recording.crop.min = read_bound(crop, "min", -kInfinity);
  recording.crop.max = read_bound(crop, "max", kInfinity);
  if (!(recording.crop.min.array() < recording.crop.max.array()).all())
    throw crop.error("min", "below max on every axis");
}

void read_keyframes(const JsonObject& file, Recording& recording) {
  for (const JsonObject& object : file.objects("keyframes")) {
    object.expect_fields({"t", "cloud", "depth", "mask", "markers", "contour", "force", "note"});
    RecordedKeyframe keyframe;
    keyframe.time = object.number("t");
    if (!recording.keyframes.empty() && keyframe.time <= recording.keyframes.back().time)
      throw object.error(
          "t", "a time after " + format_number(recording.keyframes.back().time) + " s, the keyframe before");
    const auto read = [&](const char* key, std::string& path) {
      if (object.has(key)) path = existing_file(object, key, recording.source);
    };
    read("cloud", keyframe.cloud);
    read("depth", keyframe.depth);
    read("mask", keyframe.mask);
    read("markers", keyframe.markers);
    read("contour", keyframe.contour);
    if (object.has("force")) keyframe.force = object.vector("force", 3);
    if (!keyframe.depth.empty() && !recording.camera)
      throw object.error("depth", "a camera in the recording");
    if (!keyframe.depth.empty() && !keyframe.cloud.empty())
      throw object.error("depth", "one of cloud and depth");
    if (!keyframe.mask.empty() && keyframe.depth.empty()) throw object.error("mask", "depth beside it");
    if (keyframe.cloud.empty() && keyframe.depth.empty() && keyframe.markers.empty() &&
        keyframe.contour.empty() && !keyframe.force)
      throw object.error("cloud", "cloud, depth, markers, contour or force");
    recording.keyframes.push_back(keyframe);
  }
  add_tracked_keyframes(recording);
  if (recording.keyframes.empty()) throw file.error("keyframes", "at least one keyframe");
}

void read_nuisance(const JsonObject& file, Recording& recording) {
  if (!file.has("nuisance")) return;
  const JsonObject object = file.object("nuisance");
  object.expect_fields({"offset_m", "yaw_rad", "time_s", "table_height_m", "start_yaw_rad"});
  NuisanceBounds& bounds = recording.nuisance;
  if (object.has("offset_m")) {
    bounds.offset = object.raw("offset_m").is_number()
                        ? Eigen::Vector3d(Eigen::Vector3d::Constant(object.number("offset_m")))
                        : Eigen::Vector3d(object.vector("offset_m", 3));
    if (!(bounds.offset.array() >= 0 && bounds.offset.array() <= kLargestSize).all())
      throw object.error("offset_m", "bounds of 0 to " + format_short(kLargestSize) + " m");
  }
  const auto bound = [&](const char* key, double largest, const char* unit) {
    const double value = object.not_negative(key, 0);
    if (value > largest) throw object.error(key, "a bound of 0 to " + format_short(largest) + unit);
    return value;
  };
  bounds.yaw = bound("yaw_rad", std::numbers::pi, " rad");
  bounds.time = bound("time_s", kLargestClockError, " s");
  bounds.table_height = bound("table_height_m", kLargestSize, " m");
  bounds.start_yaw = bound("start_yaw_rad", std::numbers::pi, " rad");
}

/// A gripper that nothing names moves nothing.
void doubt_unused(Recording& recording) {
  for (const auto& each : recording.trajectories) {
    const std::string& name = each.first;
    const bool used = std::any_of(recording.grasps.begin(), recording.grasps.end(),
                                  [&](const RecordedGrasp& grasp) { return grasp.gripper == name; });
    if (!used)
      recording.doubts.push_back("trajectories." + name + ": no grasp names it, so that it holds nothing");
  }
}

void check_times(Recording& recording) {
  const double first = recording.keyframes.front().time, last = recording.keyframes.back().time;
  const double few = std::max(0.1, 0.05 * (last - first));  // frames before or after the motion are usual [s]
  for (const auto& [name, trajectory] : recording.trajectories) {
    const double begin = trajectory.times.front(), end = trajectory.times.back();
    const std::string spans = "keyframes span " + format_clock(first) + " to " + format_clock(last) +
                              " s, trajectory " + name + ' ' + format_clock(begin) + " to " +
                              format_clock(end) + " s";
    const double slack = recording.nuisance.time;
    if (first > end + slack || last < begin - slack)
      throw input_error(recording.source, "keyframes", spans + ": expected clocks that overlap");
    // Times that differ by the rounding of their files are the same time.
    const double outside = std::max(begin - first, last - end) - slack;
    const std::string still = spans + ": the gripper stands still outside its trajectory";
    if (outside > few)
      recording.doubts.push_back(still);
    else if (outside > 1e-6)
      recording.notices.push_back(recording.source + ": " + still);
  }
}

/// Refuses times of another clock, then counts all from the start of the recording.
void count_from_start(Recording& recording) {
  const double first = recording.keyframes.front().time, last = recording.keyframes.back().time;
  if (!(last - first <= kLongestRecording))
    throw input_error(recording.source, "keyframes",
                      "found times from " + format_clock(first) + " to " + format_clock(last) +
                          " s, expected at most " + format_short(kLongestRecording) + " s between them");
  recording.origin = first;
  for (std::size_t g = 0; g < recording.grasps.size(); ++g) {
    RecordedGrasp& grasp = recording.grasps[g];
    if (std::isinf(grasp.from))
      grasp.from = std::min(first, recording.trajectories.at(grasp.gripper).times.front());
    if (!(first - grasp.from <= kLongestRecording))
      throw input_error(recording.source, "grasps[" + std::to_string(g) + "].from",
                        "found " + format_clock(grasp.from) + " s, expected a time by the clock of the " +
                            "keyframes, which start at " + format_clock(first) + " s");
    recording.origin = std::min(recording.origin, grasp.from);
  }
  for (std::size_t k = 0; k < recording.supports.size(); ++k) {
    const double from = recording.supports[k].from;
    if (std::isinf(from)) continue;
    if (!(first - from <= kLongestRecording))
      throw input_error(recording.source, "supports[" + std::to_string(k) + "].from",
                        "found " + format_clock(from) + " s, expected a time by the clock of the " +
                            "keyframes, which start at " + format_clock(first) + " s");
    recording.origin = std::min(recording.origin, from);
  }
  if (recording.origin == 0) return;
  // To the microsecond, which is what a double tells of the seconds since 1970.
  const auto shift = [&](double& time) { time = std::round(1e6 * (time - recording.origin)) / 1e6; };
  for (RecordedKeyframe& keyframe : recording.keyframes) shift(keyframe.time);
  for (auto& [name, trajectory] : recording.trajectories)
    for (double& time : trajectory.times) shift(time);
  for (RecordedGrasp& grasp : recording.grasps) {
    shift(grasp.from);
    shift(grasp.to);
  }
  for (RecordedSupport& support : recording.supports) {
    shift(support.from);
    shift(support.to);
  }
}

std::string named_gripper(const RecordedGrasp& grasp) {
  return grasp.gripper == "gripper" ? "the gripper" : "gripper " + grasp.gripper;
}

/// Only grasps that act on the start shape can be checked before anything has moved.
void check_grasps(const Recording& recording) {
  double earliest = kInfinity;
  for (const RecordedGrasp& grasp : recording.grasps) earliest = std::min(earliest, grasp.from);
  for (std::size_t g = 0; g < recording.grasps.size(); ++g) {
    const RecordedGrasp& grasp = recording.grasps[g];
    if (grasp.from > earliest) continue;
    const Eigen::Isometry3d pose = pose_at(recording.trajectories.at(grasp.gripper), grasp.from);
    const Eigen::Vector3d at = pose * grasp.select.position.value_or(Eigen::Vector3d::Zero());
    Eigen::AlignedBox3d held;  // a gripper may be in the middle of an edge, far from each vertex
    for (const int vertex : select_vertices(recording, grasp))
      held.extend(recording.start.row(vertex).transpose());
    const double distance = held.exteriorDistance(at), offset = recording.nuisance.offset.norm();
    if (distance > (grasp.select.within + offset) * (1 + 1e-9))
      throw input_error(
          recording.source, "grasps[" + std::to_string(g) + "]",
          "at t = " + format_clock(recording.origin + grasp.from) + " s " + named_gripper(grasp) + " is " +
              format_short(distance) + " m from the vertices it should hold, expected at most within " +
              format_short(grasp.select.within) + " m plus nuisance.offset_m " + format_short(offset) +
              " m: check object.start, select and the frame of the trajectory");
  }
}

/// Each takes a vertex at least.
void check_supports(Recording& recording) {
  std::set<int> held;
  for (std::size_t k = 0; k < recording.supports.size(); ++k)
    for (const int vertex :
         select_vertices(recording, recording.supports[k].select, "supports[" + std::to_string(k) + "]"))
      held.insert(vertex);
  for (std::size_t k = 0; k < recording.loads.size(); ++k) {
    const std::string name = "loads[" + std::to_string(k) + "]";
    const std::vector<int> loaded = select_vertices(recording, recording.loads[k].select, name);
    const auto count = std::count_if(loaded.begin(), loaded.end(), [&](int i) { return held.contains(i); });
    if (count > 0)
      recording.notices.push_back(recording.source + ": " + name + ": " +
                                  format_count(static_cast<std::size_t>(count)) + " of its " +
                                  format_count(loaded.size()) +
                                  " vertices are held by supports, whose share of the weight moves nothing");
  }
}

}  // namespace

void load_object_mesh(const std::string& mesh, const std::string& source, const std::string& field,
                      Recording& recording) {
  std::optional<TetMesh> solid;
  const std::string extension = lower_extension(mesh);
  if (is_tet_mesh_spec(mesh))
    solid = parse_tet_mesh_spec(mesh, source, field);
  else if (!is_mesh_spec(mesh) && (extension == ".tet" || ((extension == ".vtk" || extension == ".msh") &&
                                                           load_geometry(mesh).tetrahedra.rows() > 0)))
    solid = load_tet_mesh(mesh);
  recording.mesh_spec = mesh;
  if (solid) {
    recording.tetrahedra = std::move(solid->tetrahedra);
    recording.mesh = {std::move(solid->vertices), outer_faces(recording.tetrahedra)};
    return;
  }
  recording.tetrahedra.resize(0, 4);
  recording.mesh = is_mesh_spec(mesh) ? parse_mesh_spec(mesh, source, field) : load_triangle_mesh(mesh);
}

std::optional<GraspShape> parse_grasp_shape(const std::string& text) {
  for (const GraspShape shape : {GraspShape::clamp, GraspShape::point, GraspShape::pinch})
    if (text == to_string(shape)) return shape;
  return std::nullopt;
}

const char* to_string(GraspShape shape) {
  switch (shape) {
    case GraspShape::clamp:
      return "clamp";
    case GraspShape::point:
      return "point";
    case GraspShape::pinch:
      return "pinch";
  }
  return "";
}

Recording load_recording(const std::string& path) {
  Recording recording;
  recording.source =
      std::filesystem::is_directory(path) ? (std::filesystem::path(path) / "recording.json").string() : path;
  const nlohmann::json json = load_json(recording.source);
  const JsonObject file(json, recording.source);
  if (file.string("schema", "") != "flash-recording/1") throw file.error("schema", "\"flash-recording/1\"");
  file.expect_fields({"schema", "name", "kind", "note", "gravity", "object", "table", "trajectories",
                      "grasps", "supports", "loads", "markers", "camera", "crop", "keyframes", "nuisance"});
  recording.name = file.string("name");
  if (std::any_of(recording.name.begin(), recording.name.end(),
                  [](unsigned char c) { return c < ' ' || c == 0x7f; }))
    throw file.error("name", "a text in one line");
  if (recording.name.empty()) throw file.error("name", "a text that is not empty");
  recording.kind = file.string("kind", recording.kind);
  const std::vector<std::string> kinds = {"corner_lift", "hang",       "bar_pull", "bias_pull",
                                          "drag",        "cantilever", "free"};
  if (std::find(kinds.begin(), kinds.end(), recording.kind) == kinds.end())
    throw file.error("kind", "corner_lift, hang, bar_pull, bias_pull, drag, cantilever or free");
  recording.gravity = file.vector3("gravity", recording.gravity);
  check_gravity(file, recording.gravity);
  read_object(file, recording);
  read_markers(file, recording);
  read_table(file, recording);
  judge_gravity(file, recording);
  read_trajectories(file, recording);
  read_grasps(file, recording);
  read_supports(file, recording);
  read_camera(file, recording);
  read_crop(file, recording);
  read_keyframes(file, recording);
  read_nuisance(file, recording);
  check_times(recording);
  doubt_unused(recording);
  count_from_start(recording);
  if (!file.object("object").has("start") && !recording.markers.placed.empty())
    place_object_by_markers(recording);
  place_markers(recording);
  check_grasps(recording);
  check_supports(recording);
  return recording;
}

std::vector<int> select_vertices(const Recording& recording, const RecordedGrasp& grasp) {
  const Selection& select = grasp.select;
  Eigen::Vector3d at = Eigen::Vector3d::Zero();
  if (select.vertices.empty() && !select.corner && !select.box)
    at = pose_at(recording.trajectories.at(grasp.gripper), grasp.from) *
         select.position.value_or(Eigen::Vector3d::Zero());
  std::vector<int> selected = vertices_in(select, recording.mesh.vertices, recording.start, at);
  if (selected.empty() && select.box)
    throw input_error(recording.source, "grasps", "no vertex lies in select.box");
  if (selected.empty())
    throw input_error(recording.source, "grasps",
                      "no vertex lies within " + format_short(select.within) + " m of the place that " +
                          named_gripper(grasp) + " grasps");
  return selected;
}

std::vector<int> select_vertices(const Recording& recording, const Selection& select,
                                 const std::string& field) {
  std::vector<int> selected =
      vertices_in(select, recording.mesh.vertices, recording.start, Eigen::Vector3d::Zero());
  if (!selected.empty()) return selected;
  throw input_error(recording.source, field + ".select",
                    "no vertex of " + recording.mesh_spec + " lies there, expected one at least");
}

}  // namespace flash::data
