#include "tests/sim/random_layer_scenes.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "data/mesh/procedural_mesh.h"
#include "sim/pairs/intersection.h"
#include "tests/sim/layer_scenes.h"
#include "tests/sim/lot.h"
#include "tests/sim/sheet_scene.h"
#include "tests/sim/solid_scene.h"

namespace flash::sim {
namespace {

using data::Points;
using Eigen::Vector3d;

/// A sheet of 25 to 140 vertices; one in four has cells up to twenty times as long as wide.
Sheet draw_sheet(Lot& lot, double side) {
  static constexpr data::DiagonalPattern patterns[] = {
      data::DiagonalPattern::one_way, data::DiagonalPattern::alternating, data::DiagonalPattern::jittered};
  const double width = side * lot.uniform(0.5, 1), height = side * lot.uniform(0.5, 1);
  const double slender = lot.chance(0.25) ? lot.log_uniform(2, 20) : 1;
  const double cells = lot.uniform(16, 110), across = std::sqrt(cells / slender * height / width);
  const auto pattern = patterns[lot.below(3)];
  return make_sheet(data::rectangle({.width = width,
                                     .height = height,
                                     .cells_x = std::max(2, static_cast<int>(cells / std::max(across, 1.0))),
                                     .cells_y = std::max(2, static_cast<int>(across)),
                                     .pattern = pattern}));
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
  material.membrane_stiffness = lot.log_uniform(10, 1e5);
  material.poissons_ratio = lot.uniform(0, 0.45);
  material.areal_density = lot.log_uniform(0.05, 1);
  material.bending_rigidity = std::min(lot.log_uniform(1e-7, 1e-3), material.membrane_stiffness * 1e-4 / 12);
  material.friction = lot.uniform(0, 1.2);
  if (lot.chance(0.2)) material.air_drag = lot.uniform(0, 5);
  return material;
}

double shortest_edge(const Sheet& sheet) {
  double shortest = 1e300;
  const data::Triangles triangles = visible_triangles(sheet);
  for (Eigen::Index t = 0; t < triangles.rows(); ++t)
    for (int k = 0; k < 3; ++k)
      shortest = std::min(shortest, (sheet.rest.vertices.row(triangles(t, k)) -
                                     sheet.rest.vertices.row(triangles(t, (k + 1) % 3)))
                                        .norm());
  return shortest;
}

/// The layers of a scene: as thick as half of the shortest edge at most.
SelfContact draw_contact(Lot& lot, const Sheet& sheet) {
  const double thickest = std::min(5e-3, 0.5 * shortest_edge(sheet));
  return {.thickness = thickest * lot.log_uniform(0.05, 1),
          .friction = lot.chance(0.2) ? 0 : lot.uniform(0, 1.2),
          .pressure = lot.log_uniform(500, 2e4)};
}

void set_up(Lot& lot, Sheet sheet, RandomLayerScene& scene) {
  scene.sheet = std::move(sheet);
  scene.environment = environment_of(scene.sheet);
  scene.environment.materials.clear();
  for (std::size_t b = 0; b < scene.sheet.bodies.size(); ++b) {
    scene.environment.materials.push_back(draw_material(lot));
    if (!scene.sheet.bodies[b].is_solid()) continue;
    data::SolidMaterial& solid = scene.environment.solids[static_cast<int>(b)];
    solid.youngs_modulus = lot.log_uniform(1e4, 1e7);
    solid.density = lot.log_uniform(100, 2000);
    solid.poissons_ratio = lot.uniform(0, 0.45);
  }
  scene.environment.self_contact = draw_contact(lot, scene.sheet);
  scene.environment.obstacles = {{.shape = Plane{}}};
}

/// Lays body upon body, each turned and shifted, and throws each down at a speed of its own.
void stack(Lot& lot, double side, double fastest, RandomLayerScene& scene) {
  State& state = scene.environment.state;
  double top = 1e-3;
  for (const Body& body : scene.sheet.bodies) {
    auto x = rows_of(body, state.positions);
    const Eigen::RowVector3d middle = x.colwise().mean();
    const double turn = lot.uniform(-0.5, 0.5), right = lot.uniform(-0.2, 0.2), back = lot.uniform(-0.2, 0.2);
    const Eigen::Matrix3d turned = Eigen::AngleAxisd(turn, Vector3d::UnitZ()).toRotationMatrix();
    x = ((x.rowwise() - middle) * turned.transpose()).eval();
    x.rowwise() += side * Eigen::RowVector3d(right, back, 0);
    x.col(2).array() += top - x.col(2).minCoeff();
    top = x.col(2).maxCoeff() + scene.environment.self_contact->thickness * lot.log_uniform(1.01, 10);
    const double sideways = lot.uniform(-0.3, 0.3), down = lot.uniform(0, fastest);
    rows_of(body, state.velocities).rowwise() = down * Eigen::RowVector3d(sideways, 0, -1);
  }
}

/// Rolls the sheet up to a scroll, whose turns are `apart`.
void roll_up(double first_radius, double apart, RandomLayerScene& scene) {
  Points& x = scene.environment.state.positions;
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    // Length s of an Archimedean spiral up to an angle, about r a + apart a^2 / (4 pi).
    const double b = apart / (2 * std::numbers::pi), s = x(i, 0);
    const double angle = (std::sqrt(first_radius * first_radius + 2 * b * s) - first_radius) / b;
    const double radius = first_radius + b * angle;
    x.row(i) << radius * std::cos(angle), x(i, 1), radius * std::sin(angle);
  }
}

void pleat(double height, int pleats, RandomLayerScene& scene) {
  Points& x = scene.environment.state.positions;
  const double length = x.col(0).maxCoeff(), leg = length / (2 * pleats);
  const double advance = std::sqrt(std::max(0.0, leg * leg - height * height)) / leg;
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    const double s = x(i, 0), within = std::fmod(s, 2 * leg);
    x(i, 0) = advance * s;
    x(i, 2) = height / leg * (within < leg ? within : 2 * leg - within);
  }
}

