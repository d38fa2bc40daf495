#include "sim/scene/scene.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <utility>

#include "data/asset.h"
#include "data/error.h"
#include "data/mesh_io.h"
#include "data/text.h"

namespace flash::sim {
namespace {

using Eigen::Vector3d;

Obstacle obstacle_of(const data::Scene& scene, const std::string& object, const data::SceneObstacle& other) {
  Obstacle obstacle;
  obstacle.friction = data::friction_between(scene, object, other.name).value_or(-1.0);
  if (const auto* plane = std::get_if<data::ScenePlane>(&other.shape))
    obstacle.shape = Plane{plane->point, plane->normal};
  else if (const auto* box = std::get_if<data::SceneBox>(&other.shape))
    obstacle.shape = Box{0.5 * box->size, box->pose, box->trajectory};
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

void add_supports(const data::Scene& scene, const data::SceneObject& object, SceneBody& body) {
  Environment& environment = body.environment;
  const data::Points& start = environment.state.positions;
  for (const data::SceneFixed& fixed : object.fixed) {
    check_vertices(scene, object, "fixed", fixed.vertices, start.rows());
    std::vector<int> vertices = fixed.vertices;
    if (fixed.all)
      for (int i = 0; i < int(start.rows()); ++i) vertices.push_back(i);
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      const bool given = fixed.positions.rows() > 0;
      const Vector3d from = start.row(vertices[i]);
      const Vector3d to = given ? Vector3d(fixed.positions.row(Eigen::Index(i))) : from;
      if (fixed.over > 0) body.moving.push_back({int(environment.fixed.size()), from, to, fixed.over});
      environment.fixed.push_back({vertices[i], fixed.axes, to});
      for (std::size_t axis = 0; axis < 3; ++axis)
        if (fixed.axes[axis]) body.support_names[vertices[i]][axis] = fixed.name;
    }
  }
  for (const data::SceneLoad& load : object.loads) {
    check_vertices(scene, object, "loads", load.vertices, start.rows());
    for (int vertex : load.vertices) environment.loads.push_back({vertex, load.force});
  }
  for (const data::ScenePrescribed& prescribed : object.prescribed) {
    check_vertices(scene, object, "prescribed", prescribed.vertices, start.rows());
    Grasp grasp;
    grasp.vertices = prescribed.vertices;
    grasp.gripper = prescribed.trajectory;
    grasp.from = prescribed.from;
    grasp.to = prescribed.to;
    environment.grasps.push_back(grasp);
    body.grasp_names.push_back(prescribed.name);
  }
}

void add_end_effectors(const data::Scene& scene, const std::string& object, SceneBody& body) {
  for (const data::SceneEndEffector& effector : scene.end_effectors) {
    if (effector.collides) {
      const Eigen::Isometry3d pose = data::pose_at(effector.trajectory, 0.0);
      const data::SceneObstacle box{effector.name, data::SceneBox{effector.size, pose, effector.trajectory},
                                    effector.friction};
      body.environment.obstacles.push_back(obstacle_of(scene, object, box));
      body.obstacle_names.push_back(effector.name);
    }
    for (const data::SceneGrasp& wanted : effector.grasps) {
      if (wanted.object != object) continue;
      Grasp grasp;
      grasp.gripper = effector.trajectory;
      grasp.from = wanted.from;
      grasp.to = wanted.to;
      grasp.closing_time = wanted.zero_length ? wanted.closing_time : 0.0;
      body.pending.push_back({int(body.environment.grasps.size()), wanted.from, wanted.threshold,
                              0.5 * effector.size, wanted.zero_length});
      body.environment.grasps.push_back(grasp);
      body.grasp_names.push_back(effector.name);
    }
  }
}

double total_area(const Sheet& sheet) { return sheet.vertex_area.sum(); }

SceneBody make_body(const data::Scene& scene, const data::SceneObject& object,
                    std::vector<std::string>& notices) {
  const data::Asset asset = data::load_asset(object.asset);
  if (asset.element_type != data::ElementType::triangle)
    throw data::input_error(asset.source, "element_type",
                            "TETRAHEDRON, but only sheets (TRIANGLE) can be simulated");
  SceneBody body;
  body.name = object.name;
  body.sheet = make_sheet(data::load_asset_mesh(asset));
  const data::ResolvedSheet resolved = data::resolve_sheet(asset, total_area(body.sheet));
  for (const std::string& notice : resolved.notices) notices.push_back(object.name + ": " + notice);
  if (resolved.uniform_vertex_mass) body.sheet.vertex_area.setConstant(body.sheet.vertex_area.mean());

  Environment& environment = body.environment;
  environment.material = resolved.material;
  if (scene.bending_model) environment.material.bending_model = *scene.bending_model;
  environment.gravity = scene.gravity;
  environment.state.positions = start_positions(scene, object, body.sheet.rest.vertices);
  environment.state.velocities =
      object.start_velocity.transpose().replicate(environment.state.positions.rows(), 1);
  for (const data::SceneObstacle& other : scene.obstacles) {
    environment.obstacles.push_back(obstacle_of(scene, object.name, other));
    body.obstacle_names.push_back(other.name);
  }
  add_supports(scene, object, body);
  add_end_effectors(scene, object.name, body);
  return body;
}

double distance_to_box(const Vector3d& half_extents, const Vector3d& point) {
  return (point.cwiseAbs() - half_extents).cwiseMax(0.0).norm();
}

}  // namespace

std::vector<SceneBody> scene_bodies(const data::Scene& scene, std::vector<std::string>& notices) {
  std::vector<SceneBody> bodies;
  for (const data::SceneObject& object : scene.objects) bodies.push_back(make_body(scene, object, notices));
  if (bodies.size() > 1) notices.push_back("the objects of this scene do not touch each other");
  if (scene.solver.integrator == "newton" && scene.solver.constraint_solver.starts_with("Lite"))
    notices.push_back(
        "contacts are met exactly by the newton integrator; solver.type projective has the inertia metric");
  if (data::asks_for_cuda(scene.solver)) notices.push_back("no CUDA backend here: running on the CPU");
  return bodies;
}

constexpr double time_rounding = 1e-9;  ///< of a time that is a sum of steps [s]

void close_pending_grasps(SceneBody& body) {
  const State& state = body.environment.state;
  for (const SceneBody::PendingGrasp& pending : body.pending) {
    if (state.time < pending.from - time_rounding) continue;
    Grasp& grasp = body.environment.grasps[pending.grasp];
    const Eigen::Isometry3d base_to_effector = data::pose_at(grasp.gripper, state.time).inverse();
    double nearest = std::numeric_limits<double>::infinity();
    for (int i = 0; i < int(state.positions.rows()); ++i) {
      const double distance =
          distance_to_box(pending.half_extents, base_to_effector * Vector3d(state.positions.row(i)));
      nearest = std::min(nearest, distance);
      if (distance <= pending.threshold) grasp.vertices.push_back(i);
    }
    if (grasp.vertices.empty())
      throw data::input_error("end effector " + body.grasp_names[pending.grasp], "grasps",
                              "no vertex of " + body.name + " within " +
                                  data::format_short(pending.threshold) + " m of its box at " +
                                  data::format_short(state.time) + " s; the nearest is " +
                                  data::format_short(nearest) + " m away");
    if (pending.zero_length) grasp.targets = data::Points::Zero(Eigen::Index(grasp.vertices.size()), 3);
  }
  std::erase_if(body.pending,
                [&](const auto& pending) { return state.time >= pending.from - time_rounding; });
}

bool move_supports(SceneBody& body, double time) {
  bool arrived = true;
  for (const SceneBody::MovingSupport& support : body.moving) {
    const double share = std::min(1.0, time / support.over);
    body.environment.fixed[support.fixed].position = support.start + share * (support.end - support.start);
    arrived = arrived && share >= 1;
  }
  return arrived;
}

}  // namespace flash::sim
