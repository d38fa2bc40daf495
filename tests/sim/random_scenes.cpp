#include "tests/sim/random_scenes.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "data/procedural_mesh.h"
#include "sim/scene/solid.h"
#include "tests/sim/brute_surface.h"
#include "tests/sim/lot.h"
#include "tests/sim/obstacle_depth.h"
#include "tests/sim/sheet_scene.h"
#include "tests/sim/surface_shapes.h"

namespace flash::sim {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

std::string draw_mesh(Lot& lot, double& side) {
  static constexpr const char* patterns[] = {"one_way", "alternating", "alternating_by_row", "jittered"};
  side = lot.uniform(0.1, 0.4);
  const double other = side * lot.uniform(0.4, 1);
  const double cell = std::sqrt(side * other / lot.uniform(12, 110));
  char text[100];
  std::snprintf(text, sizeof text, "sheet:%.4fx%.4f:%.5f:%s", side, other, cell, patterns[lot.below(4)]);
  return text;
}

data::SheetMaterial draw_material(Lot& lot) {
  using data::BendingModel;
  using data::Constitutive;
  static constexpr Constitutive laws[] = {Constitutive::tri_arap, Constitutive::tri_corotated,
                                          Constitutive::tri_stvk, Constitutive::tri_neohookean};
  static constexpr BendingModel models[] = {BendingModel::plate, BendingModel::isometric,
                                            BendingModel::hinge};
  data::SheetMaterial material;
  material.constitutive = laws[lot.below(4)];
  material.bending_model = models[lot.below(3)];
  material.membrane_stiffness = lot.log_uniform(1, 1e6);
  material.poissons_ratio = lot.uniform(0, 0.45);
  material.areal_density = lot.log_uniform(0.05, 1);
  // No stiffer than a solid plate of a centimetre.
  material.bending_rigidity = std::min(lot.log_uniform(1e-7, 1e-2), material.membrane_stiffness * 1e-4 / 12);
  material.friction = lot.chance(0.2) ? 0 : lot.uniform(0, 1.2);
  if (lot.chance(0.2)) material.air_drag = lot.uniform(0, 5);
  if (lot.chance(0.1)) material.stiffness_damping = lot.log_uniform(1e-4, 1e-2);
  return material;
}

/// A block of tetrahedra, linear or quadratic, in place of a sheet.
void draw_solid(Lot& lot, double& side, RandomScene& scene) {
  using data::Constitutive;
  static constexpr Constitutive laws[] = {Constitutive::tet_arap, Constitutive::tet_corotated,
                                          Constitutive::tet_neohookean};
  side = lot.uniform(0.05, 0.2);
  const double width = side * lot.uniform(0.3, 1), height = side * lot.uniform(0.2, 1);
  const double cell = std::cbrt(side * width * height / lot.uniform(2, 30));
  const auto cells = [&](double length) { return std::max(1, static_cast<int>(std::lround(length / cell))); };
  const bool quadratic = lot.chance(0.3);
  scene.sheet = make_solid(data::tet_box({side, width, height}, {cells(side), cells(width), cells(height)}),
                           {}, quadratic ? data::ElementOrder::quadratic : data::ElementOrder::linear);
  char text[100];
  std::snprintf(text, sizeof text, "box:%.4fx%.4fx%.4f:%.5f%s", side, width, height, cell,
                quadratic ? ", quadratic" : "");
  scene.mesh = text;
  data::SolidMaterial& material = scene.environment.solids[0];
  material.constitutive = laws[lot.below(3)];
  material.youngs_modulus = lot.log_uniform(1e3, 1e8);
  material.poissons_ratio = lot.uniform(0, 0.49);
  material.density = lot.log_uniform(50, 3000);
  material.friction = lot.chance(0.2) ? 0 : lot.uniform(0, 1.2);
  if (lot.chance(0.2)) material.air_drag = lot.uniform(0, 5);
  if (lot.chance(0.1)) material.stiffness_damping = lot.log_uniform(1e-4, 1e-2);
}

/// A path in straight stretches, each at a speed of its own.
data::Trajectory draw_path(Lot& lot, const Vector3d& start, double seconds, double fastest, bool level) {
  data::Trajectory path;
  Vector3d at = start;
  double time = 0;
  while (true) {
    path.times.push_back(time);
    path.poses.push_back(Isometry3d(Eigen::Translation3d(at)));
    if (time > seconds) return path;
    Vector3d along = lot.direction();
    along.z() = level ? 0 : std::abs(along.z());
    const double stretch = lot.uniform(0.03, 0.3) * seconds + 1e-3;
    at += lot.uniform(0, fastest) * stretch * along;
    time += stretch;
  }
}

void move(Environment& environment, const Isometry3d& pose) {
  environment.state.positions =
      (environment.state.positions * pose.linear().transpose()).rowwise() + pose.translation().transpose();
}

double lowest(const Environment& environment) { return environment.state.positions.col(2).minCoeff(); }

/// The vertices within `reach` of a corner of the sheet, held from the start.
Hold grasp_corner(Environment& environment, int corner, double reach, const data::Trajectory& gripper,
                  double time_step) {
  std::vector<int> vertices;
  const auto row = environment.state.positions.row(corner);
  for (int i = 0; i < environment.state.positions.rows(); ++i)
    if ((environment.state.positions.row(i) - row).norm() <= reach) vertices.push_back(i);
  return gripped(environment, vertices, gripper, time_step);
}

Obstacle draw_support(Lot& lot, double side) {
  if (lot.chance(0.5))
    return {Cylinder{{0.5 * side, 0.25 * side, 0.1},
                     Vector3d(lot.uniform(-1, 1), 1, 0).normalized(),
                     lot.uniform(0.01, 0.08)}};
  Box box{.half_extents = {lot.uniform(0.02, 0.1), lot.uniform(0.02, 0.1), lot.uniform(0.005, 0.05)}};
  box.pose = Eigen::Translation3d(0.5 * side, 0.25 * side, 0.1) *
             Eigen::AngleAxisd(lot.uniform(0, 3), Vector3d::UnitZ());
  return {box};
}

Isometry3d tumbled(Lot& lot) {
  const Vector3d axis = lot.direction();
  return Isometry3d(Eigen::AngleAxisd(lot.uniform(0, 3), axis));
}

/// Puts the sheet `height` above the point `above`.
void raise_above(Environment& environment, double top, double height) {
  environment.state.positions.col(2).array() += top + height - lowest(environment);
}

void draw_scene(Lot& lot, double side, RandomScene& scene) {
  Environment& environment = scene.environment;
  const double h = scene.settings.time_step, seconds = scene.steps * h;
  const Obstacle table{Plane{}};
  const auto throw_at = [&](double fastest) {
    const double y = lot.uniform(-0.3, 0.3), x = lot.uniform(-0.3, 0.3);
    environment.state.velocities.rowwise() += lot.uniform(0, fastest) * Vector3d(x, y, -1).transpose();
  };
  const int corner = 0;
  switch (scene.kind) {
    case SceneKind::drop:
      move(environment, tumbled(lot));
      raise_above(environment, 0, lot.uniform(0, 0.05));
      throw_at(3);
      environment.obstacles = {table};
      return;
    case SceneKind::impact: {
      const double thick = lot.log_uniform(0.001, 0.03);
      Box board{.half_extents = {0.3, 0.3, 0.5 * thick}};
      board.pose = Eigen::Translation3d(0.5 * side, 0.3 * side, 0) *
                   Eigen::AngleAxisd(lot.uniform(-0.3, 0.3), Vector3d::UnitX());
      if (lot.chance(0.7)) move(environment, tumbled(lot));
      raise_above(environment, 0.13, lot.uniform(0, 0.1));
      throw_at(20);
      environment.obstacles = {{board}};
      return;
    }
    case SceneKind::drape:
      if (lot.chance(0.5)) environment.obstacles.push_back(table);
      environment.obstacles.push_back(draw_support(lot, side));
      raise_above(environment, 0.19, lot.uniform(0, 0.05));
      throw_at(1);
      return;
    case SceneKind::lift: {
      environment.obstacles = {table};
      const Vector3d at = environment.state.positions.row(corner);
      environment.holds = {
          grasp_corner(environment, corner, 0.15 * side, draw_path(lot, at, seconds, 3, false), h)};
      return;
    }
    case SceneKind::drag: {
      environment.obstacles = {table};
      const Vector3d at = environment.state.positions.row(corner);
      environment.holds = {
          grasp_corner(environment, corner, 0.15 * side, draw_path(lot, at, seconds, 2, true), h)};
      if (lot.chance(0.5)) environment.obstacles.push_back({Plane{Vector3d(-0.01, 0, 0), Vector3d::UnitX()}});
      return;
    }
    case SceneKind::corner: {
      move(environment, tumbled(lot));
      raise_above(environment, 0, 0.001);
      environment.state.positions.col(0).array() += 0.001 - environment.state.positions.col(0).minCoeff();
      environment.state.positions.col(1).array() += 0.001 - environment.state.positions.col(1).minCoeff();
      environment.state.velocities.rowwise() = lot.uniform(0, 2) * Vector3d(-1, -1, -1).transpose();
      const double lean = lot.uniform(0, 0.3);
      environment.obstacles = {table,
                               {Plane{Vector3d::Zero(), Vector3d(1, 0, lean).normalized()}},
                               {Plane{Vector3d::Zero(), Vector3d(0, 1, lean).normalized()}}};
      const double y = -lot.uniform(0, 1), x = -lot.uniform(0, 1);
      environment.gravity = 9.81 * Vector3d(x, y, -1).normalized();
      return;
    }
    case SceneKind::pusher: {
      Box pusher{.half_extents = {0.02, lot.uniform(0.02, 0.3), 0.02}};
      const double speed = lot.log_uniform(0.05, 2);
      const Vector3d start(-0.021, 0.2 * side, 0.0205);
      const double until = seconds + 1;
      const int carrier =
          add_frame(environment, straight_path(start, start + speed * until * Vector3d::UnitX(), until), h);
      environment.obstacles = {table, {.shape = pusher, .frame = carrier}};
      if (lot.chance(0.3)) {
        const Vector3d away = Vector3d(side + 0.02, 0, 0);
        environment.obstacles.push_back({Plane{away, -Vector3d::UnitX()}});
      }
      return;
    }
    case SceneKind::deep: {
      if (lot.chance(0.3)) move(environment, tumbled(lot));
      environment.obstacles = {table};
      if (lot.chance(0.3)) environment.obstacles.push_back(draw_support(lot, side));
      environment.state.positions.col(2).array() -= lot.log_uniform(0.001, 0.1) + lowest(environment);
      return;
    }
  }
}

/// Puts a capsule or a sphere in place of a share of the boxes and cylinders. It draws from a lot of its own,
/// so that all else is as it would be without.
void round_off(unsigned long seed, double share, double largest_radius, RandomScene& scene) {
  Lot lot(seed + 1'000'003);
  for (Obstacle& obstacle : scene.environment.obstacles) {
    const bool chosen = lot.chance(share), ball = lot.chance(0.5);
    const double length = lot.uniform(0.01, 0.2);
    Capsule capsule;
    if (const auto* cylinder = std::get_if<Cylinder>(&obstacle.shape)) {
      capsule = {cylinder->point, cylinder->axis, length, cylinder->radius};
    } else if (const auto* box = std::get_if<Box>(&obstacle.shape)) {
      Vector3d sizes = box->half_extents;
      int longest = 0;
      box->half_extents.maxCoeff(&longest);
      std::sort(sizes.begin(), sizes.end());
      capsule = {box->pose.translation(), box->pose.linear().col(longest), sizes[2], sizes[1]};
    } else {
      continue;
    }
    capsule.radius = std::min(capsule.radius, largest_radius);
    if (ball) capsule.half_length = 0;
    if (chosen) obstacle.shape = capsule;
  }
}

/// A surface of triangles that fills about the same room as a box: a box, a step, a groove, a ball with
/// bumps, two boxes that reach into each other, or an open plate.
Mesh draw_surface(Lot& lot, const Box& box) {
  const Vector3d half = box.half_extents;
  const double a = half.x(), b = half.y(), c = half.z(), inner = lot.uniform(-0.5, 0.5);
  Mesh mesh;
  switch (lot.below(6)) {
    case 0:
      mesh = mesh_shape(box_surface(half, 1 + lot.below(3)));
      break;
    case 1:
      mesh = mesh_shape(prism_surface(
          {{-a, -c}, {a, -c}, {a, inner * c}, {inner * a, inner * c}, {inner * a, c}, {-a, c}}, 3, b));
      break;
    case 2:
      mesh = mesh_shape(prism_surface({{-a, -c}, {a, -c}, {a, c}, {inner * a, inner * c}, {-a, c}}, 3, b));
      break;
    case 3: {
      data::TriangleMesh ball = ball_surface(1, 1);
      for (Eigen::Index i = 0; i < ball.vertices.rows(); ++i) ball.vertices.row(i) *= lot.uniform(0.7, 1.3);
      ball.vertices = ball.vertices * half.asDiagonal();
      mesh = mesh_shape(ball);
      break;
    }
    case 4:
      mesh = mesh_shape(joined_surfaces(box_surface(half),
                                        moved_surface(box_surface({0.4 * a, 0.3 * b, 1.5 * c}),
                                                      Isometry3d(Eigen::Translation3d(inner * a, 0, 0)))));
      break;
    default: {
      const data::TriangleMesh plate =
          data::rectangle({.width = 2 * a, .height = 2 * b, .cells_x = 3, .cells_y = 3});
      mesh = mesh_shape(moved_surface(plate, Isometry3d(Eigen::Translation3d(-a, -b, 0))),
                        lot.log_uniform(1e-4, 5e-3));
    }
  }
  mesh.pose = box.pose;
  return mesh;
}

/// Puts a surface of triangles in place of a share of the boxes and cylinders. It draws from a lot of its
/// own.
void triangulate(unsigned long seed, double share, RandomScene& scene) {
  Lot lot(seed + 2'000'003);
  for (Obstacle& obstacle : scene.environment.obstacles) {
    if (!lot.chance(share)) continue;
    if (const auto* cylinder = std::get_if<Cylinder>(&obstacle.shape)) {
      Isometry3d pose = Isometry3d::Identity();
      pose.linear() =
          Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitY(), cylinder->axis).toRotationMatrix();
      pose.translation() = cylinder->point;
      const double radius = cylinder->radius;
      const int sides = 5 + lot.below(20);
      const double half_width = lot.uniform(0.1, 0.6);
      const double margin = lot.chance(0.3) ? lot.log_uniform(1e-4, 5e-3) : 0;
      obstacle.shape = mesh_shape(rod_surface(radius, half_width, sides), margin, pose);
    } else if (const auto* box = std::get_if<Box>(&obstacle.shape)) {
      const Box drawn = *box;
      obstacle.shape = draw_surface(lot, drawn);
    }
  }
}

