#include "sim/step/resultants.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "tests/sim/layer_scenes.h"

namespace flash::sim {
namespace {

using Eigen::Vector3d;

constexpr SelfContact cloth{.thickness = 1e-3, .friction = 0.3, .pressure = 2500};

TEST(Resultants, BothSidesOfAContactAreSummedAtTheirOwnPoints) {
  ContactForce on_obstacle{.body = 1, .other = 0, .vertices = {7, -1, -1, -1}};
  on_obstacle.point = on_obstacle.other_point = {1, 0, 0};
  on_obstacle.normal = Vector3d::UnitZ();
  on_obstacle.normal_force = 2;
  on_obstacle.friction = {0, 0.5, 0};
  ContactForce between{.kind = ContactKind::edge_edge, .body = 0, .other = 1, .vertices = {0, 1, 7, 8}};
  between.point = {0, 0, 1};
  between.other_point = {0, 0, 2};
  between.normal = -Vector3d::UnitZ();
  between.normal_force = 3;
  between.friction = {0.25, 0, 0};
  between.couple = {0, 0, 0.125};
  const Resultants sums = resultants_of(std::vector{on_obstacle, between}, 2, 2);
  EXPECT_EQ(sums.bodies[0].force, Vector3d(0.25, 0, -3));
  EXPECT_EQ(sums.bodies[0].torque, Vector3d(0, 0.25, 0.125));
  EXPECT_EQ(sums.bodies[1].force, Vector3d(-0.25, 0.5, 5));
  EXPECT_EQ(sums.bodies[1].torque, Vector3d(0, -2 - 0.5, 0.5 - 0.125));
  EXPECT_EQ(sums.obstacles[0].force, Vector3d(0, -0.5, -2));
  EXPECT_EQ(sums.obstacles[0].torque, Vector3d(0, 2, -0.5));
  EXPECT_EQ(sums.obstacles[1].force, Vector3d::Zero());
}

/// Mass of each vertex [kg].
Eigen::VectorXd masses_of(const LayerScene& scene) {
  Eigen::VectorXd mass = scene.sheet.vertex_area;
  for (std::size_t b = 0; b < scene.sheet.bodies.size(); ++b) {
    const Body& body = scene.sheet.bodies[b];
    const auto solid = scene.environment.solids.find(static_cast<int>(b));
    if (solid != scene.environment.solids.end())
      rows_of(body, mass) = solid->second.density * rows_of(body, scene.sheet.vertex_volume);
    else
      rows_of(body, mass) *= scene.environment.materials[b].areal_density;
  }
  return mass;
}

/// What the equation of motion says of each body that nothing holds, from its motion alone: the contacts' sum
/// of forces is sum m ((v1 - v0) / h - g), and that of torques is sum x1 x m ((v1 - v0) / h - g). Elastic
/// forces have neither. Returns the largest couple of nearly parallel edges [N m].
double expect_newton_and_euler(LayerScene scene, int steps, std::size_t first_free_body) {
  constexpr double h = 0.01, tolerance = 1e-7;
  Solver solver(scene.sheet, {.time_step = h, .tolerance = tolerance});
  const Eigen::VectorXd mass = masses_of(scene);
  Environment& environment = scene.environment;
  const double reach = scene.sheet.rest.vertices.cwiseAbs().maxCoeff();
  double couple = 0;
  int checked = 0;
  for (int k = 0; k < steps; ++k) {
    const data::Points before = environment.state.velocities;
    const StepReport report = solver.step(environment);
    if (report.substeps > 1 || !report.converged) continue;
    const std::vector<ContactForce> contacts = solver.contacts(environment);
    const Resultants sums = resultants_of(contacts, scene.sheet.bodies.size(), environment.obstacles.size());
    for (const ContactForce& contact : contacts) {
      couple = std::max(couple, contact.couple.norm());
      if (contact.kind == ContactKind::vertex_obstacle) continue;
      EXPECT_LE(contact.friction.norm(), cloth.friction * contact.normal_force * (1 + 1e-9));
      EXPECT_LE(std::abs(contact.friction.dot(contact.normal)), 1e-9 * contact.normal_force);
    }
    for (std::size_t b = first_free_body; b < scene.sheet.bodies.size(); ++b) {
      const Body& body = scene.sheet.bodies[b];
      Vector3d force = Vector3d::Zero(), torque = force;
      for (int i = body.first_vertex; i < body.first_vertex + body.vertex_count; ++i) {
        const Vector3d x = environment.state.positions.row(i),
                       v = environment.state.velocities.row(i) - before.row(i);
        const Vector3d needed = mass[i] * (v / h - environment.gravity);
        force += needed;
        torque += x.cross(needed);
      }
      // |sum r| <= sqrt(n) |r| with |r| <= residual |M g|.
      const double left =
          std::sqrt(body.vertex_count) * (report.residual + 1e-9) * rows_of(body, mass).norm() * 9.81;
      EXPECT_LE((sums.bodies[b].force - force).norm(), left) << k << " body " << b;
      EXPECT_LE((sums.bodies[b].torque - torque).norm(), 2 * reach * left) << k << " body " << b;
      ++checked;
    }
  }
  EXPECT_GT(checked, steps / 2);
  return couple;
}

TEST(Resultants, AreWhatTheMotionOfBodiesAsksFor) {
  expect_newton_and_euler(pile(3, cloth, 0.1, 6), 20, 0);
  expect_newton_and_euler(layer_on_incline(0.32, cloth), 20, 0);
  expect_newton_and_euler(thrown(cloth, 1), 20, 0);  // a sheet against itself
  expect_newton_and_euler(block_on_incline(0.2, cloth, true), 20, 1);
}

TEST(Resultants, HoldTheCouplesOfNearlyParallelEdges) {
  // Turned by 0.05 the edges of two blocks cross at a squared sine of 0.0025, below 0.01.
  const double couple = expect_newton_and_euler(
      block_on_incline(0.2, cloth, false, {.lower = 4, .upper = 4, .turn = 0.05}), 20, 1);
  EXPECT_GT(couple, 0);
}

TEST(Resultants, ARestingPileCarriesItselfByActionAndReaction) {
  LayerScene scene = pile(2, cloth, 0.1, 6);
  Solver solver(scene.sheet, {.tolerance = 1e-6});
  for (int k = 0; k < 100; ++k) solver.step(scene.environment);
  const std::vector<ContactForce> contacts = solver.contacts(scene.environment);
  const Resultants sums = resultants_of(contacts, 2, 1);
  const double weight = 0.2 * 0.1 * 0.1 * 9.81;
  const double left = 1e-4 * weight;  // sqrt(n) times the tolerance, and what still moves
  EXPECT_NEAR(sums.bodies[0].force.z(), weight, left);
  EXPECT_NEAR(sums.bodies[1].force.z(), weight, left);
  EXPECT_NEAR(sums.obstacles[0].force.z(), -2 * weight, left);
  EXPECT_LE((sums.bodies[0].force + sums.bodies[1].force + sums.obstacles[0].force).norm(), 1e-13);
  // Normal forces of a pair run along one line; friction at both of its points is their distance apart.
  double friction = 0;
  Vector3d between = Vector3d::Zero();
  for (const ContactForce& contact : contacts) {
    if (contact.kind == ContactKind::vertex_obstacle) continue;
    friction += contact.friction.norm();
    between += contact.body == 1 ? contact.force() : Vector3d(-contact.force());
    EXPECT_NE(contact.body, contact.other);
    EXPECT_LE((contact.point - contact.other_point).norm(), cloth.thickness);
    EXPECT_LE((contact.point - contact.other_point).normalized().cross(contact.normal).norm(), 1e-9);
  }
  EXPECT_LE((between - sums.bodies[1].force).norm(), 1e-13);
  EXPECT_LE((sums.bodies[0].torque + sums.bodies[1].torque + sums.obstacles[0].torque).norm(),
            cloth.thickness * friction + 1e-13);
}

}  // namespace
}  // namespace flash::sim
