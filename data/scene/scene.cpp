#include "data/scene/scene.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>
#include <utility>

#include "data/asset/asset.h"
#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/json_reader.h"
#include "data/files/text.h"
#include "data/recording/gravity.h"
#include "data/scene/scene_solver.h"

namespace flash::data {
namespace {

std::string existing_file(const JsonObject& object, const char* key) {
  const std::string path = resolve_path(object.string(key), object.source());
  if (!std::filesystem::exists(path))
    throw input_error(object.source(), object.name_of(key), "file " + path + " does not exist");
  return path;
}

constexpr double farthest = 1e5;  // from there on rounding is a tenth of a nanometre [m]
constexpr double fastest = 1e3;   // [m/s]
constexpr double most_friction = 1e3;
constexpr double most_mass = 1e6;   // that hangs or is attached [kg]
constexpr double most_force = 1e9;  // on a vertex: the heaviest mass under the strongest gravity [N]

/// A place or a size, within `farthest` along each axis.
Eigen::Vector3d near(const JsonObject& object, const char* key, const Eigen::Vector3d& place) {
  if (!(place.cwiseAbs().maxCoeff() <= farthest))
    throw object.error(key, "coordinates of at most " + format_short(farthest) + " m");
  return place;
}

Eigen::Isometry3d read_pose(const JsonObject& object, const char* key) {
  const Eigen::Matrix<double, 7, 1> pose = object.vector(key, 7);
  near(object, key, pose.head<3>());
  if (std::abs(pose.tail<4>().norm() - 1) > 1e-3)
    throw object.error(key, "[x, y, z, qx, qy, qz, qw] with a unit quaternion");
  return from_vector(pose);
}

std::optional<double> read_friction(const JsonObject& object) {
  if (!object.has("friction")) return std::nullopt;
  const double friction = object.not_negative("friction");
  if (friction > most_friction) throw object.error("friction", "at most " + format_short(most_friction));
  return friction;
}

/// A length above 0 and within `farthest`.
double read_length(const JsonObject& object, const char* key) {
  const double length = object.positive(key);
  if (length > farthest) throw object.error(key, "at most " + format_short(farthest) + " m");
  return length;
}

ScenePlane read_plane(const JsonObject& object) {
  return {near(object, "point", object.vector3("point", Eigen::Vector3d::Zero())),
          object.direction("normal", Eigen::Vector3d::UnitZ())};
}

/// One plane, a list of planes, or planes by name.
void read_plane_collisions(const JsonObject& file, Scene& scene) {
  const auto append = [&](const std::string& name, const JsonObject& object) {
    object.expect_fields({"point", "normal", "friction"});
    if (!object.has("normal")) throw object.error("normal", "a direction, out of the solid");
    scene.obstacles.push_back({name, read_plane(object), read_friction(object)});
  };
  if (!file.has("planecollisions")) return;
  if (file.raw("planecollisions").is_array()) {
    const std::vector<JsonObject> planes = file.objects("planecollisions");
    for (std::size_t i = 0; i < planes.size(); ++i) append("plane" + std::to_string(i), planes[i]);
    return;
  }
  const JsonObject object = file.object("planecollisions");
  if (object.has("point") || object.has("normal")) return append("plane", object);
  for (const auto& [name, plane] : file.members("planecollisions")) append(name, plane);
}

/// "trajectory": a file, or "keyframes": [{t, translation, rotation_xyzw}]; empty where there is neither.
Trajectory read_trajectory(const JsonObject& object) {
  if (object.has("trajectory") && object.has("keyframes"))
    throw object.error("keyframes", "either trajectory or keyframes");
  if (object.has("trajectory")) return load_trajectory(existing_file(object, "trajectory"));
  Trajectory trajectory;
  for (const JsonObject& keyframe : object.objects("keyframes")) {
    keyframe.expect_fields({"t", "translation", "rotation_xyzw"});
    const double time = keyframe.number("t");
    if (!trajectory.times.empty() && time <= trajectory.times.back())
      throw keyframe.error(
          "t", "a time after " + format_number(trajectory.times.back()) + " s, the keyframe before");
    Eigen::Matrix<double, 7, 1> pose;
    pose.head<3>() = near(keyframe, "translation", keyframe.vector3("translation", Eigen::Vector3d::Zero()));
    pose.tail<4>() = Eigen::Vector4d::UnitW();
    if (keyframe.has("rotation_xyzw")) pose.tail<4>() = Eigen::Vector4d(keyframe.vector("rotation_xyzw", 4));
    if (std::abs(pose.tail<4>().norm() - 1) > 1e-3)
      throw keyframe.error("rotation_xyzw", "a unit quaternion");
    trajectory.times.push_back(time);
    trajectory.poses.push_back(from_vector(pose));
  }
  return trajectory;
}

/// What moves stands in the frame of its trajectory, where `point` is the origin unless it says otherwise.
SceneCapsule read_capsule(const JsonObject& object, bool has_length) {
  SceneCapsule capsule;
  capsule.trajectory = read_trajectory(object);
  if (capsule.trajectory.times.empty() || object.has("point"))
    capsule.point = near(object, "point", object.vector("point", 3));
  capsule.radius = read_length(object, "radius");
  if (has_length) {
    capsule.axis = object.direction("axis", Eigen::Vector3d::UnitX());
    capsule.half_length = read_length(object, "half_length");
  }
  return capsule;
}

/// Where a box or a mesh is: at a pose, or along a trajectory.
void read_place(const JsonObject& object, auto& shape) {
  if (object.has("pose")) shape.pose = read_pose(object, "pose");
  shape.trajectory = read_trajectory(object);
  if (object.has("pose") && !shape.trajectory.times.empty())
    throw object.error("pose", "either pose or a trajectory or keyframes");
}

SceneMesh read_mesh(const JsonObject& object) {
  object.expect_fields({"shape", "file", "scale", "margin", "pose", "trajectory", "keyframes", "friction"});
  SceneMesh mesh;
  mesh.file = existing_file(object, "file");
  mesh.scale = object.positive("scale", mesh.scale);
  if (object.has("margin")) mesh.margin = object.not_negative("margin");
  read_place(object, mesh);
  return mesh;
}

void read_obstacles(const JsonObject& file, Scene& scene) {
  for (const auto& [name, object] : file.members("obstacles")) {
    SceneObstacle obstacle;
    obstacle.name = name;
    const std::string shape =
        object.choice("shape", "", {"plane", "box", "cylinder", "sphere", "capsule", "mesh"});
    if (shape == "plane") {
      object.expect_fields({"shape", "point", "normal", "friction"});
      obstacle.shape = read_plane(object);
    } else if (shape == "cylinder") {
      object.expect_fields({"shape", "point", "axis", "radius", "friction"});
      obstacle.shape =
          SceneCylinder{near(object, "point", object.vector("point", 3)),
                        object.direction("axis", Eigen::Vector3d::UnitX()), read_length(object, "radius")};
    } else if (shape == "sphere") {
      object.expect_fields({"shape", "point", "radius", "trajectory", "keyframes", "friction"});
      obstacle.shape = read_capsule(object, false);
    } else if (shape == "capsule") {
      object.expect_fields(
          {"shape", "point", "axis", "half_length", "radius", "trajectory", "keyframes", "friction"});
      obstacle.shape = read_capsule(object, true);
    } else if (shape == "mesh") {
      obstacle.shape = read_mesh(object);
    } else {
      object.expect_fields({"shape", "size", "pose", "trajectory", "keyframes", "friction"});
      SceneBox box;
      box.size = near(object, "size", object.vector("size", 3));
      if (!(box.size.array() > 0).all()) throw object.error("size", "three lengths above 0");
      read_place(object, box);
      obstacle.shape = box;
    }
    obstacle.friction = read_friction(object);
    scene.obstacles.push_back(obstacle);
  }
}

std::vector<int> read_vertices(const JsonObject& object) {
  std::vector<int> vertices = object.indices("vertices");
  if (vertices.empty()) throw object.error("vertices", "at least one index");
  std::vector<int> sorted = vertices;
  std::sort(sorted.begin(), sorted.end());
  const auto twice = std::adjacent_find(sorted.begin(), sorted.end());
  if (twice != sorted.end()) throw object.error("vertices", "each vertex once");
  return vertices;
}

std::string read_name(const JsonObject& object, const std::string& fallback) {
  const std::string name = object.string("name", fallback);
  if (name.empty()) throw object.error("name", "a name");
  return name;
}

SceneFixed read_fixed(const JsonObject& object) {
  object.expect_fields({"name", "vertices", "axes", "positions", "over", "slopes"});
  SceneFixed fixed;
  fixed.name = read_name(object, fixed.name);
  fixed.over = object.not_negative("over", fixed.over);
  fixed.all = object.raw("vertices") == "all";
  if (!fixed.all) fixed.vertices = read_vertices(object);
  const std::string axes = object.string("axes", "xyz");
  for (std::size_t axis = 0; axis < 3; ++axis) fixed.axes[axis] = axes.find("xyz"[axis]) != std::string::npos;
  if (axes.empty() || axes.find_first_not_of("xyz") != std::string::npos)
    throw object.error("axes", "letters of xyz, such as \"z\" for a roller");
  fixed.slopes = object.boolean("slopes", false);
  if (fixed.slopes && fixed.axes != std::array{true, true, true})
    throw object.error("slopes", "false, or axes xyz: what rolls keeps no slope");
  if (object.has("over") && !object.has("positions")) throw object.error("over", "positions to move to");
  if (!object.has("positions")) return fixed;
  const nlohmann::json& rows = object.raw("positions");
  if (fixed.all || !rows.is_array() || rows.size() != fixed.vertices.size())
    throw object.error("positions", "one [x, y, z] for each of vertices");
  fixed.positions.resize(static_cast<Eigen::Index>(rows.size()), 3);
  for (std::size_t i = 0; i < rows.size(); ++i)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (!rows[i].is_array() || rows[i].size() != 3 || !rows[i][axis].is_number())
        throw object.error("positions", "one [x, y, z] for each of vertices");
      const double at = rows[i][axis].get<double>();
      if (!(std::abs(at) <= farthest))
        throw input_error(object.source(), object.name_of("positions"),
                          "found " + format_number(at) + ", expected coordinates of at most " +
                              format_short(farthest) + " m");
      fixed.positions(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(axis)) = at;
    }
  return fixed;
}

ScenePrescribed read_prescribed(const JsonObject& object) {
  object.expect_fields({"name", "vertices", "trajectory", "keyframes", "from", "to", "slopes"});
  ScenePrescribed prescribed;
  prescribed.name = read_name(object, prescribed.name);
  prescribed.vertices = read_vertices(object);
  prescribed.trajectory = read_trajectory(object);
  if (prescribed.trajectory.times.empty()) throw object.error("trajectory", "a trajectory, or keyframes");
  prescribed.from = object.number("from", prescribed.from);
  prescribed.to = object.number("to", prescribed.to);
  if (!(prescribed.to > prescribed.from)) throw object.error("to", "a time after from, or null");
  prescribed.slopes = object.boolean("slopes", false);
  return prescribed;
}

SceneLoad read_load(const JsonObject& object, const Eigen::Vector3d& gravity) {
  object.expect_fields({"vertices", "force", "hung_mass", "attached_mass"});
  SceneLoad load;
  load.vertices = read_vertices(object);
  const auto share = [&](const char* key) {
    const double mass = object.positive(key);
    if (mass > most_mass) throw object.error(key, "at most " + format_short(most_mass) + " kg");
    return mass / static_cast<double>(load.vertices.size());
  };
  if (object.has("force") + object.has("hung_mass") + object.has("attached_mass") != 1)
    throw object.error("force",
                       "one of force [N] on each vertex, hung_mass and attached_mass [kg] shared by them");
  if (object.has("hung_mass")) load.force = share("hung_mass") * gravity;
  if (object.has("attached_mass")) load.attached_mass = share("attached_mass");
  if (!object.has("force")) return load;
  load.force = object.vector("force", 3);
  if (!(load.force.cwiseAbs().maxCoeff() <= most_force))
    throw object.error("force", "components of at most " + format_short(most_force) + " N");
  return load;
}

SceneObject read_object(const std::string& name, const JsonObject& object, const Eigen::Vector3d& gravity) {
  object.expect_fields({"asset", "start", "velocity", "fixed", "prescribed", "loads"});
  SceneObject result;
  result.name = name;
  result.asset = existing_file(object, "asset");
  result.start_velocity = object.vector3("velocity", result.start_velocity);
  if (!(result.start_velocity.norm() <= fastest))
    throw object.error("velocity", "at most " + format_short(fastest) + " m/s");
  if (object.raw("start").is_string()) {
    result.start_mesh = existing_file(object, "start");
  } else if (object.has("start")) {
    const JsonObject start = object.object("start");
    start.expect_fields({"T_base_object", "mesh"});
    if (start.has("T_base_object")) result.base_from_object = read_pose(start, "T_base_object");
    if (start.has("mesh")) result.start_mesh = existing_file(start, "mesh");
  }
  for (const JsonObject& fixed : object.objects("fixed")) result.fixed.push_back(read_fixed(fixed));
  for (const JsonObject& prescribed : object.objects("prescribed"))
    result.prescribed.push_back(read_prescribed(prescribed));
  for (const JsonObject& load : object.objects("loads")) result.loads.push_back(read_load(load, gravity));
  return result;
}

void read_objects(const JsonObject& file, Scene& scene) {
  const JsonObject objects = file.object("objects");
  for (const auto& [name, value] : objects.value().items()) {
    if (value.is_string()) {
      SceneObject object;
      object.name = name;
      object.asset = existing_file(objects, name.c_str());
      scene.objects.push_back(object);
    } else {
      scene.objects.push_back(read_object(name, objects.object(name.c_str()), scene.gravity));
    }
  }
  if (scene.objects.empty()) throw file.error("objects", "at least one object");
}

void read_end_effectors(const JsonObject& file, Scene& scene) {
  for (const auto& [name, object] : file.members("end_effectors")) {
    object.expect_fields({"size", "trajectory", "keyframes", "collides", "friction", "grasps"});
    SceneEndEffector effector;
    effector.name = name;
    effector.size = object.vector3("size", effector.size);
    if (!(effector.size.array() > 0).all()) throw object.error("size", "three lengths above 0");
    effector.trajectory = read_trajectory(object);
    if (effector.trajectory.times.empty()) throw object.error("trajectory", "a trajectory, or keyframes");
    effector.collides = object.boolean("collides", false);
    effector.friction = read_friction(object);
    for (const JsonObject& entry : object.objects("grasps")) {
      entry.expect_fields({"object", "from", "to", "threshold", "zero_length", "closing_time", "slopes"});
      SceneGrasp grasp;
      const auto is_object = [&](const SceneObject& candidate) { return candidate.name == grasp.object; };
      grasp.object =
          scene.objects.size() == 1 ? entry.string("object", scene.objects[0].name) : entry.string("object");
      if (std::none_of(scene.objects.begin(), scene.objects.end(), is_object))
        throw entry.error("object", "a name of objects");
      grasp.from = entry.number("from", grasp.from);
      grasp.to = entry.number("to", grasp.to);
      if (!(grasp.to > grasp.from)) throw entry.error("to", "a time after from, or null");
      grasp.threshold = entry.not_negative("threshold", grasp.threshold);
      grasp.zero_length = entry.boolean("zero_length", false);
      grasp.closing_time = entry.not_negative("closing_time", 0);
      grasp.slopes = entry.boolean("slopes", false);
      if (grasp.slopes && grasp.zero_length)
        throw entry.error("slopes", "false, or zero_length false: what is pulled into a point has no slope");
      effector.grasps.push_back(grasp);
    }
    scene.end_effectors.push_back(effector);
  }
}

void read_self_contact(const JsonObject& file, Scene& scene) {
  if (!file.has("self_contact")) return;
  const JsonObject object = file.object("self_contact");
  object.expect_fields({"thickness", "friction", "pressure"});
  SceneSelfContact& contact = scene.self_contact.emplace();
  const auto within = [&](const char* key, double& value, double low, double high) {
    if (!object.has(key)) return;
    value = object.number(key);
    if (!(value >= low && value <= high))
      throw object.error(key, "a number from " + format_short(low) + " to " + format_short(high));
  };
  within("thickness", contact.thickness, 1e-6, 1);
  within("friction", contact.friction, 0, most_friction);
  within("pressure", contact.pressure, 1e-3, 1e9);
  if (scene.solver.integrator != "newton")
    throw file.error("self_contact", "solver.type newton, which alone has it");
}

/// Bodies are known by their names: in pairs of friction, in messages and in tables of forces.
void check_names(const JsonObject& file, const Scene& scene) {
  std::set<std::string> names;
  const auto add = [&](const char* list, const std::string& name) {
    if (name.empty()) throw input_error(file.source(), list, "found the name \"\", expected a name for each");
    if (!names.insert(name).second)
      throw input_error(file.source(), std::string(list) + "." + name,
                        "found a name that another body has, expected names that differ");
  };
  for (const SceneObject& object : scene.objects) add("objects", object.name);
  for (const SceneObstacle& obstacle : scene.obstacles) add("obstacles", obstacle.name);
  for (const SceneEndEffector& effector : scene.end_effectors) add("end_effectors", effector.name);
}

void read_pair_friction(const JsonObject& file, Scene& scene) {
  std::vector<std::string> objects, others, names;
  for (const SceneObject& object : scene.objects) objects.push_back(object.name);
  for (const SceneObstacle& obstacle : scene.obstacles) others.push_back(obstacle.name);
  for (const SceneEndEffector& effector : scene.end_effectors)
    if (effector.collides) others.push_back(effector.name);
  names = objects;
  names.insert(names.end(), others.begin(), others.end());
  std::set<std::pair<std::string, std::string>> known;
  for (const JsonObject& entry : file.objects("friction")) {
    entry.expect_fields({"a", "b", "friction"});
    for (const char* key : {"a", "b"}) entry.choice(key, "", names);
    if (!entry.has("friction")) throw entry.error("friction", "a number of 0 or above");
    ScenePairFriction pair{entry.string("a"), entry.string("b"), *read_friction(entry)};
    const auto among = [](const std::vector<std::string>& list, const std::string& name) {
      return std::find(list.begin(), list.end(), name) != list.end();
    };
    if (!among(objects, pair.object)) std::swap(pair.object, pair.other);
    if (!among(objects, pair.object) || !among(others, pair.other))
      throw entry.error("b", "one object, and one obstacle or end effector that collides");
    if (!known.emplace(pair.object, pair.other).second) throw entry.error("b", "each pair once");
    scene.pair_friction.push_back(pair);
  }
}

}  // namespace