/// Whether a straight way goes through triangles, in and out again on the far side. What starts on them
/// starts a little above.
bool goes_through_mesh(const Mesh& mesh, Vector3d from, const Vector3d& to) {
  const data::TriangleMesh all = triangles_of(*mesh.surface);
  const SurfacePlace start = nearest_on(*mesh.surface, {from.x(), from.y(), from.z()});
  const Vector3<double>& up = mesh.surface->triangles[static_cast<std::size_t>(start.triangle)].normal;
  if (start.distance < 1e-7) from += 1e-7 * Vector3d(up.x, up.y, up.z);
  if (mesh.surface->closed && (brute_winding(all, from) > 0.5 || brute_winding(all, to) > 0.5)) return false;
  const Vector3d way = to - from;
  bool within = false;
  Vector3d entry = Vector3d::Zero();
  for (const BruteCrossing& crossing : brute_crossings(all, from, to)) {
    if (!mesh.surface->closed) return true;
    if (crossing.normal.dot(way) < 0) {
      if (!within) entry = crossing.normal;
      within = true;
    } else if (within) {
      within = false;
      if (entry.dot(crossing.normal) < -0.5) return true;
    }
  }
  return false;
}

/// Whether the straight way from `from` to `to`, seen from the obstacle as it moves, goes through it: in by
/// one face of a box and out by the one behind, or past the axis of a cylinder.
bool goes_through(const Environment& environment, const Obstacle& obstacle, const Vector3d& from,
                  const Vector3d& to, double from_time, double to_time) {
  if (const auto* mesh = std::get_if<Mesh>(&obstacle.shape)) {
    const auto seen = [&](const Vector3d& x, double time) {
      return Vector3d((frame_pose(environment, obstacle.frame, time) * mesh->pose).inverse() * x);
    };
    return goes_through_mesh(*mesh, seen(from, from_time), seen(to, to_time));
  }
  bool inside = false;
  for (int k = 0; k <= 400; ++k) {
    const double share = k / 400.0;
    inside = inside || depth_in(environment, obstacle, from + share * (to - from),
                                from_time + share * (to_time - from_time)) > 1e-6;
  }
  if (!inside) return false;
  if (const auto* capsule = std::get_if<Capsule>(&obstacle.shape)) {
    // Out on the far side of where it came in.
    if (depth_in(environment, obstacle, from, from_time) > 0 ||
        depth_in(environment, obstacle, to, to_time) > 0)
      return false;
    Vector3d first, last;
    bool any = false;
    for (int k = 0; k <= 400; ++k) {
      const double share = k / 400.0, time = from_time + share * (to_time - from_time);
      const Vector3d at =
          frame_pose(environment, obstacle.frame, time).inverse() * (from + share * (to - from)) -
          capsule->centre;
      const double along = std::clamp(at.dot(capsule->axis), -capsule->half_length, capsule->half_length);
      const Vector3d out = at - along * capsule->axis;
      if (out.norm() > capsule->radius) continue;
      if (!any) first = out;
      any = true;
      last = out;
    }
    return any && first.normalized().dot(last.normalized()) < -0.1;
  }
  if (const auto* cylinder = std::get_if<Cylinder>(&obstacle.shape)) {
    const auto radial = [&](const Vector3d& x) {
      return Vector3d((x - cylinder->point) - cylinder->axis * cylinder->axis.dot(x - cylinder->point));
    };
    return depth_in(environment, obstacle, to, to_time) < 0 && radial(from).dot(radial(to)) < 0;
  }
  const auto* box = std::get_if<Box>(&obstacle.shape);
  if (box == nullptr) return false;
  const auto seen_from_box = [&](const Vector3d& x, double time) {
    return Vector3d((frame_pose(environment, obstacle.frame, time) * box->pose).inverse() * x);
  };
  const Vector3d start = seen_from_box(from, from_time), end = seen_from_box(to, to_time);
  for (int axis = 0; axis < 3; ++axis) {
    const double half = box->half_extents[axis];
    // Where it stands beside the box at the start or at the end, it went round an edge.
    const auto beside = [&](const Vector3d& x) {
      return std::abs(x[(axis + 1) % 3]) > box->half_extents[(axis + 1) % 3] ||
             std::abs(x[(axis + 2) % 3]) > box->half_extents[(axis + 2) % 3];
    };
    if (start[axis] * end[axis] < 0 && std::abs(start[axis]) > half - 1e-9 &&
        std::abs(end[axis]) > half - 1e-9 && !beside(start) && !beside(end))
      return true;
  }
  return false;
}

