#include "sim/step/contact_force.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "sim/oracle/projective.h"
#include "tests/sim/sheet_scene.h"
#include "tests/sim/solid_scene.h"
#include "tests/sim/surface_shapes.h"

namespace flash::sim {
namespace {

using Eigen::Vector3d;

constexpr double g = 9.81;

double mass_of(const Sheet& sheet, const Environment& environment) {
  return environment.materials[0].areal_density * sheet.vertex_area.sum();
}

/// Most that the sum over n vertices of a unit of mass can be out of balance: sqrt(n) |r|, |r| <= tolerance
/// |M g|, and |M g| of one vertex is below that of all.
double unbalanced(const StepReport& report, double mass, Eigen::Index vertices) {
  return (std::sqrt(static_cast<double>(vertices)) * report.residual + 1e-9) * mass * g;
}

Vector3d sum_of(const std::vector<ContactForce>& contacts) {
  Vector3d sum = Vector3d::Zero();
  for (const ContactForce& contact : contacts) sum += contact.force();
  return sum;
}

/// What holds of any contact: a push along a unit normal, and friction across it, in the cone.
void expect_admissible(const std::vector<ContactForce>& contacts, double friction) {
  for (const ContactForce& contact : contacts) {
    EXPECT_NEAR(contact.normal.norm(), 1, 1e-12);
    EXPECT_GT(contact.normal_force, 0);
    EXPECT_LE(std::abs(contact.friction.dot(contact.normal)), 1e-9 * contact.normal_force);
    EXPECT_LE(contact.friction.norm(), friction * contact.normal_force * (1 + 1e-9));
  }
}

TEST(ContactForce, ARestingSheetPressesByItsWeight) {
  const Sheet sheet = small_sheet();
  Environment environment = environment_of(sheet);
  environment.obstacles = {{Plane{}}};
  Solver solver(sheet, {.tolerance = 1e-8});
  EXPECT_TRUE(solver.contacts(environment).empty());
  StepReport report;
  for (int k = 0; k < 20; ++k) report = solver.step(environment);
  const std::vector<ContactForce> contacts = solver.contacts(environment);
  const double mass = mass_of(sheet, environment);
  ASSERT_EQ(std::ssize(contacts), sheet.rest.vertices.rows());
  double normal = 0;
  for (std::size_t k = 0; k < contacts.size(); ++k) {
    const ContactForce& contact = contacts[k];
    EXPECT_EQ(contact.vertices, (std::array<int, 4>{static_cast<int>(k), -1, -1, -1}));
    EXPECT_EQ(contact.normal, Vector3d::UnitZ());
    EXPECT_EQ(contact.point, environment.state.positions.row(static_cast<int>(k)).transpose());
    normal += contact.normal_force;
  }
  EXPECT_NEAR(normal, mass * g, unbalanced(report, mass, sheet.rest.vertices.rows()));
  // The report sums the same forces on its own, in the same order.
  EXPECT_LE((sum_of(contacts) - report.obstacle_forces[0]).norm(), 1e-14 * mass * g);
}

TEST(ContactForce, ABlockOnAnInclineIsHeldByFriction) {
  constexpr double friction = 0.3, angle = 0.2;  // tan is 0.203
  const Sheet sheet = solid_box({0.06, 0.05, 0.02}, {4, 4, 2});
  data::SolidMaterial soft;
  soft.youngs_modulus = 1e5;
  soft.density = 500;
  soft.friction = friction;
  Environment environment = solid_environment(sheet, soft);
  const double mass = soft.density * sheet.vertex_volume.sum();
  environment.gravity = g * Vector3d(std::sin(angle), 0, -std::cos(angle));
  environment.obstacles = {{Plane{}}};
  // Long steps without velocity: at rest, no inertia is left.
  const StepReport settled = settle(sheet, environment);
  ASSERT_TRUE(settled.converged);
  Solver solver(sheet, {.time_step = 1.0, .tolerance = 1e-8});
  const StepReport report = solver.step(environment);
  const std::vector<ContactForce> contacts = solver.contacts(environment);
  EXPECT_EQ(contacts.size(), 25u);
  expect_admissible(contacts, friction);
  Vector3d along = Vector3d::Zero();
  double normal = 0;
  for (const ContactForce& contact : contacts) {
    along += contact.friction;
    normal += contact.normal_force;
  }
  const double left = unbalanced(report, mass, sheet.rest.vertices.rows()) +
                      mass * environment.state.velocities.rowwise().norm().maxCoeff();
  EXPECT_NEAR(along.x(), -mass * g * std::sin(angle), left);
  EXPECT_NEAR(along.y(), 0, left);
  EXPECT_NEAR(normal, mass * g * std::cos(angle), left);
}

/// A sheet that has fallen on an obstacle, and its contacts there.
std::vector<ContactForce> contacts_on(const Obstacle& obstacle, double friction) {
  const Sheet sheet = small_sheet(8, 0.12);
  Environment environment = environment_of(sheet);
  environment.materials[0].friction = friction;
  environment.materials[0].air_drag = 5;
  environment.state.positions.rowwise() += Eigen::RowVector3d(-0.06, -0.06, 0.0005);
  environment.obstacles = {obstacle};
  Solver solver(sheet, {.tolerance = 1e-6});
  StepReport report;
  for (int k = 0; k < 40; ++k) report = solver.step(environment);
  const std::vector<ContactForce> contacts = solver.contacts(environment);
  EXPECT_TRUE(report.converged);
  EXPECT_GT(contacts.size(), 2u);
  expect_admissible(contacts, friction);
  if (report.substeps == 1) {
    EXPECT_LE((sum_of(contacts) - report.obstacle_forces[0]).norm(),
              1e-12 * report.obstacle_forces[0].norm());
  }
  return contacts;
}

TEST(ContactForce, ASphereACylinderAndACapsulePushAlongTheirRadii) {
  constexpr double radius = 0.03, friction = 0.4;
  const Vector3d centre(0, 0, -radius), axis = Vector3d::UnitY();
  for (const double half_length : {0.0, 0.02, 1.0}) {
    Obstacle obstacle{Capsule{centre, axis, half_length, radius}};
    if (half_length == 1) obstacle = {Cylinder{centre, axis, radius}};
    for (const ContactForce& contact : contacts_on(obstacle, friction)) {
      const double along = std::clamp((contact.point - centre).dot(axis), -half_length, half_length);
      const Vector3d out = contact.point - centre - along * axis;
      EXPECT_NEAR(out.norm(), radius, 1e-9);  // the tolerance of gaps
      EXPECT_LE((contact.normal - out.normalized()).norm(), 1e-9);
    }
  }
}

TEST(ContactForce, ABoxAndItsTrianglesPushAlongTheirFaces) {
  const Vector3d half(0.04, 0.04, 0.02);
  const Eigen::Isometry3d pose(Eigen::Translation3d(0, 0, -half.z()));
  for (const Obstacle& obstacle :
       {Obstacle{Box{half, pose}}, Obstacle{mesh_shape(box_surface(half, 2), 0, pose)}}) {
    int on_top = 0;
    for (const ContactForce& contact : contacts_on(obstacle, 0.3)) {
      EXPECT_EQ(contact.other, 0);
      // Beside the top, edges push along directions between those of their faces.
      if (contact.point.head<2>().cwiseAbs().maxCoeff() > half.x() - 1e-6) continue;
      EXPECT_NEAR(contact.point.z(), 0, 1e-9);
      EXPECT_LE((contact.normal - Vector3d::UnitZ()).norm(), 1e-12);
      ++on_top;
    }
    EXPECT_GT(on_top, 2);
  }
}

TEST(ContactForce, TheProjectiveMethodTellsItsContactsToo) {
  constexpr double friction = 0.3, angle = 0.2;
  const Sheet sheet = small_sheet();
  Environment environment = environment_of(sheet);
  environment.materials[0].friction = friction;
  environment.gravity = g * Vector3d(std::sin(angle), 0, -std::cos(angle));
  environment.obstacles = {{Plane{}}};
  ProjectiveSolver solver(sheet, {.iterations = 200, .tolerance = 1e-6});
  EXPECT_TRUE(solver.contacts(environment).empty());
  ProjectiveReport report;
  for (int k = 0; k < 20; ++k) report = solver.step(environment);
  ASSERT_TRUE(report.converged);
  const std::vector<ContactForce> contacts = solver.contacts(environment);
  const double mass = mass_of(sheet, environment);
  expect_admissible(contacts, friction);
  EXPECT_LE((sum_of(contacts) - report.obstacle_forces[0]).norm(), 1e-12 * mass * g);
  // What the contacts leave of the weight accelerates the sheet: it has come to rest.
  const double moving = mass * environment.state.velocities.rowwise().norm().maxCoeff() / 0.01;
  EXPECT_LE((sum_of(contacts) + mass * environment.gravity).norm(),
            unbalanced(report, mass, sheet.rest.vertices.rows()) + 2 * moving);
}

}  // namespace
}  // namespace flash::sim
