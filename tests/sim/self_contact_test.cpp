// Sheets that meet themselves and each other, step by step.

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "data/error.h"
#include "sim/batch.h"
#include "sim/device_batch.h"
#include "sim/law/layer_law.h"
#include "sim/pairs/intersection.h"
#include "tests/sim/sheet_scene.h"

namespace flash::sim {
namespace {

using data::Points;
using Eigen::Vector3d;

constexpr double h = 0.01;
constexpr SelfContact cloth{.thickness = 1e-3, .friction = 0.3, .pressure = 2500};

struct World {
  Sheet sheet;
  Environment environment;
};

/// A pile of sheets on a table that is tilted by an angle, each just above the one below.
World pile(int count, double tilt = 0, double side = 0.1, int cells = 6) {
  World world;
  std::vector<Sheet> sheets;
  for (int k = 0; k < count; ++k)
    sheets.push_back(k % 2 == 0
                         ? small_sheet(cells, side)
                         : make_sheet(data::rectangle(
                               {.width = side, .height = side, .cells_x = cells + 1, .cells_y = cells})));
  world.sheet = joined(sheets);
  world.environment = environment_of(world.sheet);
  world.environment.materials.resize(static_cast<std::size_t>(count));
  world.environment.gravity = 9.81 * Vector3d(std::sin(tilt), 0, -std::cos(tilt));
  world.environment.obstacles.push_back(
      {.shape = Plane{}, .friction = std::vector<double>(static_cast<std::size_t>(count), 5.0)});
  world.environment.self_contact = cloth;
  for (int k = 0; k < count; ++k)
    rows_of(world.sheet.bodies[static_cast<std::size_t>(k)], world.environment.state.positions)
        .col(2)
        .array() += 1.02 * cloth.thickness * k;
  return world;
}

/// A sheet bent to a U whose legs fly at each other.
World thrown(double speed, double friction = 0.3) {
  World world{small_sheet(12, 0.16), {}};
  world.environment = environment_of(world.sheet);
  world.environment.materials[0].bending_model = data::BendingModel::hinge;
  world.environment.self_contact = cloth;
  world.environment.self_contact->friction = friction;
  State& state = world.environment.state;
  for (int i = 0; i < state.positions.rows(); ++i) {
    constexpr double radius = 0.012, half = M_PI / 2 * radius;
    const double from = world.sheet.rest.vertices(i, 0) - 0.08, side = from > 0 ? 1 : -1;
    if (std::abs(from) < half)
      state.positions.row(i) << radius * std::cos(from / radius), state.positions(i, 1),
          radius * std::sin(from / radius);
    else
      state.positions.row(i) << half - std::abs(from), state.positions(i, 1) * (from > 0 ? 0.96 : 1),
          side * radius;
    state.velocities(i, 2) = -0.5 * side * speed;
  }
  return world;
}

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
  World world = pile(2);
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

TEST(SelfContact, ALayerSlidesWhereTheSlopeIsAboveItsFriction) {
  for (const double slope : {0.28, 0.32}) {
    World world = pile(2, std::atan(slope));
    Solver solver(world.sheet, {.time_step = h});
    double before = 0, after = 0;
    const auto place = [&] {
      return rows_of(world.sheet.bodies[1], world.environment.state.positions).col(0).mean();
    };
    for (int k = 0; k < 60; ++k) {
      if (k == 30) before = place();
      solver.step(world.environment);
    }
    after = place();
    const double speed =
        world.environment.state.velocities.bottomRows(world.sheet.bodies[1].vertex_count).col(0).mean();
    if (slope < cloth.friction) {
      EXPECT_LT(after - before, 1e-5);
      EXPECT_LT(speed, 1e-4);
    } else {
      // a = g (sin - mu cos), 0.186 m/s^2, from when it has landed.
      const double acceleration = 9.81 * std::cos(std::atan(slope)) * (slope - cloth.friction);
      EXPECT_NEAR(speed, acceleration * 60 * h, 0.15 * acceleration * 60 * h);
    }
  }
}

TEST(SelfContact, LayersThrownAtEachOtherDoNotPass) {
  World world = thrown(2);
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
  EXPECT_GT(touched, 10);
  EXPECT_LE(unsolved, 0);
}

TEST(SelfContact, ConservesMomentum) {
  World world = thrown(2);
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
  const World world = thrown(1.5);
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

TEST(SelfContact, RefusesAStartThatPassesThroughItself) {
  World world = pile(2);
  world.environment.state.positions(world.sheet.bodies[1].first_vertex + 20, 2) = -0.01;
  Solver solver(world.sheet, {.time_step = h});
  try {
    solver.step(world.environment);
    FAIL() << "it has to be refused";
  } catch (const data::InputError& error) {
    EXPECT_NE(std::string(error.what()).find("passing through triangle"), std::string::npos) << error.what();
  }
}

TEST(SelfContact, IsNotOnDevices) {
  Environment environment;
  environment.self_contact = cloth;
  EXPECT_NE(why_not_on_device(environment).find("self-contact"), std::string::npos);
}

}  // namespace
}  // namespace flash::sim