/// Of each vertex of a sheet, or of a solid [kg].
Eigen::VectorXd masses(const RandomScene& scene) {
  const auto solid = scene.environment.solids.find(0);
  if (solid != scene.environment.solids.end()) return solid->second.density * scene.sheet.vertex_volume;
  return scene.environment.materials[0].areal_density * scene.sheet.vertex_area;
}

double moved_energy(const Environment& environment, const StepReport& report) {
  double loads = 0;
  for (const Load& load : environment.loads)
    loads -= load.force.dot(environment.state.positions.row(load.vertex));
  return report.kinetic + report.membrane + report.bending + report.solid + report.gravitational + loads;
}

/// At rest in its rest shape, among drawn obstacles of which shares are other shapes instead.
void set_scene(Lot& lot, unsigned long seed, double side, const ShapeShares& shares, RandomScene& scene) {
  scene.environment.state.positions = scene.sheet.rest.vertices;
  scene.environment.state.velocities = data::Points::Zero(scene.sheet.rest.vertices.rows(), 3);
  draw_scene(lot, side, scene);
  constexpr double below = 0.08;  // [m]
  triangulate(seed, shares.meshes, scene);
  round_off(seed, shares.round, below, scene);
}

}  // namespace

const char* to_string(SceneKind kind) {
  static constexpr const char* names[] = {"drop", "impact", "drape",  "lift",
                                          "drag", "corner", "pusher", "deep"};
  return names[static_cast<int>(kind)];
}

