#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>

#include "sim/batch.h"
#include "tests/sim/properties/drawn_world.h"

namespace flash::sim {
namespace {

// The order of a batch's environments, its threads and the pieces it advances in change no bit.
RC_GTEST_PROP(Properties, NeitherOrderNorThreadsChangeABatch, ()) {
  const Sheet sheet = draw_sheet();
  const auto plan = make_sheet_plan(sheet);
  const int count = 2 + *rc::gen::inRange(0, 3), steps = 8;
  std::vector<Environment> environments, reordered;
  for (int e = 0; e < count; ++e) {
    environments.push_back(draw_fall(sheet));
    environments.back().holds.push_back(draw_grasp(environments.back()));
  }
  const std::vector<int> order = draw_order(count);
  for (const int e : order) reordered.push_back(environments[static_cast<std::size_t>(e)]);
  const SolverSettings settings{.time_step = draw_log(2e-3, 2e-2)};
  Batch first(plan, environments, {.solver = settings, .steps = steps, .threads = 1});
  Batch second(plan, reordered, {.solver = settings, .steps = steps, .threads = *rc::gen::inRange(1, 5)});
  first.advance(steps);
  const int piece = *rc::gen::inRange(0, steps + 1);
  second.advance(piece);
  second.advance(steps - piece);
  for (int e = 0; e < count; ++e) {
    const int of_first = order[static_cast<std::size_t>(e)];
    RC_ASSERT(second.state(e).positions == first.state(of_first).positions);
    RC_ASSERT(second.state(e).velocities == first.state(of_first).velocities);
    for (int step = 0; step < steps; ++step)
      RC_ASSERT(second.stats(e)[step].solves == first.stats(of_first)[step].solves);
  }
}

/// Row k of the result is row order[k].
data::Points rows_in_order(const data::Points& rows, const std::vector<int>& order) {
  data::Points result(rows.rows(), 3);
  for (Eigen::Index k = 0; k < rows.rows(); ++k) result.row(k) = rows.row(order[static_cast<std::size_t>(k)]);
  return result;
}

/// The same surface with its vertices and triangles in another order, each triangle from another corner.
data::TriangleMesh renumbered(const data::TriangleMesh& mesh, const std::vector<int>& order) {
  std::vector<int> number(order.size());
  for (std::size_t k = 0; k < order.size(); ++k)
    number[static_cast<std::size_t>(order[k])] = static_cast<int>(k);
  const int count = static_cast<int>(mesh.triangles.rows());
  const std::vector<int> triangle_order = draw_order(count);
  data::TriangleMesh result{rows_in_order(mesh.vertices, order), data::Triangles(count, 3)};
  for (int t = 0; t < count; ++t) {
    const int corner = *rc::gen::resize(rc::kNominalSize, rc::gen::inRange(0, 3));
    for (int c = 0; c < 3; ++c)
      result.triangles(t, c) = number[static_cast<std::size_t>(
          mesh.triangles(triangle_order[static_cast<std::size_t>(t)], (c + corner) % 3))];
  }
  return result;
}

// A mesh with other numbers is the same sheet. Where the potential of the step is convex, a step whose
// residual is r ends within h^2 |r| / m of its solution, and the next carries at most 2 + 1 times of that on.
// It is convex where inertia outweighs compression, 8 E t strain / cell^2 < rho / h^2: strains here stay
// below 0.2. Half of the sheets lie on a plane without friction, which keeps it convex.
RC_GTEST_PROP(Properties, NumbersOfVerticesAndTrianglesDoNotMatter, ()) {
  const Sheet sheet = draw_sheet();
  const int count = static_cast<int>(sheet.rest.vertices.rows());
  Environment environment = draw_flight(sheet);
  environment.gravity = {1, 0, -9.81};
  environment.materials[0].friction = 0;
  if (draw_chance(0.5)) {
    const double lowest = environment.state.positions.col(2).minCoeff();
    environment.obstacles.push_back({Plane{{0, 0, lowest}, Eigen::Vector3d::UnitZ()}});
  }
  const double h = draw_log(1e-3, 5e-3);
  data::SheetMaterial& material = environment.materials[0];
  material.membrane_stiffness =
      draw_log(0.005, 0.5) * material.areal_density * sheet.vertex_area.minCoeff() / (h * h);
  material.bending_rigidity = std::min(material.bending_rigidity, material.membrane_stiffness * 1e-4 / 12);
  const Eigen::VectorXd mass = masses_of(sheet, material);
  const SolverSettings settings{.time_step = h, .tolerance = 1e-6};
  const std::vector<int> order = draw_order(count);
  const Sheet other_sheet = make_sheet(renumbered(sheet.rest, order));
  Environment other = environment;
  other.state.positions = rows_in_order(environment.state.positions, order);
  other.state.velocities = rows_in_order(environment.state.velocities, order);
  Solver solver(sheet, settings), other_solver(other_sheet, settings);
  double allowed = 0;
  for (int step = 0; step < 4; ++step) {
    const StepReport report = solver.step(environment), other_report = other_solver.step(other);
    RC_ASSERT(report.converged);
    RC_ASSERT(other_report.converged);
    const double residual =
        (report.residual + other_report.residual) * mass.norm() * environment.gravity.norm();
    allowed = 3 * allowed + h * h * residual / mass.minCoeff() + 1e-12;
    const data::Points difference = other.state.positions - rows_in_order(environment.state.positions, order);
    RC_ASSERT(difference.norm() <= allowed);
  }
}

}  // namespace
}  // namespace flash::sim
