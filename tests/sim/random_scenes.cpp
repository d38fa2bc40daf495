#include "tests/sim/random_scenes.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "data/mesh/procedural_mesh.h"
#include "sim/scene/solid.h"
#include "tests/sim/lot.h"
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
}  // namespace flash::sim
