#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "sim/law/vertex_contact.h"
#include "sim/step/moving_obstacles.h"
#include "tests/sim/sheet_scene.h"

namespace flash::sim {
namespace {

using Eigen::Vector3d;

double weight_of(const Sheet& sheet, const Environment& environment) {
  return environment.materials[0].areal_density * sheet.vertex_area.sum() * 9.81;
}

/// The gap to an obstacle where it stands at the start.
Gap gap_at_rest(const Obstacle& obstacle, const Vector3d& point) {
  Environment environment;
  environment.obstacles.push_back(obstacle);
  return gap_of(gap_to(moving_obstacles(environment, 0, 0)[0], vector3(point)));
}

TEST(Contact, GapsAreDistancesWithUnitNormalsOutward) {
  Box box{.half_extents = {0.1, 0.2, 0.3}};
  box.pose = Eigen::Translation3d(1, 0, 0) * Eigen::AngleAxisd(0.4, Vector3d::UnitZ());
  const Obstacle obstacles[] = {{Plane{{0, 0, 0.1}, Vector3d(0, 1, 1).normalized()}},
                                {box},
                                {Cylinder{{0, 0, 0.2}, Vector3d::UnitY(), 0.05}},
                                {Capsule{{0, 0.1, 0.2}, Vector3d(1, 2, 2) / 3, 0.3, 0.05}},
                                {Capsule{{0, 0.1, 0.2}, Vector3d::UnitX(), 0, 0.3}}};
  for (const Obstacle& obstacle : obstacles) {
    for (int k = 0; k < 200; ++k) {
      const Vector3d point = Vector3d::Random();
      const Gap gap = gap_at_rest(obstacle, point);
      EXPECT_NEAR(gap.normal.norm(), 1, 1e-12);
      // Following the normal to the surface ends on it.
      EXPECT_NEAR(gap_at_rest(obstacle, point - gap.distance * gap.normal).distance, 0, 1e-12);
    }
  }
}

TEST(Contact, TheCurvatureOfAGapIsItsSecondDerivative) {
  const Obstacle obstacles[] = {{Cylinder{{0, 0, 0.2}, Vector3d::UnitY(), 0.05}},
                                {Capsule{{0, 0.1, 0.2}, Vector3d::UnitY(), 0.4, 0.05}},
                                {Capsule{{0, 0.1, 0.2}, Vector3d::UnitX(), 0, 0.3}}};
  const double step = 1e-4;
  for (const Obstacle& obstacle : obstacles)
    for (int k = 0; k < 50; ++k) {
      const Vector3d point = Vector3d::Random(), along = Vector3d::Random().normalized();
      // Where side and ends of the capsule meet, the second derivative jumps.
      if (std::abs(std::abs(point.y() - 0.1) - 0.4) < 2 * step) continue;
      const auto distance = [&](double s) { return gap_at_rest(obstacle, point + s * along).distance; };
      const double second = (distance(step) - 2 * distance(0) + distance(-step)) / (step * step);
      const Gap gap = gap_at_rest(obstacle, point);
      const double of_ball = gap.ball_curvature * (1 - std::pow(gap.normal.dot(along), 2));
      const double curvature = gap.curvature_direction.squaredNorm() + gap.ball_curvature;
      EXPECT_NEAR(std::pow(gap.curvature_direction.dot(along), 2) + of_ball, second,
                  1e-4 * (1 + std::pow(curvature, 3)));
    }
}

TEST(Contact, NormalForcesSumToTheWeight) {
  const Sheet sheet = small_sheet();
  Environment environment = environment_of(sheet);
  environment.obstacles.push_back({Plane{}});
  environment.state.positions.col(2).array() += 0.01;
  Solver solver(sheet, {.tolerance = 1e-8});
  StepReport report;
  for (int n = 0; n < 100; ++n) report = solver.step(environment);
  EXPECT_NEAR(report.obstacle_forces[0].z(), weight_of(sheet, environment),
              1e-6 * weight_of(sheet, environment));
  EXPECT_NEAR(report.obstacle_forces[0].head<2>().norm(), 0, 1e-9);
}

TEST(Contact, SheetOnAPegNeitherSinksNorCreeps) {
  // 0.4 m over a peg of 30 mm: a narrow line of contact carries everything.
  const Sheet sheet = make_sheet(data::rectangle({.width = 0.4, .height = 0.1, .cells_x = 32, .cells_y = 8}));
  Environment environment = environment_of(sheet);
  environment.materials[0].friction = 0.4;
  environment.materials[0].bending_rigidity = 1e-5;
  environment.obstacles.push_back({Cylinder{{0.2, 0, -0.03}, Vector3d::UnitY(), 0.03}});
  Solver solver(sheet, {.tolerance = 1e-5});
  StepReport report;
  double penetration = 0;
  const auto run = [&](int steps) {
    for (int n = 0; n < steps; ++n) {
      report = solver.step(environment);
      penetration = std::max(penetration, report.penetration_max);
    }
  };
  environment.materials[0].air_drag = 10;
  run(200);
  environment.materials[0].air_drag = 0;
  const data::Points settled = environment.state.positions;
  run(100);
  EXPECT_LT(penetration, 1e-9);
  EXPECT_NEAR(report.obstacle_forces[0].z(), weight_of(sheet, environment),
              1e-2 * weight_of(sheet, environment));
  const int middle = 4 * 33 + 16;
  EXPECT_NEAR(environment.state.positions(middle, 2), 0.0, 1e-4);
  // One second at rest: what still moves is the swing of the free ends, not the line of contact.
  EXPECT_LT((environment.state.positions.row(middle) - settled.row(middle)).norm(), 1e-5);
}

TEST(Contact, TheCapstanHoldsUpToItsRatio) {
  // Strip over a peg by half a turn, loads on both ends: slips iff T2 / T1 > exp(mu pi).
  const double radius = 0.03, arc = M_PI * radius, leg = 0.05;
  const int around = 48, down = 8;
  data::TriangleMesh strip =
      data::rectangle({.width = arc + 2 * leg, .height = 0.01, .cells_x = around + 2 * down, .cells_y = 1});
  const double cell_leg = leg / down, cell_arc = arc / around;
  const Sheet sheet = make_sheet([&] {
    for (int i = 0; i < strip.vertices.rows(); ++i) {
      const int column = i % (around + 2 * down + 1);
      strip.vertices(i, 0) = column <= down            ? column * cell_leg
                             : column <= down + around ? leg + (column - down) * cell_arc
                                                       : leg + arc + (column - down - around) * cell_leg;
    }
    return strip;
  }());
  const double friction = 0.2, tension = 0.05;
  const Obstacle pegs[] = {{Cylinder{{0, 0, 0}, Vector3d::UnitY(), radius}},
                           {Capsule{{0, 0, 0}, Vector3d::UnitY(), 0.02, radius}}};
  for (int k = 0; k < 4; ++k) {
    const double share = k % 2 == 0 ? 0.97 : 1.03;
    Environment environment = environment_of(sheet);
    environment.gravity.setZero();
    environment.materials[0] = {
        .membrane_stiffness = 2000, .bending_rigidity = 1e-9, .friction = friction, .air_drag = 5};
    environment.obstacles.push_back(pegs[k / 2]);
    for (int i = 0; i < sheet.rest.vertices.rows(); ++i) {
      const double s = sheet.rest.vertices(i, 0), y = sheet.rest.vertices(i, 1);
      Vector3d p;
      if (s <= leg)
        p = {-radius, y, s - leg};
      else if (s <= leg + arc)
        p = {-radius * std::cos((s - leg) / radius), y, radius * std::sin((s - leg) / radius)};
      else
        p = {radius, y, leg + arc - s};
      environment.state.positions.row(i) = p;
    }
    const int columns = around + 2 * down + 1;
    for (const int row : {0, 1}) {
      environment.loads.push_back({row * columns, {0, 0, -tension / 2}});
      environment.loads.push_back(
          {row * columns + columns - 1, {0, 0, -tension / 2 * share * std::exp(friction * M_PI)}});
    }
    Solver solver(sheet, {.tolerance = 1e-6});
    for (int n = 0; n < 30; ++n) solver.step(environment);
    const double start = environment.state.positions(columns - 1, 2);
    for (int n = 0; n < 50; ++n) solver.step(environment);
    const double moved = start - environment.state.positions(columns - 1, 2);
    if (share < 1)
      EXPECT_LT(std::abs(moved), 1e-5) << share;
    else
      EXPECT_GT(moved, 1e-3) << share;
  }
}

TEST(Contact, AMovingBoxCarriesTheSheet) {
  const Sheet sheet = small_sheet(6, 0.06);
  Environment environment = environment_of(sheet);
  environment.materials[0].friction = 0.5;
  Box tray{.half_extents = {0.1, 0.1, 0.01}};
  data::Trajectory path;
  for (int k = 0; k <= 100; ++k) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    // 1 m/s^2 along x: below mu g, the sheet keeps up.
    pose.translation() = Vector3d(0.5 * 1.0 * std::pow(k * 0.01, 2), 0.03, -0.01);
    path.times.push_back(k * 0.01);
    path.poses.push_back(pose);
  }
  const int carrier = add_frame(environment, path);
  environment.obstacles.push_back({.shape = tray, .frame = carrier});
  Solver solver(sheet, {.tolerance = 1e-8});
  for (int n = 0; n < 50; ++n) solver.step(environment);
  const double carried = environment.state.positions(0, 0) - sheet.rest.vertices(0, 0);
  // It sticks, behind by what bends the bristles so far that they carry it.
  const double share = 1 / (0.5 * 9.81);
  EXPECT_NEAR(carried, 0.5 * 0.5 * 0.5 - share * bristle_length(0.01), 1e-9);
}

/// A sheet on a table and a box that stands on it, exactly, and moves towards it along x.
Environment pushed_by_a_box(const Sheet& sheet, double height) {
  Environment environment = environment_of(sheet);
  environment.obstacles.push_back({Plane{}});
  Box box{.half_extents = {0.02, 0.1, 0.5 * height}};
  const Vector3d start(-0.05, 0.03, 0.5 * height);
  const int pusher = add_frame(environment, straight_path(start, start + 0.2 * Vector3d::UnitX(), 1));
  environment.obstacles.push_back({.shape = box, .frame = pusher});
  return environment;
}

TEST(Contact, ABoxThatStandsOnATablePushesASheetAlongIt) {
  const Sheet sheet = small_sheet(6, 0.06);
  for (const double height : {0.05, 0.04, 0.06, 0.1}) {
    Environment environment = pushed_by_a_box(sheet, height);
    environment.materials[0].friction = 0.3;
    Solver solver(sheet, {});
    for (int n = 0; n < 100; ++n) EXPECT_TRUE(solver.step(environment).converged) << n;
    // The face of the box has come from -0.03 to 0.17.
    EXPECT_NEAR(environment.state.positions.col(0).minCoeff(), 0.17, 1e-9) << height;
  }
}

TEST(Contact, AVertexOnRollersIsSeenBelowATable) {
  const Sheet sheet = small_sheet(4, 0.04);
  Environment environment = environment_of(sheet);
  environment.obstacles.push_back({Plane{Vector3d(0, 0, 0.002), Vector3d::UnitZ()}});
  for (int i = 0; i < sheet.rest.vertices.rows(); ++i)
    environment.holds.push_back(support(i, {false, true, true}, Vector3d(0, sheet.rest.vertices(i, 1), 0)));
  EXPECT_NEAR(Solver(sheet, {}).step(environment).penetration_max, 0.002, 1e-12);
}

TEST(Contact, ASheetThatSlidIntoAWallRestsOnFloorAndWall) {
  const Sheet sheet = small_sheet(6, 0.12);
  for (const double friction : {0.0, 0.1}) {
    Environment environment = environment_of(sheet);
    environment.materials[0].friction = friction;
    environment.materials[0].bending_rigidity = 1e-3;  // does not buckle under its own weight
    environment.state.positions.col(0).array() += 0.02;
    const double slope = 0.5;
    environment.gravity = 9.81 * Vector3d(-std::sin(slope), 0, -std::cos(slope));
    environment.obstacles = {{Plane{}}, {Plane{Vector3d::Zero(), Vector3d::UnitX()}}};
    Solver solver(sheet, {.tolerance = 1e-7});
    StepReport report;
    int converged = 0;
    for (int n = 0; n < 200; ++n) converged += (report = solver.step(environment)).converged;
    EXPECT_EQ(converged, 200) << friction;
    const double weight = weight_of(sheet, environment);
    EXPECT_NEAR(report.obstacle_forces[0].z(), weight * std::cos(slope), 1e-5 * weight);
    const double held = report.obstacle_forces[0].x() + report.obstacle_forces[1].x();
    EXPECT_NEAR(held, weight * std::sin(slope), 1e-5 * weight);
    if (friction == 0) {
      EXPECT_NEAR(report.obstacle_forces[0].x(), 0, 1e-9);
    }
    EXPECT_LT(report.penetration_max, 1e-12);
    EXPECT_NEAR(environment.state.positions.col(0).minCoeff(), 0, 1e-12);
  }
}

TEST(Contact, AStripFallenIntoAGrooveIsCarriedByBothSides) {
  const Sheet sheet =
      make_sheet(data::rectangle({.width = 0.1, .height = 0.04, .cells_x = 10, .cells_y = 4}));
  Environment environment = environment_of(sheet);
  environment.materials[0].friction = 0.3;
  environment.materials[0].bending_rigidity = 1e-6;
  environment.materials[0].air_drag = 5;
  environment.state.positions.col(0).array() -= 0.05;
  environment.state.positions.col(2).array() += 0.05;
  environment.obstacles = {{Plane{Vector3d::Zero(), Vector3d(1, 0, 1).normalized()}},
                           {Plane{Vector3d::Zero(), Vector3d(-1, 0, 1).normalized()}}};
  Solver solver(sheet, {.tolerance = 1e-6});
  StepReport report;
  int converged = 0;
  for (int n = 0; n < 300; ++n) converged += (report = solver.step(environment)).converged;
  EXPECT_GE(converged, 297);
  const double weight = weight_of(sheet, environment);
  const Vector3d total = report.obstacle_forces[0] + report.obstacle_forces[1];
  EXPECT_NEAR((total - Vector3d(0, 0, weight)).norm(), 0, 1e-3 * weight);
  EXPECT_GT(report.obstacle_forces[0].norm(), 0.2 * weight);
  EXPECT_GT(report.obstacle_forces[1].norm(), 0.2 * weight);
  EXPECT_LT(report.penetration_max, 1e-9);
}

TEST(Contact, AFastSheetStaysOnAThinBoardAndAPeg) {
  // 20 m/s: 20 and 200 mm a step, onto 1 mm, and onto a peg of 8 mm.
  const Sheet sheet = small_sheet(8, 0.12);
  for (const double time_step : {0.001, 0.01}) {
    for (const bool board : {true, false}) {
      Environment environment = environment_of(sheet);
      environment.state.positions.col(2).array() += 0.05;
      environment.state.velocities.col(2).setConstant(-20);
      if (board)
        environment.obstacles = {{Box{.half_extents = {0.2, 0.2, 0.0005}}}};
      else
        environment.obstacles = {{Cylinder{{0.06, 0, -0.004}, Vector3d::UnitY(), 0.004}}};
      Solver solver(sheet, {.time_step = time_step});
      for (int n = 0; n < int(0.04 / time_step); ++n) {
        const data::Points before = environment.state.positions;
        const StepReport report = solver.step(environment);
        EXPECT_LT(report.penetration_max, 1e-9);
        if (board) {
          EXPECT_TRUE(report.converged) << time_step;
          EXPECT_GT(environment.state.positions.col(2).minCoeff(), 0.0005 - 1e-9);
        } else if (report.converged && report.substeps == 1) {
          // No vertex from above the peg's axis to below it within its width.
          for (int i = 0; i < before.rows(); ++i)
            EXPECT_FALSE(std::abs(before(i, 0) - 0.06) < 0.003 &&
                         std::abs(environment.state.positions(i, 0) - 0.06) < 0.003 && before(i, 2) > 0 &&
                         environment.state.positions(i, 2) < -0.004);
        }
      }
    }
  }
}

TEST(Contact, AFastPlateTakesTheSheetAlong) {
  // A plate of 1 mm at 10 m/s: 100 mm a step.
  const Sheet sheet = small_sheet(6, 0.06);
  Environment environment = environment_of(sheet);
  environment.gravity.setZero();
  Box plate{.half_extents = {0.1, 0.1, 0.0005}};
  const int carrier =
      add_frame(environment, straight_path(Vector3d(0.03, 0.03, -0.02), Vector3d(0.03, 0.03, 9.98), 1));
  environment.obstacles = {{.shape = plate, .frame = carrier}};
  Solver solver(sheet, {});
  for (int n = 1; n <= 5; ++n) {
    EXPECT_TRUE(solver.step(environment).converged);
    EXPECT_GT(environment.state.positions.col(2).minCoeff(), 0.1 * n - 0.02 + 0.0005 - 1e-9);
  }
}

TEST(Contact, AHandBelowTheTableIsReported) {
  const Sheet sheet = small_sheet(6, 0.12);
  Environment environment = environment_of(sheet);
  environment.obstacles = {{Plane{}}};
  environment.holds = {
      gripped(environment, {0, 1}, straight_path(Vector3d::Zero(), Vector3d(0, 0, -0.08), 0.1))};
  Solver solver(sheet, {});
  StepReport report;
  for (int n = 0; n < 10; ++n) report = solver.step(environment);
  EXPECT_NEAR(report.held_penetration.depth, 0.08, 1e-9);
  EXPECT_NEAR(report.penetration_max, 0.08, 1e-9);
  EXPECT_LE(report.held_penetration.vertex, 1);
  EXPECT_EQ(report.held_penetration.obstacle, 0);
}

TEST(Contact, AHandThatGoesThroughAWallInOneStepIsReported) {
  const Sheet sheet = small_sheet(6, 0.12);
  Environment environment = environment_of(sheet);
  environment.gravity.setZero();
  environment.obstacles = {
      {Box{.half_extents = {0.001, 1, 1}, .pose = Eigen::Isometry3d(Eigen::Translation3d(-0.01, 0, 0))}}};
  environment.holds = {
      gripped(environment, {0}, straight_path(Vector3d::Zero(), Vector3d(-0.15, 0, 0), 0.1))};
  Solver solver(sheet, {});
  double deepest = 0;
  for (int n = 0; n < 3; ++n) deepest = std::max(deepest, solver.step(environment).held_penetration.depth);
  // Steps of 15 mm through a wall of 2 mm: no step ends inside it.
  EXPECT_GE(deepest, 0.002);
}

TEST(Contact, WhatStartsInsideComesOutSlowly) {
  const Sheet sheet = small_sheet(6, 0.12);
  for (const double depth : {0.001, 0.1, 0.5}) {
    Environment environment = environment_of(sheet);
    environment.obstacles = {{Plane{}}};
    environment.state.positions.col(2).array() -= depth;
    Solver solver(sheet, {});
    double fastest = 0;
    StepReport report;
    for (int n = 0; n < 70; ++n) {
      report = solver.step(environment);
      EXPECT_TRUE(report.converged);
      if (n == 0) {
        EXPECT_NEAR(report.start_penetration.depth, depth, 1e-9);
      }
      fastest = std::max(fastest, environment.state.velocities.col(2).maxCoeff());
    }
    EXPECT_LT(fastest, 1 + 1e-9);
    EXPECT_LT(report.penetration_max, 1e-9);
  }
}

TEST(Contact, ASheetInACornerOfThreeSurfacesIsSolved) {
  const Sheet sheet = small_sheet(6, 0.12);
  for (const double friction : {0.0, 0.3}) {
    Environment environment = environment_of(sheet);
    environment.materials[0].friction = friction;
    environment.materials[0].bending_rigidity = 1e-4;
    environment.gravity = 9.81 * Vector3d(-0.5, -0.4, -0.7).normalized();
    environment.state.positions.array() += 0.02;
    environment.obstacles = {{Plane{}},
                             {Plane{Vector3d::Zero(), Vector3d::UnitX()}},
                             {Plane{Vector3d::Zero(), Vector3d::UnitY()}}};
    Solver solver(sheet, {});
    int converged = 0;
    StepReport report;
    for (int n = 0; n < 200; ++n) converged += (report = solver.step(environment)).converged;
    EXPECT_EQ(converged, 200) << friction;
    EXPECT_LT(report.penetration_max, 1e-9);
    const Vector3d carried =
        report.obstacle_forces[0] + report.obstacle_forces[1] + report.obstacle_forces[2];
    const double mass = weight_of(sheet, environment) / 9.81;
    // At rest but for what still swings.
    EXPECT_LT((carried + mass * environment.gravity).norm(), 0.1 * mass * 9.81) << friction;
  }
}

TEST(Contact, NoEnergyComesOfAnImpactOfAStiffSheetInLongSteps) {
  // What bent and stretched at impact gave back many times what there was.
  const Sheet sheet = small_sheet(6, 0.12);
  for (const double stiffness : {1e3, 1e5}) {
    Environment environment = environment_of(sheet);
    environment.materials[0] = {.constitutive = data::Constitutive::tri_arap,
                                .membrane_stiffness = stiffness,
                                .bending_rigidity = 1e-5,
                                .friction = 0};
    environment.obstacles = {{Plane{}}};
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(1.2, Vector3d(1, 0.3, 0).normalized()).matrix();
    environment.state.positions = environment.state.positions * turn.transpose();
    environment.state.positions.col(2).array() += 0.002 - environment.state.positions.col(2).minCoeff();
    environment.state.velocities.col(2).setConstant(-1);
    Solver solver(sheet, {.time_step = 0.02});
    double energy = 0.5 * weight_of(sheet, environment) / 9.81;
    for (int i = 0; i < sheet.rest.vertices.rows(); ++i)
      energy += environment.materials[0].areal_density * sheet.vertex_area[i] * 9.81 *
                environment.state.positions(i, 2);
    for (int n = 0; n < 40; ++n) {
      const StepReport report = solver.step(environment);
      EXPECT_TRUE(report.converged);
      const double now = report.kinetic + report.membrane + report.bending + report.gravitational;
      EXPECT_LT(now, 1.01 * energy);
      energy = now;
    }
  }
}

}  // namespace
}  // namespace flash::sim
