#include "sim/scene/scene.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>

#include "data/asset/asset.h"
#include "data/asset/asset_mesh.h"
#include "data/files/error.h"
#include "data/files/text.h"
#include "data/mesh/mesh_io.h"
#include "data/mesh/obstacle_mesh.h"
#include "sim/law/surface_mesh.h"
#include "sim/scene/joined_bodies.h"
#include "sim/scene/scene_slopes.h"
#include "sim/scene/solid.h"

namespace flash::sim {
namespace {

/// How far off its triangles an open mesh is met where the scene does not say [m].
constexpr double open_margin = 5e-4;

/// Beyond this a mesh is rather in millimetres [m].
constexpr double largest_mesh = 20;

/// The mesh of an obstacle, without its place.
Mesh mesh_of(const data::Scene& scene, const data::SceneObstacle& obstacle, const data::SceneMesh& described,
             std::vector<std::string>& notices) {
  const data::ObstacleMesh read = data::load_obstacle_mesh(described.file, described.scale);
  Mesh mesh;
  mesh.margin = described.margin.value_or(read.closed ? 0.0 : open_margin);
  if (!read.closed && mesh.margin == 0)
    throw data::input_error(scene.source, "obstacles." + obstacle.name + ".margin",
                            "found 0, expected a length above 0 [m], as " + described.file + " is open: " +
                                data::format_count(static_cast<std::size_t>(read.border_edges)) +
                                " of its edges have one triangle");
  mesh.surface = std::make_shared<const SurfaceMesh>(make_surface_mesh(read));
  const Eigen::Vector3d size =
      read.mesh.vertices.colwise().maxCoeff() - read.mesh.vertices.colwise().minCoeff();
  notices.push_back(
      obstacle.name + ": a" + (read.closed ? " closed" : "n open") + " surface of " +
      data::format_count(static_cast<std::size_t>(read.mesh.triangles.rows())) + " triangles, " +
      data::format_short(size.x()) + " x " + data::format_short(size.y()) + " x " +
      data::format_short(size.z()) + " m" +
      (mesh.margin > 0 ? ", met " + data::format_short(1e3 * mesh.margin) + " mm off its triangles" : "") +
      (read.closed ? "" : " on both sides") +
      (size.maxCoeff() > largest_mesh ? "; is it in millimetres? (\"scale\": 0.001)" : ""));
  return mesh;
}

/// What the bodies of a scene share: the trajectories, each a frame of its schedule, and the meshes of its
/// obstacles by name.
struct SceneParts {
  std::vector<const data::Trajectory*> trajectories;
  std::map<std::string, Mesh> meshes;