RandomScene random_scene(unsigned long seed, const ShapeShares& shares) {
  Lot lot(seed);
  RandomScene scene;
  scene.kind = static_cast<SceneKind>(lot.below(static_cast<int>(SceneKind::last) + 1));
  double side = 0;
  scene.mesh = draw_mesh(lot, side);
  scene.sheet = make_sheet(data::parse_mesh_spec(scene.mesh));
  scene.settings.time_step = lot.log_uniform(0.001, 0.03);
  scene.environment.materials[0] = draw_material(lot);
  set_scene(lot, seed, side, shares, scene);
  return scene;
}

RandomScene random_solid_scene(unsigned long seed, const ShapeShares& shares) {
  Lot lot(seed);
  RandomScene scene;
  scene.kind = static_cast<SceneKind>(lot.below(static_cast<int>(SceneKind::last) + 1));
  double side = 0;
  draw_solid(lot, side, scene);
  scene.settings.time_step = lot.log_uniform(0.001, 0.03);
  set_scene(lot, seed, side, shares, scene);
  return scene;
}

RandomScene random_deep_start(unsigned long seed, const ShapeShares& shares) {
  Lot lot(seed);
  RandomScene scene;
  scene.kind = SceneKind::deep;
  double side = 0;
  scene.mesh = draw_mesh(lot, side);
  scene.sheet = make_sheet(data::parse_mesh_spec(scene.mesh));
  scene.settings.time_step = lot.log_uniform(0.001, 0.03);
  scene.steps = static_cast<int>(0.4 / scene.settings.time_step);
  Environment& environment = scene.environment;
  environment.materials[0] = draw_material(lot);
  environment.state.positions = scene.sheet.rest.vertices;
  environment.state.velocities = data::Points::Zero(scene.sheet.rest.vertices.rows(), 3);
  if (lot.chance(0.5)) environment.gravity.setZero();
  const Vector3d middle = environment.state.positions.colwise().mean();
  const Isometry3d turned = lot.chance(0.5) ? tumbled(lot) : Isometry3d::Identity();
  move(environment, turned * Eigen::Translation3d(-middle));
  for (int k = lot.below(2); k >= 0; --k) {
    const Vector3d direction = lot.direction(), aside = lot.uniform(0, 0.5) * side * direction;
    if (lot.chance(0.4)) {
      environment.obstacles.push_back({Cylinder{aside, lot.direction(), lot.log_uniform(0.01, 0.3)}});
      continue;
    }
    Box box{.half_extents = {lot.log_uniform(0.003, 0.3), lot.log_uniform(0.003, 0.3),
                             lot.log_uniform(0.003, 0.3)}};
    box.pose = Eigen::Translation3d(aside) * (lot.chance(0.5) ? tumbled(lot) : Isometry3d::Identity());
    environment.obstacles.push_back({box});
  }
  constexpr double any_radius = 1;  // [m]
  triangulate(seed, shares.meshes, scene);
  round_off(seed, shares.round, any_radius, scene);
  return scene;
}

