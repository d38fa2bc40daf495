// Sheets that meet themselves and each other, step by step.

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "data/files/error.h"
#include "sim/batch.h"
#include "sim/device_limits.h"
#include "sim/law/layer_law.h"
#include "sim/pairs/intersection.h"
#include "tests/sim/layer_scenes.h"
#include "tests/sim/sheet_scene.h"

namespace flash::sim {
namespace {

using data::Points;
using Eigen::Vector3d;

constexpr double h = 0.01;
constexpr SelfContact cloth{.thickness = 1e-3, .friction = 0.3, .pressure = 2500};

/// How deep a layer law gives way to a pressure: u = d / t, by bisection.
double share_of_thickness(double pressure) {
  double low = 1e-6, high = 1;
  for (int k = 0; k < 100; ++k) {
    const double u = 0.5 * (low + high);
    (layer_response(1, cloth.pressure, u).force > pressure ? low : high) = u;
  }
  return low;
}

TEST(SelfContact, ASheetRestsOnAnotherAtItsThickness) {
  LayerScene world = pile(2, cloth, 0.1, 6);
  Solver solver(world.sheet, {.time_step = h});
  StepReport report;
  for (int k = 0; k < 100; ++k) {
    report = solver.step(world.environment);
    ASSERT_TRUE(report.converged) << k;
  }
  const double sheet_weight = 0.2 * 0.1 * 0.1 * 9.81;
  EXPECT_NEAR(report.obstacle_forces[0].z(), 2 * sheet_weight, 2e-3 * sheet_weight);  // the tolerance, twice
  const auto upper = rows_of(world.sheet.bodies[1], world.environment.state.positions).col(2);
  // The pressure varies from vertex to vertex by the places of the features below.
  const double u = share_of_thickness(sheet_weight / (0.1 * 0.1));
  EXPECT_GT(u, 0.98);
  EXPECT_NEAR(upper.mean(), u * cloth.thickness, 0.01 * cloth.thickness);
  EXPECT_GT(report.layer_distance, 0.95 * cloth.thickness);
  EXPECT_GT(report.layer_touches, 50);
  EXPECT_LT(world.environment.state.velocities.rowwise().norm().maxCoeff(), 1e-5);  // no creep
}

// What a solver keeps of the last step is of the pressure then: a thousand times it throws the layers apart,
// and their energy did not come from nothing.
TEST(SelfContact, AnotherPressureIsThatOfANewSolver) {
  LayerScene world = pile(2, cloth, 0.1, 6);
  Solver solver(world.sheet, {.time_step = h});
  for (int k = 0; k < 20; ++k) solver.step(world.environment);
  world.environment.self_contact->pressure *= 1000;
  Environment same = world.environment;
  Solver fresh(world.sheet, {.time_step = h});
  const StepReport report = solver.step(world.environment), expected = fresh.step(same);
  EXPECT_TRUE(expected.converged);
  EXPECT_EQ(report.converged, expected.converged);
  EXPECT_EQ(report.substeps, expected.substeps);
}

/// The speed of the last body along the slope after some steps [m/s].
double speed_after(LayerScene scene, int steps) {
  Solver solver(scene.sheet, {.time_step = h});
  for (int k = 0; k < steps; ++k) EXPECT_TRUE(solver.step(scene.environment).converged) << k;
  return mean_velocity(scene, scene.sheet.bodies.back()).x();
}

SelfContact with_friction(double friction) {
  SelfContact contact = cloth;
  contact.friction = friction;
  return contact;
}

TEST(SelfContact, ALayerSlidesWhereTheSlopeIsAboveItsFriction) {
  constexpr int steps = 40, at_rest = 100;  // in 40 steps it does not reach the edge of the layer below
  for (const double slope : {0.295, 0.299})
    EXPECT_LT(speed_after(layer_on_incline(slope, cloth), at_rest), 1e-6) << slope;
  for (const double slope : {0.301, 0.305, 0.32}) {
    const double speed = 9.81 * std::cos(std::atan(slope)) * (slope - cloth.friction) * steps * h;
    // The layers' edges and vertices are a surface that is rough to 0.001 of the force.
    const double rough = 9.81 * 1e-3 * steps * h;
    EXPECT_NEAR(speed_after(layer_on_incline(slope, cloth), steps), speed, 0.02 * speed + rough) << slope;
  }
}

TEST(SelfContact, ASoftBlockSlidesOnAnotherWhereTheSlopeIsAboveItsFriction) {
  constexpr int steps = 40;
  const double slope = std::tan(10 * M_PI / 180), full = 9.81 * std::cos(std::atan(slope)) * steps * h;
  for (const bool sheet_between : {false, true}) {
    EXPECT_LT(speed_after(block_on_incline(slope, with_friction(slope + 0.005), sheet_between), steps), 1e-5);
    const double speed =
        speed_after(block_on_incline(slope, with_friction(slope - 0.02), sheet_between), steps);
    EXPECT_NEAR(speed, 0.02 * full, 0.005 * full) << sheet_between;
  }
}

TEST(SelfContact, LayersThrownAtEachOtherDoNotPass) {
  LayerScene world = thrown(cloth, 2);
  PairSurface surface(world.sheet);
  Solver solver(world.sheet, {.time_step = h});
  double energy = 1e300;
  int touched = 0, unsolved = 0;
  for (int k = 0; k < 30; ++k) {
    const StepReport report = solver.step(world.environment);
    ASSERT_FALSE(first_intersection(surface, world.environment.state.positions)) << k;
    unsolved += !report.converged;
    touched += report.layer_touches > 0;
    const double now =
        report.kinetic + report.membrane + report.bending + report.layers + report.gravitational;
    EXPECT_LE(now, energy + 1e-6 + 0.01 * report.kinetic) << k;
    energy = now;
  }
  EXPECT_GT(touched, 5);
  EXPECT_EQ(unsolved, 0);
}

/// Runs a scene and checks after every step that nothing has passed through anything. Returns the reports.
std::vector<StepReport> run_without_passing(LayerScene& scene, int steps, double time_step) {
  PairSurface surface(scene.sheet);
  Solver solver(scene.sheet, {.time_step = time_step});
  std::vector<StepReport> reports;
  for (int k = 0; k < steps; ++k) {
    reports.push_back(solver.step(scene.environment));
    EXPECT_TRUE(reports.back().converged) << k;
    EXPECT_FALSE(first_intersection(surface, scene.environment.state.positions)) << k;
  }
  return reports;
}

TEST(SelfContact, AStackOfTenSheetsStandsForTenSeconds) {
  constexpr int count = 10;
  LayerScene scene = pile(count, cloth, 0.1, 4);
  const std::vector<StepReport> reports = run_without_passing(scene, 500, 0.02);
  const auto height = [&](const Body& body) {
    return rows_of(body, scene.environment.state.positions).col(2).mean();
  };
  const double between = height(scene.sheet.bodies.back()) - height(scene.sheet.bodies.front());
  EXPECT_NEAR(between, (count - 1) * cloth.thickness, 0.05 * (count - 1) * cloth.thickness);
  EXPECT_GT(reports.back().layer_distance, 0.9 * cloth.thickness);
  const double weight = count * 0.2 * 0.1 * 0.1 * 9.81;
  EXPECT_NEAR(reports.back().obstacle_forces[0].z(), weight, 1e-2 * weight);
  EXPECT_LT(scene.environment.state.velocities.rowwise().norm().maxCoeff(), 1e-6);
}

TEST(SelfContact, ASheetFoldedTwiceIsPressed) {
  constexpr double height = 0.006;
  LayerScene scene = folded_twice_and_pressed(cloth, height);
  const std::vector<StepReport> reports = run_without_passing(scene, 75, h);
  EXPECT_LT(scene.environment.state.positions.col(2).maxCoeff(), height + 1e-6);
  // The plate presses what the table carries beside the weight.
  const double weight = 0.2 * 0.16 * 0.16 * 9.81, pressed = -reports.back().obstacle_forces[1].z();
  EXPECT_GT(pressed, weight);
  EXPECT_NEAR(reports.back().obstacle_forces[0].z(), weight + pressed, 0.02 * (weight + pressed));
  EXPECT_GT(reports.back().layer_distance, 0.1 * cloth.thickness);
}

/// An end of a strip without a knot would be slack where these ends are: their force is that of a knot.
TEST(SelfContact, AKnotPulledTightDoesNotPass) {
  constexpr double share = 0.95;
  LayerScene knot = strip_knot(cloth, share, 0.8);
  const std::vector<StepReport> reports = run_without_passing(knot, 90, h);
  const double weight = 0.2 * knot.sheet.vertex_area.sum() * 9.81;
  EXPECT_LT(reports.back().hold_forces[0].x(), -weight);
  EXPECT_GT(reports.back().hold_forces[1].x(), weight);
  const Points& x = knot.environment.state.positions;
  EXPECT_NEAR(x.col(0).maxCoeff() - x.col(0).minCoeff(), share * strip_length(knot),
              0.03 * strip_length(knot));
  EXPECT_GT(reports.back().layer_touches, 20);
}

TEST(SelfContact, FingersPinchASheetThroughAnother) {
  constexpr double strong = 5;
  const auto pinched = [&](double friction) {
    LayerScene scene = pinched_layers(with_friction(friction), strong);
    const std::vector<StepReport> reports = run_without_passing(scene, 30, h);
    return std::pair(reports.back().obstacle_forces[0].x(), mean_velocity(scene, scene.sheet.bodies[0]).z());
  };
  const auto [normal, still] = pinched(0.5);
  EXPECT_LT(std::abs(still), 1e-5);
  const double needed = 0.2 * 0.06 * 0.06 * 9.81 / normal;  // the first sheet's weight
  EXPECT_LT(std::abs(pinched(1.1 * needed).second), 1e-4);
  EXPECT_LT(pinched(0.9 * needed).second, -0.01);
}

TEST(SelfContact, ConservesMomentum) {
  LayerScene world = thrown(cloth, 2);
  world.environment.gravity.setZero();
  Solver solver(world.sheet, {.time_step = h, .tolerance = 1e-6});
  const Eigen::VectorXd mass = 0.2 * world.sheet.vertex_area;
  const Vector3d before =
      (mass.asDiagonal() * world.environment.state.velocities).colwise().sum().transpose();
  int touched = 0;
  for (int k = 0; k < 20; ++k) touched += solver.step(world.environment).layer_touches > 0;
  EXPECT_GT(touched, 5);
  const Vector3d after = (mass.asDiagonal() * world.environment.state.velocities).colwise().sum().transpose();
  EXPECT_LT((after - before).norm(), 20 * h * 1e-6 * mass.norm() * std::sqrt(mass.size()) * 9.81);
}

TEST(SelfContact, IsTheSameOnAnyNumberOfThreadsAndAfterARestart) {
  const LayerScene world = thrown(cloth, 1.5);
  const auto plan = make_sheet_plan(world.sheet);
  std::vector<Environment> environments(3, world.environment);
  environments[1].materials[0].bending_rigidity = 5e-5;
  environments[2].self_contact->friction = 0.6;
  const auto run = [&](int threads, int steps) {
    Batch batch(plan, environments, {.solver = {.time_step = h}, .steps = steps, .threads = threads});
    batch.advance(steps);
    std::vector<double> x(batch.positions().data,
                          batch.positions().data + 3 * 3 * world.sheet.rest.vertices.rows());
    std::vector<State> states;
    for (int e = 0; e < 3; ++e) states.push_back(batch.state(e));
    return std::pair(x, states);
  };
  const auto one = run(1, 60), three = run(3, 60);
  EXPECT_EQ(std::memcmp(one.first.data(), three.first.data(), one.first.size() * sizeof(double)), 0);
  auto half = run(2, restart_interval);
  for (int e = 0; e < 3; ++e)
    environments[static_cast<std::size_t>(e)].state = half.second[static_cast<std::size_t>(e)];
  Batch rest(plan, environments, {.solver = {.time_step = h}, .steps = 60, .first_step = restart_interval});
  rest.advance(60 - restart_interval);
  EXPECT_EQ(std::memcmp(one.first.data(), rest.positions().data, one.first.size() * sizeof(double)), 0);
}

TEST(SelfContact, APermutedBatchHasPermutedResults) {
  const LayerScene world = thrown(cloth, 1.5);
  const auto plan = make_sheet_plan(world.sheet);
  constexpr int steps = 40, count = 3, order[count] = {2, 0, 1};
  std::vector<Environment> environments(count, world.environment), permuted;
  environments[1].materials[0].bending_rigidity = 5e-5;
  environments[2].self_contact->friction = 0.6;
  for (const int e : order) permuted.push_back(environments[static_cast<std::size_t>(e)]);
  const BatchSettings settings{.solver = {.time_step = h}, .steps = steps, .threads = 2};
  Batch batch(plan, environments, settings), other(plan, permuted, settings);
  batch.advance(steps);
  other.advance(steps);
  for (int e = 0; e < count; ++e)
    EXPECT_EQ((other.state(e).positions - batch.state(order[e]).positions).cwiseAbs().maxCoeff(), 0) << e;
  EXPECT_GT((batch.state(0).positions - batch.state(2).positions).cwiseAbs().maxCoeff(), 0);
}

/// What is pressed between them has no place at all: a step says whom, and ends at once.
TEST(SelfContact, BoardsThatLeaveNoRoomAreTold) {
  LayerScene world = pile(2, cloth, 0.1, 6);
  const auto path = straight_path({0, 0, 0.01}, {0, 0, -0.001}, 0.2);
  world.environment.obstacles.push_back(
      {.shape = Plane{.normal = {0, 0, -1}}, .frame = add_frame(world.environment, path, h)});
  Solver solver(world.sheet, {.time_step = h});
  int told = 0;
  for (int k = 0; k < 22; ++k) {
    const StepReport report = solver.step(world.environment);
    EXPECT_LE(report.iterations, 200) << k;  // nothing is tried again in parts
    if (report.no_room.depth > 0) {
      ++told;
      EXPECT_FALSE(report.converged) << k;
      EXPECT_GE(report.no_room.vertex, 0) << k;
    }
    EXPECT_EQ(report.no_room.depth > 0, k == 18 || k == 19) << k;  // the board is at -0.45 mm and at -1 mm
  }
  EXPECT_EQ(told, 2);
}

TEST(SelfContact, RefusesAStartThatPassesThroughItself) {
  LayerScene world = pile(2, cloth, 0.1, 6);
  world.environment.state.positions(world.sheet.bodies[1].first_vertex + 20, 2) = -0.01;
  Solver solver(world.sheet, {.time_step = h});
  try {
    solver.step(world.environment);
    FAIL() << "it has to be refused";
  } catch (const data::InputError& error) {
    EXPECT_NE(std::string(error.what()).find("passing through triangle"), std::string::npos) << error.what();
  }
}

TEST(SelfContact, RefusesLayersThickerThanCells) {
  LayerScene world = pile(2, {.thickness = 0.03}, 0.1, 6);
  Solver solver(world.sheet, {.time_step = h});
  try {
    solver.step(world.environment);
    FAIL() << "it has to be refused";
  } catch (const data::InputError& error) {
    EXPECT_NE(std::string(error.what()).find("the mean edge of the mesh"), std::string::npos) << error.what();
  }
}

TEST(SelfContact, IsNotOnDevices) {
  Environment environment;
  environment.self_contact = cloth;
  EXPECT_NE(why_not_on_device(environment).find("self-contact"), std::string::npos);
}

}  // namespace
}  // namespace flash::sim
