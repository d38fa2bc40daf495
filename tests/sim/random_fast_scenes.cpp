#include "tests/sim/random_fast_scenes.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "data/mesh/procedural_mesh.h"
#include "tests/sim/brute_passing.h"
#include "tests/sim/layer_scenes.h"
#include "tests/sim/lot.h"
#include "tests/sim/scene_findings.h"
#include "tests/sim/sheet_scene.h"
#include "tests/sim/solid_scene.h"

namespace flash::sim {
namespace {

using data::Points;
using Eigen::Matrix3d;
using Eigen::RowVector3d;
using Eigen::Vector3d;

Sheet draw_sheet(Lot& lot) {
  static constexpr data::DiagonalPattern patterns[] = {
      data::DiagonalPattern::one_way, data::DiagonalPattern::alternating, data::DiagonalPattern::jittered};
  const double side = lot.uniform(0.04, 0.12), height = side * lot.uniform(0.6, 1);
  const int cells = 3 + lot.below(5);
  const auto pattern = patterns[lot.below(3)];
  return make_sheet(data::rectangle(
      {.width = side, .height = height, .cells_x = cells, .cells_y = cells, .pattern = pattern}));
}

Sheet draw_cube(Lot& lot) {
  const double side = lot.uniform(0.01, 0.04);
  const int cells = 1 + lot.below(3);
  return solid_box(Vector3d::Constant(side), Eigen::Vector3i::Constant(cells));
}

/// A turn by lot; in two scenes of five none, so that meshes lie in line.
Matrix3d draw_turn(Lot& lot, double greatest) {
  const Vector3d axis = lot.direction();
  const double angle = lot.uniform(-greatest, greatest);
  return lot.chance(0.4) ? Matrix3d::Identity() : Eigen::AngleAxisd(angle, axis).toRotationMatrix();
}

double shortest_edge(const Sheet& sheet) {
  double shortest = 1e300;
  const data::Triangles triangles = visible_triangles(sheet);
  for (const auto& t : triangles.rowwise())
    for (int k = 0; k < 3; ++k)
      shortest = std::min(shortest,
                          (sheet.rest.vertices.row(t[k]) - sheet.rest.vertices.row(t[(k + 1) % 3])).norm());
  return shortest;
}

void set_up(Lot& lot, Sheet sheet, RandomFastScene& scene) {
  scene.sheet = std::move(sheet);
  scene.environment = environment_of(scene.sheet);
  scene.environment.materials.clear();
  for (std::size_t b = 0; b < scene.sheet.bodies.size(); ++b) {
    data::SheetMaterial& material = scene.environment.materials.emplace_back();
    material.membrane_stiffness = lot.log_uniform(30, 1e4);
    material.areal_density = lot.log_uniform(0.05, 1);
    material.bending_rigidity = lot.log_uniform(1e-6, 1e-3);
    material.friction = lot.uniform(0, 1);
    if (!scene.sheet.bodies[b].is_solid()) continue;
    data::SolidMaterial& solid = scene.environment.solids[static_cast<int>(b)];
    solid.youngs_modulus = lot.log_uniform(1e4, 1e7);
    solid.density = lot.log_uniform(100, 2000);
    solid.poissons_ratio = lot.uniform(0, 0.45);
  }
  const double thickest = std::min(2e-3, 0.4 * shortest_edge(scene.sheet));
  const double thickness = thickest * lot.log_uniform(0.1, 1);
  const double friction = lot.chance(0.5) ? 0 : lot.uniform(0.1, 1);
  scene.environment.self_contact =
      SelfContact{.thickness = thickness, .friction = friction, .pressure = 2500};
  if (lot.chance(0.5)) scene.environment.gravity.setZero();
}

/// Turns a body about its middle, which comes to the origin.
void turn(const Body& body, const Matrix3d& by, Environment& environment) {
  auto x = rows_of(body, environment.state.positions);
  const RowVector3d middle = x.colwise().mean();
  x = ((x.rowwise() - middle) * by.transpose()).eval();
}

struct Meeting {
  double speed, gap;  ///< [m/s], [m]
};

/// Body 0 above body 1, which close along z; sideways they are off by up to a share of their size.
Meeting fly_together(Lot& lot, double speed, double most_off, RandomFastScene& scene) {
  Environment& environment = scene.environment;
  const double h = scene.settings.time_step;
  auto upper = rows_of(scene.sheet.bodies[0], environment.state.positions);
  auto lower = rows_of(scene.sheet.bodies[1], environment.state.positions);
  const double size =
      std::min((upper.colwise().maxCoeff() - upper.colwise().minCoeff()).head<2>().maxCoeff(),
               (lower.colwise().maxCoeff() - lower.colwise().minCoeff()).head<2>().maxCoeff());
  const double gap = 1.2 * environment.self_contact->thickness + lot.uniform(0, 1) * speed * h;
  const double right = lot.uniform(-most_off, most_off), back = lot.uniform(-most_off, most_off);
  upper.rowwise() +=
      RowVector3d(right * size, back * size, lower.col(2).maxCoeff() + gap - upper.col(2).minCoeff());
  const double share = lot.chance(0.5) ? 1 : lot.uniform(0, 1), sideways = lot.uniform(-0.2, 0.2);
  rows_of(scene.sheet.bodies[0], environment.state.velocities).rowwise() =
      speed * RowVector3d(sideways, 0, -share);
  rows_of(scene.sheet.bodies[1], environment.state.velocities).rowwise() =
      speed * RowVector3d(0, 0, 1 - share);
  return {speed, gap};
}

/// All turned alike, so that nothing lies in line with the axes.
void turn_world(Lot& lot, RandomFastScene& scene) {
  const Matrix3d by = draw_turn(lot, std::numbers::pi);
  State& state = scene.environment.state;
  state.positions = (state.positions * by.transpose()).eval();
  state.velocities = (state.velocities * by.transpose()).eval();
}

Meeting draw(Lot& lot, double speed, RandomFastScene& scene) {
  Environment& environment = scene.environment;
  const double h = scene.settings.time_step;
  const auto two = [&](const Sheet& upper, const Sheet& lower) {
    const std::vector<Sheet> both = {upper, lower};
    set_up(lot, joined(both), scene);
  };
  const Matrix3d on_edge = Eigen::AngleAxisd(0.5 * std::numbers::pi, Vector3d::UnitX()).toRotationMatrix();
  switch (scene.kind) {
    case FastSceneKind::faces:
    case FastSceneKind::edge_on:
    case FastSceneKind::in_plane: {
      const Sheet upper = draw_sheet(lot), lower = draw_sheet(lot);
      two(upper, lower);
      const bool first_on_edge = scene.kind != FastSceneKind::faces,
                 both = scene.kind == FastSceneKind::in_plane;
      const Matrix3d upper_turn = draw_turn(lot, 0.3), lower_turn = draw_turn(lot, 0.3);
      turn(scene.sheet.bodies[0], first_on_edge ? Matrix3d(upper_turn * on_edge) : upper_turn, environment);
      turn(scene.sheet.bodies[1], both ? Matrix3d(lower_turn * on_edge) : lower_turn, environment);
      const Meeting meeting = fly_together(lot, speed, 0.4, scene);
      if (both) rows_of(scene.sheet.bodies[0], environment.state.positions).col(1).setZero();
      turn_world(lot, scene);
      return meeting;
    }
    case FastSceneKind::cubes: {
      const Sheet upper = draw_cube(lot), lower = draw_cube(lot);
      two(upper, lower);
      for (const Body& body : scene.sheet.bodies) turn(body, draw_turn(lot, std::numbers::pi), environment);
      const Meeting meeting = fly_together(lot, speed, 0.4, scene);
      turn_world(lot, scene);
      return meeting;
    }
    case FastSceneKind::cube_on_sheet: {
      const Sheet upper = draw_cube(lot), lower = draw_sheet(lot);
      two(upper, lower);
      turn(scene.sheet.bodies[0], draw_turn(lot, std::numbers::pi), environment);
      turn(scene.sheet.bodies[1], draw_turn(lot, 0.5), environment);
      const Meeting meeting = fly_together(lot, speed, 0.4, scene);
      turn_world(lot, scene);
      return meeting;
    }
    case FastSceneKind::legs: {
      set_up(lot, draw_sheet(lot), scene);
      const double radius = scene.sheet.rest.vertices.col(0).maxCoeff() * lot.uniform(0.06, 0.12) +
                            environment.self_contact->thickness;
      bend_to_hairpin(radius, environment.state.positions);
      for (Eigen::Index i = 0; i < environment.state.positions.rows(); ++i)
        environment.state.velocities(i, 2) = (environment.state.positions(i, 2) > 0 ? -0.5 : 0.5) * speed;
      turn_world(lot, scene);
      return {speed, 2 * radius};
    }
    case FastSceneKind::carried: {
      const Sheet cube = draw_cube(lot), other = lot.chance(0.5) ? draw_sheet(lot) : draw_cube(lot);
      two(cube, other);
      turn(scene.sheet.bodies[1], draw_turn(lot, 0.5), environment);
      const Meeting meeting = fly_together(lot, speed, 0.4, scene);
      environment.state.velocities.setZero();
      const std::vector<int> back = face_of(cube, 2, cube.rest.vertices.col(2).maxCoeff());
      const double way = meeting.gap + lot.uniform(0.02, 0.1);
      environment.holds.push_back(
          gripped(environment, back,
                  straight_path(Vector3d::Zero(), {0, 0, -way}, std::max(way / speed, 1.01 * h)), h));
      return meeting;
    }
    case FastSceneKind::board: {
      set_up(lot, draw_sheet(lot), scene);
      turn(scene.sheet.bodies[0], draw_turn(lot, 0.5), environment);
      const double gap = 1e-3 + lot.uniform(0, 1) * speed * h, half = lot.log_uniform(2e-4, 5e-3);
      const double way = gap + lot.uniform(0.05, 0.2);
      const Vector3d start(0, 0, environment.state.positions.col(2).maxCoeff() + gap + half);
      const auto path = straight_path(start, start - Vector3d(0, 0, way), std::max(way / speed, 1.01 * h));
      const int frame = add_frame(environment, path, h);
      environment.obstacles.push_back({.shape = Box{.half_extents = {0.1, 0.1, half}}, .frame = frame});
      if (lot.chance(0.5)) environment.obstacles.push_back({.shape = Plane{.point = {0, 0, -0.1}}});
      return {speed, gap};
    }
  }
  return {};
}

std::vector<bool> carried(const RandomFastScene& scene) {
  std::vector<bool> all(static_cast<std::size_t>(scene.sheet.rest.vertices.rows()), false);
  for (const Hold& hold : scene.environment.holds)
    for (const int vertex : hold.vertices) all[static_cast<std::size_t>(vertex)] = true;
  return all;
}

}  // namespace

const char* to_string(FastSceneKind kind) {
  static constexpr const char* names[] = {"faces",         "edge on", "in plane", "cubes",
                                          "cube on sheet", "legs",    "carried",  "board"};
  return names[static_cast<int>(kind)];
}

RandomFastScene random_fast_scene(unsigned long seed) {
  Lot lot(seed + 5'000'005);
  while (true) {
    RandomFastScene scene;
    scene.kind = static_cast<FastSceneKind>(lot.below(static_cast<int>(FastSceneKind::last) + 1));
    const double own_step = lot.log_uniform(0.001, 0.03), speed = lot.log_uniform(1, 40);
    scene.settings.time_step = lot.chance(0.5) ? 0.01 : own_step;
    const Meeting meeting = draw(lot, speed, scene);
    const double h = scene.settings.time_step;
    scene.steps = std::clamp(static_cast<int>((meeting.gap + 0.1) / (meeting.speed * h)) + 4, 5, 40);
    const BruteFeatures features(scene.sheet, carried(scene));
    const Points& start = scene.environment.state.positions;
    if (brute_intersects(features, start) || brute_enclosed(scene.sheet, features, start) > 0) continue;
    char text[200];
    std::snprintf(text, sizeof text,
                  "%td vertices, closing at %.3g m/s over %.3g m, h %.3g s, thickness %.2g m, friction %.2f",
                  scene.sheet.rest.vertices.rows(), meeting.speed, meeting.gap, h,
                  scene.environment.self_contact->thickness, scene.environment.self_contact->friction);
    scene.description = text;
    return scene;
  }
}

FastFindings observe(RandomFastScene scene) {
  Environment& environment = scene.environment;
  const BruteFeatures features(scene.sheet, carried(scene));
  FastFindings found;
  found.steps = scene.steps;
  int passing = 0, crossed = 0;  // of a step
  State before = environment.state;
  scene.settings.part = [&](const State& state) {
    ++found.parts;
    passing += !brute_meetings(features, before.positions, state.positions).empty() ||
               brute_intersects(features, state.positions) ||
               brute_enclosed(scene.sheet, features, state.positions) > 0;
    for (const Obstacle& obstacle : environment.obstacles)
      for (Eigen::Index i = 0; i < state.positions.rows(); ++i)
        crossed += goes_through(environment, obstacle, before.positions.row(i), state.positions.row(i),
                                before.time, state.time);
    before = state;
  };
  Solver solver(scene.sheet, scene.settings);
  for (int step = 0; step < scene.steps; ++step) {
    passing = crossed = 0;
    before = environment.state;
    const StepReport report = solver.step(environment);
    found.finite = found.finite && environment.state.positions.allFinite() &&
                   environment.state.velocities.allFinite() && std::isfinite(report.residual);
    if (!found.finite) return found;
    found.passing += passing;
    found.silent += report.converged ? passing : 0;
    found.crossed += crossed;
    found.unconverged += !report.converged;
    found.halved += report.substeps > 1;
    found.touching += report.layer_touches > 0;
    found.iterations += report.iterations;
    found.most_iterations = std::max(found.most_iterations, report.iterations);
  }
  return found;
}

}  // namespace flash::sim