void draw(Lot& lot, double fastest, RandomLayerScene& scene) {
  const double side = lot.uniform(0.08, 0.3), seconds = scene.steps * scene.settings.time_step;
  Environment& environment = scene.environment;
  switch (scene.kind) {
    case LayerSceneKind::pile: {
      std::vector<Sheet> sheets;
      for (int k = 2 + lot.below(4); k > 0; --k) sheets.push_back(draw_sheet(lot, side));
      set_up(lot, joined(sheets), scene);
      stack(lot, side, fastest, scene);
      return;
    }
    case LayerSceneKind::thrown: {
      set_up(lot, draw_sheet(lot, side), scene);
      bend_to_hairpin(side * lot.uniform(0.05, 0.12), scene.environment.state.positions);
      const double speed = fastest * lot.log_uniform(0.05, 1);
      for (Eigen::Index i = 0; i < environment.state.positions.rows(); ++i)
        environment.state.velocities(i, 2) = environment.state.positions(i, 2) > 0 ? -speed : speed;
      environment.obstacles.clear();
      if (lot.chance(0.5)) environment.gravity.setZero();
      return;
    }
    case LayerSceneKind::scroll: {
      set_up(lot, draw_sheet(lot, side), scene);
      const double radius = side * lot.uniform(0.08, 0.12), apart = side * lot.uniform(0.03, 0.06);
      roll_up(radius, std::max(apart, 2 * environment.self_contact->thickness), scene);
      environment.state.positions.col(2).array() += 0.002 - environment.state.positions.col(2).minCoeff();
      const double down = lot.uniform(0, 0.9 * fastest), sideways = lot.uniform(-0.4, 0.4) * fastest;
      environment.state.velocities.rowwise() = Eigen::RowVector3d(sideways, 0, -down);
      return;
    }
    case LayerSceneKind::pleats: {
      set_up(lot, draw_sheet(lot, side), scene);
      const int pleats = 1 + lot.below(3);
      pleat(side / (2 * pleats) * lot.uniform(0.2, 0.45), pleats, scene);
      const double speed = fastest * lot.log_uniform(0.05, 1);
      for (int end = 0; end < 2; ++end) {
        const double at = end == 0 ? 0 : scene.sheet.rest.vertices.col(0).maxCoeff();
        environment.holds.push_back(
            gripped(environment, face_of(scene.sheet, 0, at),
                    straight_path(Vector3d::Zero(), {0.2 * side * (end ? -1 : 1), 0, 0},
                                  std::min(0.2 * side / speed, seconds)),
                    scene.settings.time_step));
      }
      environment.obstacles.clear();
      return;
    }
    case LayerSceneKind::corner: {
      set_up(lot, draw_sheet(lot, side), scene);
      environment.state.positions.col(2).array() += 1e-3;
      const Vector3d start = environment.state.positions.row(0);
      const double right = lot.uniform(0.2, 0.6), back = lot.uniform(0.2, 0.6);
      const double down = lot.uniform(1.5, 6) * environment.self_contact->thickness;
      const double speed = fastest * lot.log_uniform(0.1, 1);
      data::Trajectory path;
      double time = 0;
      Vector3d last = start;
      for (const Vector3d& at : {start, Vector3d(start + side * Vector3d(0.1, 0.1, 0.3)),
                                 Vector3d(start + side * Vector3d(right, back, 0.3)),
                                 Vector3d(start + Vector3d(side * right, side * back, down))}) {
        time += (at - last).norm() / speed;
        path.times.push_back(time);
        path.poses.emplace_back(Eigen::Translation3d(at));
        last = at;
      }
      environment.holds = {gripped(environment, {0}, path, scene.settings.time_step)};
      scene.steps = std::min(150, static_cast<int>(time / scene.settings.time_step) + 10);
      return;
    }
    case LayerSceneKind::blocks: {
      std::vector<Sheet> bodies;
      for (int k = 2 + lot.below(3); k > 0; --k) {
        const double width = side * lot.uniform(0.3, 0.6), height = side * lot.uniform(0.1, 0.4);
        if (lot.chance(0.5))
          bodies.push_back(solid_box({width, width, height}, {2 + lot.below(2), 2 + lot.below(2), 1}));
        else
          bodies.push_back(draw_sheet(lot, side));
      }
      set_up(lot, joined(bodies), scene);
      stack(lot, side, fastest, scene);
      return;
    }
  }
}