SceneFindings observe(RandomScene scene) {
  Environment& environment = scene.environment;
  const double h = scene.settings.time_step;
  SceneFindings found;
  found.steps = scene.steps;
  Solver solver(scene.sheet, scene.settings);
  std::vector<bool> held(static_cast<std::size_t>(environment.state.positions.rows()), false);
  for (const Hold& hold : environment.holds)
    for (const int vertex : hold.vertices) held[static_cast<std::size_t>(vertex)] = true;
  // Vertices that began inside and are not out yet.
  std::vector<std::vector<bool>> inside(environment.obstacles.size(), std::vector<bool>(held.size(), false));
  for (std::size_t k = 0; k < environment.obstacles.size(); ++k)
    for (std::size_t i = 0; i < held.size(); ++i)
      inside[k][i] =
          depth_in(environment, environment.obstacles[k], environment.state.positions.row(i), 0) > 1e-9;

  const Eigen::VectorXd mass = masses(scene);
  double energy = 0, put_in = 0;
  bool energy_known = false;
  for (int step = 0; step < scene.steps; ++step) {
    const State before = environment.state;
    if (!energy_known) {
      // The elastic energy of the start is that of the rest shape.
      energy = 0.5 * (mass.asDiagonal() * before.velocities).cwiseProduct(before.velocities).sum();
      for (int i = 0; i < mass.size(); ++i)
        energy -= mass[i] * environment.gravity.dot(before.positions.row(i));
      put_in = 0.5 * (mass.asDiagonal() * before.velocities).cwiseProduct(before.velocities).sum();
      energy_known = true;
    }
    const StepReport report = solver.step(environment);
    const State& after = environment.state;
    found.finite = found.finite && after.positions.allFinite() && after.velocities.allFinite() &&
                   std::isfinite(report.residual);
    if (!found.finite) return found;
    if (scene.kind == SceneKind::deep)
      found.shot_speed = std::max(found.shot_speed, after.velocities.rowwise().norm().maxCoeff() -
                                                        after.time * environment.gravity.norm());
    found.halved += report.substeps > 1;
    if (!report.converged) {
      ++found.unconverged;
      found.residual_max = std::max(found.residual_max, report.residual);
    }
    for (std::size_t k = 0; k < environment.obstacles.size(); ++k)
      for (std::size_t i = 0; i < held.size(); ++i) {
        const Vector3d from = before.positions.row(i), to = after.positions.row(i);
        const double depth = depth_in(environment, environment.obstacles[k], to, after.time);
        if (report.converged)
          found.unseen_depth = std::max(found.unseen_depth, depth - report.penetration_max);
        if (held[i]) continue;
        if (inside[k][i]) {
          const double out = (depth_in(environment, environment.obstacles[k], from, before.time) - depth) / h;
          if (depth_in(environment, environment.obstacles[k], from, before.time) > 0)
            found.exit_speed = std::max(found.exit_speed, out);
          inside[k][i] = depth > 0;
          continue;
        }
        if (!report.converged) continue;
        found.free_depth = std::max(found.free_depth, depth);
        if (report.substeps == 1)  // the way of a step in parts is not straight
          found.crossed +=
              goes_through(environment, environment.obstacles[k], from, to, before.time, after.time);
      }

    // Work of what moves the sheet: grippers and pushers here never turn.
    // A step in parts has means of forces, so that its work is its own account.
    double work = report.substeps > 1 ? report.work : 0;
    const auto moved = [&](int frame) {
      return Vector3d(frame_pose(environment, frame, after.time).translation() -
                      frame_pose(environment, frame, before.time).translation());
    };
    for (std::size_t k = 0; report.substeps == 1 && k < environment.holds.size(); ++k)
      work += report.hold_forces[k].dot(moved(environment.holds[k].frame));
    for (std::size_t k = 0; report.substeps == 1 && k < environment.obstacles.size(); ++k)
      work += report.obstacle_forces[k].dot(moved(environment.obstacles[k].frame));
    const double now = moved_energy(environment, report), gain = now - energy - work;
    // What falls puts in its weight's work, over the step.
    put_in += std::max(work, 0.0);
    const double falls = std::max(0.0, [&] {
      double drop = 0;
      for (int i = 0; i < mass.size(); ++i)
        drop += mass[i] * environment.gravity.dot(after.positions.row(i) - before.positions.row(i));
      return drop;
    }());
    put_in += falls;
    if (report.converged && scene.kind != SceneKind::deep) {
      // What the weight does over a nanometre is rounding.
      const double weight = mass.sum() * 9.81;
      found.energy_gain = std::max(found.energy_gain, gain);
      found.energy_gain_share = std::max(found.energy_gain_share, gain / std::max(put_in, 1e-9 * weight));
    }
    energy = now;
  }
  for (std::size_t i = 0; i < held.size(); ++i)
    found.inside +=
        !held[i] && std::any_of(environment.obstacles.begin(), environment.obstacles.end(),
                                [&](const Obstacle& obstacle) {
                                  return depth_in(environment, obstacle, environment.state.positions.row(i),
                                                  environment.state.time) > 1e-6;
                                });
  return found;
}

}  // namespace flash::sim