Scene load_scene(const std::string& path) {
  const nlohmann::json json = load_json(path);
  const JsonObject file(json, path);
  Scene scene;
  scene.source = path;
  if (file.has("schema")) {
    if (file.string("schema") != "flash-scene/1")
      throw file.error("schema", "\"flash-scene/1\", or no schema for the published format");
    file.expect_fields({"schema", "name", "note", "timestep", "steps", "duration", "gravity", "linearsolver",
                        "constraintsolver", "solver", "bending_model", "planecollisions", "obstacles",
                        "objects", "end_effectors", "friction", "keyframes", "quasistatic", "self_contact"});
  } else {
    file.expect_fields(
        {"timestep", "gravity", "linearsolver", "constraintsolver", "planecollisions", "objects"});
  }
  scene.name = file.string("name", std::filesystem::path(path).stem().string());
  scene.gravity = file.vector("gravity", 3);
  check_gravity(file, scene.gravity);
  read_steps(file, scene);
  read_solver(file, scene.solver);
  if (file.has("bending_model"))
    scene.bending_model = parse_bending_model(file.string("bending_model"), path, "bending_model");
  read_plane_collisions(file, scene);
  read_obstacles(file, scene);
  read_objects(file, scene);
  read_end_effectors(file, scene);
  check_names(file, scene);
  read_pair_friction(file, scene);
  read_self_contact(file, scene);
  if (file.has("quasistatic")) {
    const JsonObject object = file.object("quasistatic");
    object.expect_fields({"motion"});
    scene.rest_motion = object.positive("motion", 1e-9);
  }
  if (file.has("keyframes")) {
    const Eigen::VectorXd times = file.vector("keyframes", -1);
    scene.keyframe_times.assign(times.begin(), times.end());
    if (!std::is_sorted(times.begin(), times.end()) || (times.size() > 0 && times[0] < 0))
      throw file.error("keyframes", "times from 0 in increasing order");
  }
  return scene;
}

bool asks_for_cuda(const SceneSolver& solver) {
  return solver.linear_solver.ends_with("_CUDA") || solver.constraint_solver.ends_with("_CUDA");
}

std::optional<double> friction_between(const Scene& scene, const std::string& object,
                                       const std::string& other) {
  for (const ScenePairFriction& pair : scene.pair_friction)
    if (pair.object == object && pair.other == other) return pair.friction;
  for (const SceneObstacle& obstacle : scene.obstacles)
    if (obstacle.name == other) return obstacle.friction;
  for (const SceneEndEffector& effector : scene.end_effectors)
    if (effector.name == other) return effector.friction;
  return std::nullopt;
}

}  // namespace flash::data
