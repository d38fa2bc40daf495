// Fingers that hold a soft cube by friction.

#include <gtest/gtest.h>

#include <cmath>

#include "sim/scene/sheet.h"
#include "tests/sim/sheet_scene.h"
#include "tests/sim/solid_scene.h"

namespace flash::sim {
namespace {

using Eigen::Vector3d;

constexpr double h = 0.02, side = 0.02;  // [s], of the cube [m]
constexpr double closed = 0.2;           // when the fingers have closed [s]
constexpr double weight = 4000 * side * side * side * 9.81;

data::SolidMaterial soft(double density) {
  data::SolidMaterial material;
  material.constitutive = data::Constitutive::tet_corotated;
  material.youngs_modulus = 1e5;
  material.poissons_ratio = 0.3;
  material.density = density;
  return material;
}

/// How a cube stands between two fingers: the force of one on it [N], and how far it sank in all and sinks in
/// a step [m].
struct Pinched {
  double normal = 0, sank = 0, sinks = 0;
};

/// Slow steps, each without velocity at its start. The middle of the cube is held until the fingers have
/// closed.
Pinched settled(const Sheet& sheet, Environment& environment, int middle, bool soft_fingers, int steps) {
  environment.holds.push_back({.vertices = {middle}, .to = closed + h});
  Solver solver(sheet, {.time_step = h, .tolerance = 1e-6});
  Pinched pinched;
  for (int k = 0; k < steps; ++k) {
    const double before = environment.state.positions(middle, 2);
    const StepReport report = solver.step(environment);
    EXPECT_TRUE(report.converged) << k;
    environment.state.velocities.setZero();
    pinched.normal = (soft_fingers ? report.hold_forces : report.obstacle_forces)[0].x();
    pinched.sinks = before - environment.state.positions(middle, 2);
    pinched.sank += pinched.sinks;
  }
  return pinched;
}

int middle_of(const Sheet& sheet, int first, int count) {
  const auto rest =
      sheet.rest.vertices.middleRows(first, count).rowwise() - Eigen::RowVector3d::Constant(0.5 * side);
  Eigen::Index nearest = 0;
  rest.rowwise().norm().minCoeff(&nearest);
  return first + static_cast<int>(nearest);
}

Pinched between_rigid_fingers(double friction) {
  constexpr double half = 0.03, press = 1e-4;  // of a finger; by which one presses [m]
  const Sheet cube = solid_box(Vector3d::Constant(side), {4, 4, 4});
  Environment environment = solid_environment(cube, soft(4000));
  for (const double way : {-1.0, 1.0}) {
    const Vector3d middle = Vector3d::Constant(0.5 * side), out(way, 0, 0);
    const Vector3d open = middle + (0.5 * side + half + press) * out,
                   shut = middle + (0.5 * side + half - press) * out;
    environment.obstacles.push_back({.shape = Box{.half_extents = Vector3d::Constant(half)},
                                     .friction = {friction},
                                     .frame = add_frame(environment, straight_path(open, shut, closed), h)});
  }
  return settled(cube, environment, middle_of(cube, 0, static_cast<int>(cube.rest.vertices.rows())), false,
                 100);
}

TEST(Pinch, TwoRigidFingersHoldASoftCubeWhereTwiceTheirFrictionIsItsWeight) {
  double slides = 0.38, holds = 0.4;
  Pinched sliding = between_rigid_fingers(slides), held = between_rigid_fingers(holds);
  EXPECT_GT(sliding.sinks, 1e-6);
  EXPECT_LT(held.sinks, 1e-6);
  while (holds - slides > 4e-4) {
    const double friction = 0.5 * (slides + holds);
    const Pinched pinched = between_rigid_fingers(friction);
    const bool slid = pinched.sinks > 1e-6;
    (slid ? slides : holds) = friction;
    (slid ? sliding : held) = pinched;
  }
  EXPECT_NEAR(2 * holds * held.normal, weight, 5e-3 * weight);
  EXPECT_NEAR(2 * slides * sliding.normal, weight, 5e-3 * weight);
}

/// The cube dents fingers that are as soft as it is, and that holds it, too. So it stays below the friction
/// that rigid fingers need, by a tenth here.
TEST(Pinch, TwoSoftFingersHoldASoftCubeByFriction) {
  const SelfContact contact{.thickness = 1e-3, .friction = 0.5, .pressure = 2500};
  constexpr double thick = 0.01, apart = 1.5e-3, press = -4e-4;
  const Sheet cube = solid_box(Vector3d::Constant(side), {4, 4, 4}),
              finger = solid_box({thick, 0.03, 0.03}, {1, 4, 4});
  const auto pinched = [&](double friction) {
    const std::vector<Sheet> bodies = {finger, cube, finger};
    const Sheet sheet = joined(bodies);
    Environment environment = environment_of(sheet);
    environment.materials.resize(3);
    for (int body = 0; body < 3; ++body) environment.solids[body] = soft(body == 1 ? 4000 : 1000);
    environment.self_contact = contact;
    environment.self_contact->friction = friction;
    for (const int body : {0, 2}) {
      const double out = body == 0 ? -1 : 1;
      const Vector3d place(body == 0 ? -apart - thick : side + apart, -0.0063, -0.0047);
      rows_of(sheet.bodies[static_cast<std::size_t>(body)], environment.state.positions).rowwise() +=
          place.transpose();
      std::vector<int> back = face_of(finger, 0, body == 0 ? 0 : thick);
      for (int& vertex : back) vertex += sheet.bodies[static_cast<std::size_t>(body)].first_vertex;
      const auto path = straight_path(Vector3d::Zero(), Vector3d(-out * (apart + press), 0, 0), closed);
      environment.holds.push_back(gripped(environment, back, path, h));
    }
    const Body& middle = sheet.bodies[1];
    return settled(sheet, environment,
                   middle_of(sheet, middle.first_vertex, static_cast<int>(cube.rest.vertices.rows())), true,
                   40);
  };
  const Pinched held = pinched(contact.friction);
  constexpr double sheared = 5e-4,
                   slid = 1e-3;  // what it sinks at most where it holds, at least where it slides [m]
  EXPECT_LT(held.sinks, 1e-6);
  EXPECT_LT(held.sank, sheared);
  EXPECT_GT(2 * contact.friction * held.normal, weight);
  const double needed = weight / (2 * held.normal);
  EXPECT_LT(pinched(1.1 * needed).sank, sheared);
  EXPECT_GT(pinched(0.7 * needed).sank, slid);
}

}  // namespace
}  // namespace flash::sim