Eigen::VectorXd masses(const RandomLayerScene& scene) {
  Eigen::VectorXd all(scene.sheet.rest.vertices.rows());
  for (std::size_t b = 0; b < scene.sheet.bodies.size(); ++b) {
    const Body& body = scene.sheet.bodies[b];
    auto own = all.segment(body.first_vertex, body.vertex_count);
    if (body.is_solid())
      own = scene.environment.solids.at(static_cast<int>(b)).density *
            scene.sheet.vertex_volume.segment(body.first_vertex, body.vertex_count);
    else
      own = scene.environment.materials[b].areal_density *
            scene.sheet.vertex_area.segment(body.first_vertex, body.vertex_count);
  }
  return all;
}

}  // namespace

const char* to_string(LayerSceneKind kind) {
  static constexpr const char* names[] = {"pile", "thrown", "scroll", "pleats", "corner", "blocks"};
  return names[static_cast<int>(kind)];
}

RandomLayerScene random_layer_scene(unsigned long seed, double fastest) {
  Lot lot(seed + 3'000'003);
  while (true) {
    RandomLayerScene scene;
    scene.kind = static_cast<LayerSceneKind>(lot.below(static_cast<int>(LayerSceneKind::last) + 1));
    scene.settings.time_step = lot.log_uniform(0.001, 0.03);
    draw(lot, fastest, scene);
    PairSurface surface(scene.sheet);
    if (first_intersection(surface, scene.environment.state.positions)) continue;
    char text[200];
    const SelfContact& contact = *scene.environment.self_contact;
    std::snprintf(text, sizeof text,
                  "%td vertices, %zu bodies, thickness %.3g m, friction %.2f, pressure %.3g Pa",
                  scene.sheet.rest.vertices.rows(), scene.sheet.bodies.size(), contact.thickness,
                  contact.friction, contact.pressure);
    scene.description = text;
    return scene;
  }
}

LayerFindings observe(RandomLayerScene scene) {
  Environment& environment = scene.environment;
  LayerFindings found;
  found.steps = scene.steps;
  Solver solver(scene.sheet, scene.settings);
  PairSurface surface(scene.sheet);
  const Eigen::VectorXd mass = masses(scene);
  double energy = 0, put_in = 0.5 * mass.dot(environment.state.velocities.rowwise().squaredNorm());
  for (int step = 0; step < scene.steps; ++step) {
    const Points before = environment.state.positions;
    const StepReport report = solver.step(environment);
    const Points& after = environment.state.positions;
    found.finite = found.finite && after.allFinite() && environment.state.velocities.allFinite() &&
                   std::isfinite(report.residual);
    if (!found.finite) return found;
    found.passing += first_intersection(surface, after).has_value();
    found.halved += report.substeps > 1;
    found.touching += report.layer_touches > 0;
    found.iterations += report.iterations;
    if (!report.converged) {
      ++found.unconverged;
      found.residual_max = std::max(found.residual_max, report.residual);
    }
    const double now = report.kinetic + report.membrane + report.bending + report.solid + report.layers +
                       report.gravitational;
    // The first step starts from an energy that no report tells.
    const double gain = step == 0 ? 0 : now - energy - report.work;
    if (step == 0) put_in += std::abs(report.membrane + report.bending + report.solid + report.layers);
    put_in += std::max(report.work, 0.0) + std::max(0.0, mass.dot((after - before) * environment.gravity));
    if (report.converged)
      found.energy_gain_share =
          std::max(found.energy_gain_share, gain / std::max(put_in, 1e-8 * mass.sum() * 9.81));
    energy = now;
  }
  return found;
}

}  // namespace flash::sim
