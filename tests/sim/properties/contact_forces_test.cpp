#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/sim/obstacle_depth.h"
#include "tests/sim/properties/drawn_world.h"

namespace flash::sim {
namespace {

using Eigen::Vector3d;

struct Run {
  Sheet sheet = draw_sheet();
  Environment environment = draw_world(sheet);
  int steps = 20;
  SolverSettings settings{.time_step = draw_log(2e-3, 2e-2), .tolerance = draw_log(1e-6, 1e-3)};
  Eigen::VectorXd mass = masses_of(sheet, environment.materials[0]);
  Solver solver{sheet, settings};
};

std::vector<bool> held_vertices(const Environment& environment) {
  std::vector<bool> held(static_cast<std::size_t>(environment.state.positions.rows()), false);
  for (const Hold& hold : environment.holds)
    for (const int i : hold.vertices) held[static_cast<std::size_t>(i)] = true;
  return held;
}

// No vertex is deeper in an obstacle than the step reported, and none that nothing holds is in one at all.
RC_GTEST_PROP(Properties, NoVertexIsBelowASurfaceUnreported, ()) {
  Run run;
  const std::vector<bool> held = held_vertices(run.environment);
  bool touched = false;
  for (int step = 0; step < run.steps; ++step) {
    const StepReport report = run.solver.step(run.environment);
    for (const Vector3d& force : report.obstacle_forces) touched = touched || force.norm() > 0;
    for (const Obstacle& obstacle : run.environment.obstacles)
      for (std::size_t i = 0; i < held.size(); ++i) {
        const double depth =
            depth_in(run.environment, obstacle, run.environment.state.positions.row(static_cast<int>(i)),
                     run.environment.state.time);
        RC_ASSERT(depth <= report.penetration_max + 1e-9);
        if (!held[i] && report.converged) RC_ASSERT(depth <= 2e-9);  // the solver's on gaps, and rounding
      }
  }
  RC_CLASSIFY(touched);
}

// What holds and obstacles are reported to do is what weight, loads, air and inertia ask for:
// sum m (v1 - v0) / h = sum of all forces.
RC_GTEST_PROP(Properties, ReportedForcesBalanceWeightAndInertia, ()) {
  Run run;
  Environment& environment = run.environment;
  for (int step = 0; step < run.steps; ++step) {
    const State before = environment.state;
    const StepReport report = run.solver.step(environment);
    // In a step in parts the air acts at velocities that only its parts know.
    if (!report.converged || (report.substeps > 1 && environment.materials[0].air_drag > 0)) continue;
    const data::Points& v = environment.state.velocities;
    Vector3d asked = ((run.mass.asDiagonal() * (v - before.velocities)) / run.settings.time_step +
                      environment.materials[0].air_drag * (run.mass.asDiagonal() * v))
                         .colwise()
                         .sum()
                         .transpose();
    asked -= run.mass.sum() * environment.gravity;
    for (const Load& load : environment.loads) asked -= load.force;
    Vector3d found = Vector3d::Zero();
    double largest = 0;
    const auto add = [&](const Vector3d& force) {
      found += force;
      largest += force.norm();
    };
    std::ranges::for_each(report.hold_forces, add);
    std::ranges::for_each(report.obstacle_forces, add);
    RC_ASSERT((asked - found).norm() <= unbalanced_sum(environment, run.mass, report) + 1e-12 * largest);
  }
}

// A plane pushes, and drags no harder than friction lets it: the cone is convex, so that the sum of its
// vertices' forces lies in it too.
RC_GTEST_PROP(Properties, ForcesOfPlanesAreInTheConeOfFriction, ()) {
  Run run;
  for (int step = 0; step < run.steps; ++step) {
    const StepReport report = run.solver.step(run.environment);
    if (!report.converged) continue;
    for (std::size_t k = 0; k < run.environment.obstacles.size(); ++k) {
      const Obstacle& obstacle = run.environment.obstacles[k];
      const auto* plane = std::get_if<Plane>(&obstacle.shape);
      if (plane == nullptr) continue;
      const double friction = friction_between(run.environment, obstacle, 0);
      const double normal = report.obstacle_forces[k].dot(plane->normal);
      const double along = (report.obstacle_forces[k] - normal * plane->normal).norm();
      const double unbalanced = unbalanced_sum(run.environment, run.mass, report);
      RC_ASSERT(normal >= -unbalanced);
      RC_ASSERT(along <= friction * normal + (1 + friction) * unbalanced);
    }
  }
}

// The contacts of any step are what its report sums, and each of them is in the cone of its obstacle.
RC_GTEST_PROP(Properties, ForcesOfContactsAreInTheirConesAndAddUp, ()) {
  Run run;
  const Environment& environment = run.environment;
  for (int step = 0; step < run.steps; ++step) {
    const StepReport report = run.solver.step(run.environment);
    std::vector<Vector3d> sums(environment.obstacles.size(), Vector3d::Zero());
    double largest = 0;
    for (const ContactForce& contact : run.solver.contacts(environment)) {
      const Obstacle& obstacle = environment.obstacles[static_cast<std::size_t>(contact.other)];
      const double bound = friction_between(environment, obstacle, 0) * contact.normal_force;
      const double rounding = 1e-12 * contact.normal_force;
      RC_ASSERT(contact.kind == ContactKind::vertex_obstacle && contact.normal_force > 0);
      RC_ASSERT(std::abs(contact.normal.norm() - 1) < 1e-12);
      // Of a way of centimetres over bristles of 4e-8 m, which friction is in proportion to.
      RC_ASSERT(std::abs(contact.friction.dot(contact.normal)) <= 1e-9 * contact.normal_force);
      RC_ASSERT(contact.friction.norm() <= bound + rounding);
      sums[static_cast<std::size_t>(contact.other)] += contact.force();
      largest += contact.force().norm();
    }
    if (report.substeps > 1) continue;  // the report has the mean over the parts
    for (std::size_t k = 0; k < sums.size(); ++k)
      RC_ASSERT((sums[k] - report.obstacle_forces[k]).norm() <= 1e-12 * largest);
  }
}

}  // namespace
}  // namespace flash::sim
