#include "sim/scene/scene.h"

#include <algorithm>
#include <filesystem>

#include "data/asset.h"
#include "data/error.h"
#include "data/mesh_io.h"
#include "data/text.h"

namespace flash::sim {
namespace {

/// The trajectories of a scene, each a frame of its schedule.
struct Timeline {
  std::vector<const data::Trajectory*> trajectories;

  /// The frame that follows a trajectory of the scene; the base frame where it is empty.
  int frame_of(const data::Trajectory& trajectory) {
    if (trajectory.times.empty()) return base_frame;
    const auto known = std::find(trajectories.begin(), trajectories.end(), &trajectory);
    const auto frame = known - trajectories.begin();
    if (known == trajectories.end()) trajectories.push_back(&trajectory);
    return static_cast<int>(frame);
  }
};

/// The Coulomb coefficients of all objects against what has that name.
std::vector<double> friction_against(const data::Scene& scene, const std::string& name) {
  std::vector<double> friction;
  for (const data::SceneObject& object : scene.objects)
    friction.push_back(data::friction_between(scene, object.name, name).value_or(-1.0));
  return friction;
}

Obstacle obstacle_of(const data::Scene& scene, const data::SceneObstacle& other, int frame) {
  Obstacle obstacle;
  obstacle.name = other.name;
  obstacle.frame = frame;
  obstacle.friction = friction_against(scene, other.name);
  if (const auto* plane = std::get_if<data::ScenePlane>(&other.shape))
    obstacle.shape = Plane{plane->point, plane->normal};
  else if (const auto* box = std::get_if<data::SceneBox>(&other.shape))
    obstacle.shape = Box{0.5 * box->size, frame == base_frame ? box->pose : Eigen::Isometry3d::Identity()};
  else if (const auto* cylinder = std::get_if<data::SceneCylinder>(&other.shape))
    obstacle.shape = Cylinder{cylinder->point, cylinder->axis, cylinder->radius};
  return obstacle;
}

void check_vertices(const data::Scene& scene, const data::SceneObject& object, const char* field,
                    const std::vector<int>& vertices, Eigen::Index count) {
  for (int vertex : vertices)
    if (vertex < 0 || vertex >= count)
      throw data::input_error(
          scene.source, "objects." + object.name + "." + field,
          "vertex " + std::to_string(vertex) + ", expected 0 to " + std::to_string(count - 1));
}

data::Points start_positions(const data::Scene& scene, const data::SceneObject& object,
                             const data::Points& rest) {
  if (object.start_mesh.empty())
    return (rest * object.base_from_object.linear().transpose()).rowwise() +
           object.base_from_object.translation().transpose();
  const data::Points start = data::load_point_cloud(object.start_mesh);
  if (start.rows() != rest.rows())
    throw data::input_error(scene.source, "objects." + object.name + ".start",
                            object.start_mesh + " has " + std::to_string(start.rows()) +
                                " vertices, the mesh " + std::to_string(rest.rows()));
  return start;
}

std::vector<int> vertices_of(const Body& body, std::vector<int> vertices) {
  for (int& vertex : vertices) vertex += body.first_vertex;
  return vertices;
}

Hold support_of(const data::SceneFixed& fixed, const Body& body, const data::Points& start) {
  Hold hold{.name = fixed.name, .vertices = vertices_of(body, fixed.vertices), .axes = fixed.axes};
  if (fixed.all)
    for (int i = 0; i < body.vertex_count; ++i) hold.vertices.push_back(body.first_vertex + i);
  hold.targets =
      fixed.positions.rows() > 0 ? fixed.positions : data::Points(start(hold.vertices, Eigen::all));
  if (fixed.over > 0) {
    hold.from = 0;
    hold.closing_time = fixed.over;
    hold.closing = Closing::even;
  }
  return hold;
}

void add_supports(const data::Scene& scene, const data::SceneObject& object, const Body& body,
                  Timeline& timeline, Environment& environment) {
  for (const data::SceneFixed& fixed : object.fixed) {
    check_vertices(scene, object, "fixed", fixed.vertices, body.vertex_count);
    environment.holds.push_back(support_of(fixed, body, environment.state.positions));
  }
  for (const data::SceneLoad& load : object.loads) {
    check_vertices(scene, object, "loads", load.vertices, body.vertex_count);
    for (int vertex : load.vertices) environment.loads.push_back({body.first_vertex + vertex, load.force});
  }
  for (const data::ScenePrescribed& prescribed : object.prescribed) {
    check_vertices(scene, object, "prescribed", prescribed.vertices, body.vertex_count);
    environment.holds.push_back({.name = prescribed.name,
                                 .vertices = vertices_of(body, prescribed.vertices),
                                 .frame = timeline.frame_of(prescribed.trajectory),
                                 .from = prescribed.from,
                                 .to = prescribed.to});
  }
}

void add_grasps(const data::Scene& scene, const Body& body, Timeline& timeline, Environment& environment) {
  for (const data::SceneEndEffector& effector : scene.end_effectors)
    for (const data::SceneGrasp& grasp : effector.grasps)
      if (grasp.object == body.name)
        environment.holds.push_back({.name = effector.name,
                                     .frame = timeline.frame_of(effector.trajectory),
                                     .at_origin = grasp.zero_length,
                                     .from = grasp.from,
                                     .to = grasp.to,
                                     .closing_time = grasp.zero_length ? grasp.closing_time : 0.0,
                                     .reach = Reach{.object = body.name,
                                                    .first_vertex = body.first_vertex,
                                                    .vertex_count = body.vertex_count,
                                                    .half_extents = 0.5 * effector.size,
                                                    .threshold = grasp.threshold}});
}

void add_obstacles(const data::Scene& scene, Timeline& timeline, Environment& environment) {
  for (const data::SceneObstacle& other : scene.obstacles) {
    const auto* box = std::get_if<data::SceneBox>(&other.shape);
    const int frame = box == nullptr ? base_frame : timeline.frame_of(box->trajectory);
    environment.obstacles.push_back(obstacle_of(scene, other, frame));
  }
  for (const data::SceneEndEffector& effector : scene.end_effectors) {
    if (!effector.collides) continue;
    const data::SceneObstacle box{effector.name, data::SceneBox{effector.size, {}, effector.trajectory},
                                  effector.friction};
    environment.obstacles.push_back(obstacle_of(scene, box, timeline.frame_of(effector.trajectory)));
  }
}

/// The mesh of an object, and its material at the end of `materials`.
Sheet load_body(const data::Scene& scene, const data::SceneObject& object,
                std::vector<data::SheetMaterial>& materials, std::vector<std::string>& notices) {
  const data::Asset asset = data::load_asset(object.asset);
  if (asset.element_type != data::ElementType::triangle)
    throw data::input_error(asset.source, "element_type",
                            "TETRAHEDRON, but only sheets (TRIANGLE) can be simulated");
  Sheet sheet = make_sheet(data::load_asset_mesh(asset), object.name);
  const data::ResolvedSheet resolved = data::resolve_sheet(asset, sheet.vertex_area.sum());
  for (const std::string& notice : resolved.notices) notices.push_back(object.name + ": " + notice);
  if (resolved.uniform_vertex_mass) sheet.vertex_area.setConstant(sheet.vertex_area.mean());
  materials.push_back(resolved.material);
  if (scene.bending_model) materials.back().bending_model = *scene.bending_model;
  return sheet;
}

State start_state(const data::Scene& scene, const Sheet& sheet) {
  State state;
  state.positions.resize(sheet.rest.vertices.rows(), 3);
  state.velocities.resize(sheet.rest.vertices.rows(), 3);
  for (std::size_t b = 0; b < sheet.bodies.size(); ++b) {
    const Body& body = sheet.bodies[b];
    const data::SceneObject& object = scene.objects[b];
    rows_of(body, state.positions) = start_positions(scene, object, rows_of(body, sheet.rest.vertices));
    rows_of(body, state.velocities) = object.start_velocity.transpose().replicate(body.vertex_count, 1);
  }
  return state;
}

}  // namespace

SimulatedScene simulated_scene(const data::Scene& scene, int steps, std::vector<std::string>& notices) {
  SimulatedScene world;
  Environment& environment = world.environment;
  environment.materials.clear();
  std::vector<Sheet> sheets;
  for (const data::SceneObject& object : scene.objects)
    sheets.push_back(load_body(scene, object, environment.materials, notices));
  world.sheet = joined(sheets);
  environment.gravity = scene.gravity;
  environment.state = start_state(scene, world.sheet);

  Timeline timeline;
  add_obstacles(scene, timeline, environment);
  for (std::size_t b = 0; b < scene.objects.size(); ++b) {
    const Body& body = world.sheet.bodies[b];
    const std::size_t first = environment.holds.size();
    add_supports(scene, scene.objects[b], body, timeline, environment);
    add_grasps(scene, body, timeline, environment);
    for (std::size_t k = first; k < environment.holds.size(); ++k)
      if (environment.holds[k].axes != std::array<bool, 3>{true, true, true} &&
          !environment.obstacles.empty())
        notices.push_back(body.name + ": " + environment.holds[k].name +
                          " holds its vertices in some axes alone: they meet no obstacle in the others");
  }
  std::vector<data::Trajectory> trajectories;
  for (const data::Trajectory* trajectory : timeline.trajectories) trajectories.push_back(*trajectory);
  environment.schedule = make_schedule(trajectories, 0.0, scene.time_step, steps);

  if (scene.objects.size() > 1) notices.push_back("the objects of this scene do not touch each other");
  if (scene.solver.integrator == "newton" && scene.solver.constraint_solver.starts_with("Lite"))
    notices.push_back(
        "contacts are met exactly by the newton integrator; solver.type projective has the inertia metric");
  if (data::asks_for_cuda(scene.solver)) notices.push_back("no CUDA backend here: running on the CPU");
  return world;
}

}  // namespace flash::sim
