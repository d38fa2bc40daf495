#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "tests/sim/properties/drawn_world.h"

namespace flash::sim {
namespace {

using Eigen::Vector3d;

/// Forces on the vertices that the motion of a step asks for beyond weight, loads and air: m (v1 - v0) / h
/// - m g - loads + c m v1 [N].
data::Points remaining_forces(const Environment& before, const Environment& after,
                              const Eigen::VectorXd& mass, double time_step) {
  data::Points force = (after.state.velocities - before.state.velocities) / time_step +
                       after.materials[0].air_drag * after.state.velocities;
  force.rowwise() -= after.gravity.transpose();
  force = mass.asDiagonal() * force;
  for (const Load& load : after.loads) force.row(load.vertex) -= load.force.transpose();
  return force;
}

// Nothing but weight, loads and air acts on a sheet in flight, so that what is left of the forces neither
// pushes nor, the forces being those at the end of the step, turns it: sum f = 0 and sum x1 x f = 0.
RC_GTEST_PROP(Properties, InternalForcesNeitherPushNorTurn, ()) {
  const Sheet sheet = draw_sheet();
  Environment environment = draw_flight(sheet);
  environment.materials[0].stiffness_damping = 0;
  if (draw_chance(0.3)) environment.loads.push_back({0, draw(0, 0.05) * draw_direction()});
  const Eigen::VectorXd mass = masses_of(sheet, environment.materials[0]);
  const SolverSettings settings{.time_step = draw_log(1e-3, 2e-2), .tolerance = draw_log(1e-6, 1e-3)};
  Solver solver(sheet, settings);
  for (int step = 0; step < 6; ++step) {
    const Environment before = environment;
    const StepReport report = solver.step(environment);
    RC_ASSERT(report.converged);
    if (report.substeps > 1) continue;  // air and turning forces then act within the step too
    const data::Points force = remaining_forces(before, environment, mass, settings.time_step);
    const double unbalanced = unbalanced_sum(environment, mass, report);
    RC_ASSERT(force.colwise().sum().norm() <= unbalanced);
    const Eigen::RowVector3d middle = environment.state.positions.colwise().mean();
    Vector3d turn = Vector3d::Zero();
    double reach = 0;
    for (Eigen::Index i = 0; i < force.rows(); ++i) {
      const Vector3d arm = environment.state.positions.row(i) - middle;
      turn += arm.cross(Vector3d(force.row(i)));
      reach = std::max(reach, arm.norm());
    }
    RC_ASSERT(turn.norm() <= reach * unbalanced);
  }
}

// Damping by stiffness pushes no sheet as a whole either, in a step in parts as in one.
RC_GTEST_PROP(Properties, DampingDoesNotPush, ()) {
  const Sheet sheet = draw_sheet();
  Environment environment = draw_flight(sheet);
  environment.materials[0].air_drag = 0;
  environment.materials[0].stiffness_damping = draw_log(1e-4, 1e-2);
  const Eigen::VectorXd mass = masses_of(sheet, environment.materials[0]);
  const SolverSettings settings{.time_step = draw_log(1e-3, 2e-2), .tolerance = draw_log(1e-6, 1e-3)};
  Solver solver(sheet, settings);
  for (int step = 0; step < 6; ++step) {
    const Environment before = environment;
    const StepReport report = solver.step(environment);
    RC_ASSERT(report.converged);
    RC_ASSERT(remaining_forces(before, environment, mass, settings.time_step).colwise().sum().norm() <=
              unbalanced_sum(environment, mass, report));
  }
}

}  // namespace
}  // namespace flash::sim