  /// The frame that follows a trajectory of the scene; the base frame where it is empty.
  int frame_of(const data::Trajectory& trajectory) {
    if (trajectory.times.empty()) return base_frame;
    const auto known = std::find(trajectories.begin(), trajectories.end(), &trajectory);
    const auto frame = known - trajectories.begin();
    if (known == trajectories.end()) trajectories.push_back(&trajectory);
    return static_cast<int>(frame);
  }
};

Obstacle obstacle_of(const data::Scene& scene, const std::string& object, const data::SceneObstacle& other,
                     const SceneParts& shared, int frame) {
  Obstacle obstacle;
  obstacle.name = other.name;
  obstacle.frame = frame;
  if (const auto friction = data::friction_between(scene, object, other.name))
    obstacle.friction = {*friction};
  if (const auto* plane = std::get_if<data::ScenePlane>(&other.shape))
    obstacle.shape = Plane{plane->point, plane->normal};
  else if (const auto* box = std::get_if<data::SceneBox>(&other.shape))
    obstacle.shape = Box{0.5 * box->size, frame == base_frame ? box->pose : Eigen::Isometry3d::Identity()};
  else if (const auto* cylinder = std::get_if<data::SceneCylinder>(&other.shape))
    obstacle.shape = Cylinder{cylinder->point, cylinder->axis, cylinder->radius};
  else if (const auto* capsule = std::get_if<data::SceneCapsule>(&other.shape))
    obstacle.shape = Capsule{capsule->point, capsule->axis, capsule->half_length, capsule->radius};
  else if (const auto* described = std::get_if<data::SceneMesh>(&other.shape)) {
    Mesh mesh = shared.meshes.at(other.name);
    if (frame == base_frame) mesh.pose = described->pose;
    obstacle.shape = mesh;
  }
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

Hold support_of(const data::SceneFixed& fixed, const Sheet& sheet, const data::Points& start) {
  std::vector<int> vertices = fixed.vertices;
  if (fixed.all)
    for (int i = 0; i < int(mesh_vertices(sheet)); ++i) vertices.push_back(i);
  Hold hold{.name = fixed.name, .vertices = with_midsides(sheet, vertices), .axes = fixed.axes};
  data::Points places = start;
  if (fixed.positions.rows() > 0) {
    places(vertices, Eigen::all) = fixed.positions;
    places = with_midsides(sheet, places.topRows(mesh_vertices(sheet)));
  }
  hold.targets = places(hold.vertices, Eigen::all);
  if (fixed.over > 0) {
    hold.from = 0;
    hold.closing_time = fixed.over;
    hold.closing = Closing::even;
  }
  return hold;
}

void add_supports(const data::Scene& scene, const data::SceneObject& object, const Sheet& sheet,
                  SceneParts& parts, Environment& environment, std::vector<SlopeWish>& wishes) {
  const data::Points& start = environment.state.positions;
  const Eigen::Index count = mesh_vertices(sheet);
  for (const data::SceneFixed& fixed : object.fixed) {
    check_vertices(scene, object, "fixed", fixed.vertices, count);
    environment.holds.push_back(support_of(fixed, sheet, start));
    wishes.push_back({"objects." + object.name + ".fixed", fixed.slopes});
  }
  for (const data::SceneLoad& load : object.loads) {
    check_vertices(scene, object, "loads", load.vertices, count);
    for (int vertex : load.vertices)
      if (load.attached_mass > 0)
        environment.point_masses.push_back({vertex, load.attached_mass});
      else
        environment.loads.push_back({vertex, load.force});
  }
  for (const data::ScenePrescribed& prescribed : object.prescribed) {
    check_vertices(scene, object, "prescribed", prescribed.vertices, count);
    environment.holds.push_back({.name = prescribed.name,
                                 .vertices = with_midsides(sheet, prescribed.vertices),
                                 .frame = parts.frame_of(prescribed.trajectory),
                                 .from = prescribed.from,
                                 .to = prescribed.to});
    wishes.push_back({"objects." + object.name + ".prescribed", prescribed.slopes});
  }
}

void add_end_effectors(const data::Scene& scene, const std::string& object, SceneParts& parts,
                       Environment& environment, std::vector<SlopeWish>& wishes) {
  for (const data::SceneEndEffector& effector : scene.end_effectors) {
    const int frame = parts.frame_of(effector.trajectory);
    if (effector.collides) {
      const data::SceneObstacle box{effector.name, data::SceneBox{effector.size, {}, effector.trajectory},
                                    effector.friction};
      environment.obstacles.push_back(obstacle_of(scene, object, box, parts, frame));
    }
    for (const data::SceneGrasp& grasp : effector.grasps) {
      if (grasp.object != object) continue;
      environment.holds.push_back(
          {.name = effector.name,
           .frame = frame,
           .at_origin = grasp.zero_length,
           .from = grasp.from,
           .to = grasp.to,
           .closing_time = grasp.zero_length ? grasp.closing_time : 0.0,
           .reach =
               Reach{.object = object, .half_extents = 0.5 * effector.size, .threshold = grasp.threshold}});
      wishes.push_back({"end_effectors." + effector.name + ".grasps", grasp.slopes});
    }
  }
}

double total_area(const Sheet& sheet) { return sheet.vertex_area.sum(); }

/// Mesh and material of an object of triangles.
void make_sheet_body(const data::Scene& scene, data::Asset asset, SceneBody& body,
                     std::vector<std::string>& notices) {
  if (scene.bending_model) asset.bending_model = scene.bending_model;
  body.sheet =
      make_sheet(data::load_asset_mesh(asset), {}, data::rotation_from_degrees(asset.rotation_degrees));
  if (const auto overlap = first_overlap(body.sheet.rest))
    notices.push_back(body.name + ": " + asset.mesh + ": triangles " + std::to_string(overlap->first) +
                      " and " + std::to_string(overlap->second) +
                      " cover each other at rest, though the mesh is flat: is a vertex in the wrong place?");
  const data::ResolvedSheet resolved = data::resolve_sheet(asset, total_area(body.sheet));
  for (const std::string& notice : resolved.notices) notices.push_back(body.name + ": " + notice);
  if (resolved.uniform_vertex_mass) body.sheet.vertex_area.setConstant(body.sheet.vertex_area.mean());
  body.environment.materials[0] = resolved.material;
  if (!scene.bending_model) return;
  const data::SheetMaterial& material = body.environment.materials[0];
  if (material.bending_model != data::BendingModel::plate && material.weave.is_of_bending())
    throw data::input_error(scene.source, "bending_model",
                            std::string("found ") + data::to_string(material.bending_model) +
                                ", expected plate, as " + asset.source + " is woven");
  if (material.bending_model != data::BendingModel::hinge && asset.yield_curvature)
    throw data::input_error(scene.source, "bending_model",
                            std::string("found ") + data::to_string(material.bending_model) +
                                ", expected hinge, as the bending of " + asset.source + " yields");
}

/// Mesh and material of an object of tetrahedra.
void make_solid_body(const data::Asset& asset, SceneBody& body, std::vector<std::string>& notices) {
  body.sheet = make_solid(data::load_asset_tet_mesh(asset), {}, asset.element_order);
  Eigen::VectorXd& volume = body.sheet.vertex_volume;
  const data::ResolvedSolid resolved = data::resolve_solid(asset, volume.sum());
  for (const std::string& notice : resolved.notices) notices.push_back(body.name + ": " + notice);
  if (resolved.uniform_vertex_mass) volume.setConstant(volume.mean());
  body.environment.solids[0] = resolved.material;
}

SceneBody make_body(const data::Scene& scene, const data::SceneObject& object, SceneParts& parts,
                    std::vector<SlopeWish>& wishes, std::vector<std::string>& notices) {
  const data::Asset asset = data::load_asset(object.asset);
  SceneBody body;
  body.name = object.name;
  if (asset.element_type == data::ElementType::tetrahedron)
    make_solid_body(asset, body, notices);
  else
    make_sheet_body(scene, asset, body, notices);

  Environment& environment = body.environment;
  environment.gravity = scene.gravity;
  environment.state.positions = with_midsides(
      body.sheet,
      start_positions(scene, object, body.sheet.rest.vertices.topRows(mesh_vertices(body.sheet))));
  if (const int inverted = first_inverted(body.sheet, environment.state.positions); inverted >= 0)
    throw data::input_error(scene.source, "objects." + object.name + ".start",
                            "turns tetrahedron " + std::to_string(inverted) + " of " + asset.mesh +
                                " inside out or flat, expected a positive volume");
  environment.state.velocities =
      object.start_velocity.transpose().replicate(environment.state.positions.rows(), 1);
  for (const data::SceneObstacle& other : scene.obstacles) {
    const data::Trajectory* path = nullptr;
    if (const auto* box = std::get_if<data::SceneBox>(&other.shape)) path = &box->trajectory;
    if (const auto* capsule = std::get_if<data::SceneCapsule>(&other.shape)) path = &capsule->trajectory;
    if (const auto* mesh = std::get_if<data::SceneMesh>(&other.shape)) path = &mesh->trajectory;
    const int frame = path == nullptr ? base_frame : parts.frame_of(*path);
    environment.obstacles.push_back(obstacle_of(scene, object.name, other, parts, frame));
  }
  add_supports(scene, object, body.sheet, parts, environment, wishes);
  add_end_effectors(scene, object.name, parts, environment, wishes);
  for (const Hold& hold : environment.holds)
    if (hold.axes != std::array<bool, 3>{true, true, true} && !environment.obstacles.empty())
      notices.push_back(object.name + ": " + hold.name +
                        " holds its vertices in some axes alone: they meet no obstacle in the others");
  return body;
}

}  // namespace

std::vector<SceneBody> scene_bodies(const data::Scene& scene, int steps, std::vector<std::string>& notices) {
  std::vector<SceneBody> bodies;
  SceneParts parts;
  for (const data::SceneObstacle& obstacle : scene.obstacles)
    if (const auto* described = std::get_if<data::SceneMesh>(&obstacle.shape))
      parts.meshes.emplace(obstacle.name, mesh_of(scene, obstacle, *described, notices));
  std::vector<std::vector<SlopeWish>> wishes;  // of each body
  for (const data::SceneObject& object : scene.objects)
    bodies.push_back(make_body(scene, object, parts, wishes.emplace_back(), notices));
  std::vector<data::Trajectory> trajectories;
  for (const data::Trajectory* trajectory : parts.trajectories) trajectories.push_back(*trajectory);
  const auto schedule = make_schedule(trajectories, 0.0, scene.time_step, steps);
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    bodies[b].environment.schedule = schedule;
    keep_scene_slopes(scene, steps, wishes[b], bodies[b], notices);
  }
  if (scene.self_contact) {
    const data::SceneSelfContact& contact = *scene.self_contact;
    bodies = {joined(bodies)};
    bodies.front().environment.self_contact =
        SelfContact{contact.thickness, contact.friction, contact.pressure};
  }
  if (bodies.size() > 1) notices.push_back("the objects of this scene do not touch each other");
  if (scene.solver.integrator == "newton" && scene.solver.constraint_solver.starts_with("Lite"))
    notices.push_back(
        "contacts are met exactly by the newton integrator; solver.type projective has the inertia metric");
  if (data::asks_for_cuda(scene.solver))
    notices.push_back("the solver asks for CUDA: scenes run on the CPU alone so far");
  return bodies;
}

}  // namespace flash::sim
