#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "sim/batch.h"
#include "sim/law/vertex_contact.h"
#include "tests/sim/brute_surface.h"
#include "tests/sim/obstacle_depth.h"
#include "tests/sim/sheet_scene.h"
#include "tests/sim/sliding_mass.h"
#include "tests/sim/surface_shapes.h"

// Sheets that meet surfaces of triangles.
namespace flash::sim {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

double weight_of(const Sheet& sheet, const Environment& environment) {
  return environment.materials[0].areal_density * sheet.vertex_area.sum() * 9.81;
}

Isometry3d at(double x, double y, double z) { return Isometry3d(Eigen::Translation3d(x, y, z)); }

/// The environment with other obstacles.
Environment over(Environment environment, const std::vector<Obstacle>& obstacles) {
  environment.obstacles = obstacles;
  return environment;
}

double deepest_of(const Environment& environment) {
  double deepest = -1;
  for (const Obstacle& obstacle : environment.obstacles)
    for (const auto& row : environment.state.positions.rowwise())
      deepest = std::max(deepest, depth_in(environment, obstacle, row.transpose(), environment.state.time));
  return deepest;
}

TEST(MeshObstacle, ASheetFallsOverABoxOfTrianglesAsOverABox) {
  const Sheet sheet = small_sheet(10, 0.2);
  Environment start = environment_of(sheet);
  start.materials[0].bending_rigidity = 1e-4;
  start.materials[0].friction = 0.3;
  start.materials[0].air_drag = 5;
  start.state.positions.col(2).array() += 0.002;
  const Vector3d half(0.06, 0.05, 0.02);
  const Isometry3d pose = at(0.1, 0.1, -0.02) * Isometry3d(Eigen::AngleAxisd(0.3, Vector3d::UnitZ()));
  Environment box = over(start, {{Box{half, pose}}});
  Environment mesh = over(start, {{mesh_shape(box_surface(half, 3), 0, pose)}});
  Solver on_box(sheet, {.tolerance = 1e-8}), on_mesh(sheet, {.tolerance = 1e-8});
  for (int n = 0; n < 60; ++n) {
    const StepReport expected = on_box.step(box), report = on_mesh.step(mesh);
    EXPECT_TRUE(report.converged) << n;
    EXPECT_LT(deepest_of(mesh), 1e-9) << n;
    // Both to a tolerance of 1e-8 of the weight a step; the sheet hangs over edges and amplifies it.
    EXPECT_LT((mesh.state.positions - box.state.positions).cwiseAbs().maxCoeff(), 1e-6) << n;
    EXPECT_LT((report.obstacle_forces[0] - expected.obstacle_forces[0]).norm(),
              1e-3 * weight_of(sheet, start))
        << n;
  }
}

TEST(MeshObstacle, AFinerBallConvergesToTheSphereAtSecondOrder) {
  const Sheet sheet = small_sheet(10, 0.2);
  const double radius = 0.08;
  Environment start = environment_of(sheet);
  start.materials[0].bending_rigidity = 3e-4;
  start.materials[0].friction = 0.5;
  start.materials[0].air_drag = 10;
  const auto settle = [&](const Obstacle& ball) {
    Environment environment = over(start, {ball});
    Solver solver(sheet, {.tolerance = 1e-7});
    for (int n = 0; n < 60; ++n) EXPECT_TRUE(solver.step(environment).converged) << n;
    return environment.state.positions;
  };
  const Vector3d centre(0.1, 0.1, -radius - 0.001);
  const data::Points exact = settle({Capsule{centre, Vector3d::UnitX(), 0, radius}});
  std::vector<double> errors;
  for (const int times : {3, 4, 5})
    errors.push_back(
        (settle({mesh_shape(ball_surface(radius, times), 0, Isometry3d(Eigen::Translation3d(centre)))}) -
         exact)
            .rowwise()
            .norm()
            .mean());
  // Edges half as long lie a quarter as far below the sphere.
  for (std::size_t k = 1; k < errors.size(); ++k) EXPECT_GT(errors[k - 1] / errors[k], 2.5) << errors[k];
  const double order = std::log2(errors.front() / errors.back()) / 2;
  EXPECT_GT(order, 1.7);
  EXPECT_LT(order, 2.5);
}

/// A plate whose top, z = 0, has irregular triangles of about `cell`.
data::TriangleMesh irregular_plate(double half_width, int cells) {
  data::TriangleMesh mesh = box_surface({half_width, half_width, 0.01}, cells);
  const double cell = 2 * half_width / cells;
  for (Eigen::Index i = 0; i < mesh.vertices.rows(); ++i) {
    auto row = mesh.vertices.row(i);
    row[2] -= 0.01;
    if (std::abs(row[0]) > half_width - 1e-9 || std::abs(row[1]) > half_width - 1e-9) continue;
    row[0] += 0.3 * cell * std::sin(12.9 * static_cast<double>(i));
    row[1] += 0.3 * cell * std::sin(78.2 * static_cast<double>(i));
  }
  return mesh;
}

TEST(MeshObstacle, StickAndSlipOnAnInclineAreToldToAThousandthAcrossSeams) {
  // Ten degrees. The mesh is inclined, not gravity: its seams run at all angles.
  const double angle = 10 * M_PI / 180, gravity = 9.81, time_step = 0.01;
  const Isometry3d incline =
      Isometry3d(Eigen::AngleAxisd(angle, Vector3d::UnitY()) * Eigen::AngleAxisd(0.7, Vector3d::UnitZ()));
  const Sheet sheet = small_sheet(4, 0.08);
  const Mesh plate = mesh_shape(irregular_plate(0.6, 60), 0, incline);
  const Vector3d down(std::cos(angle), 0, -std::sin(angle));
  for (const double off : {-0.001, 0.001}) {
    Environment environment = over(environment_of(sheet), {{plate}});
    environment.materials[0].friction = std::tan(angle) + off;
    environment.state.positions = environment.state.positions *
                                  Eigen::AngleAxisd(angle, Vector3d::UnitY()).toRotationMatrix().transpose();
    const data::Points start = environment.state.positions;
    Solver solver(sheet, {.time_step = time_step, .tolerance = 1e-8});
    const int steps = 400;
    for (int n = 0; n < steps; ++n) EXPECT_TRUE(solver.step(environment).converged) << n;
    const Eigen::VectorXd way = (environment.state.positions - start) * down;
    const SlidingMass expected =
        slide_down(angle, environment.materials[0].friction, gravity, time_step, steps);
    // Sliding takes 77 mm in 4 s, over four cells.
    if (off < 0) {
      EXPECT_GT(expected.place, 0.07);
    } else {
      EXPECT_LT(expected.place, 2 * bristle_length(time_step));
    }
    EXPECT_NEAR(way.minCoeff(), expected.place, 1e-5 * expected.place + 1e-9) << off;
    EXPECT_NEAR(way.maxCoeff(), expected.place, 1e-5 * expected.place + 1e-9) << off;
  }
}

TEST(MeshObstacle, ASheetThatCrossesSeamsBrakesAsOnAPlane) {
  // Over seams at speed, and then to rest: neither a bump nor friction that starts anew.
  const Sheet sheet = small_sheet(4, 0.08);
  Environment start = environment_of(sheet);
  start.materials[0].friction = 0.3;
  start.state.velocities.col(0).setConstant(1.0);
  start.state.velocities.col(1).setConstant(0.3);
  Environment plane = over(start, {{Plane{}}}), mesh = over(start, {{mesh_shape(irregular_plate(0.6, 40))}});
  Solver on_plane(sheet, {.tolerance = 1e-8}), on_mesh(sheet, {.tolerance = 1e-8});
  for (int n = 0; n < 200; ++n) {
    EXPECT_TRUE(on_plane.step(plane).converged) << n;
    EXPECT_TRUE(on_mesh.step(mesh).converged) << n;
    EXPECT_LT((mesh.state.positions - plane.state.positions).cwiseAbs().maxCoeff(), 1e-8) << n;
  }
  EXPECT_LT(mesh.state.velocities.cwiseAbs().maxCoeff(), 1e-9);
}

TEST(MeshObstacle, TheCapstanHoldsUpToItsRatioOnAFacetedRod) {
  // As on a cylinder, to 3 %: a strip over a rod of 60 sides by half a turn, loads on both ends.
  const double radius = 0.03, arc = M_PI * radius, leg = 0.05;
  const int around = 48, down = 8, columns = around + 2 * down + 1;
  data::TriangleMesh strip =
      data::rectangle({.width = arc + 2 * leg, .height = 0.01, .cells_x = around + 2 * down, .cells_y = 1});
  for (int i = 0; i < strip.vertices.rows(); ++i) {
    const int column = i % columns;
    strip.vertices(i, 0) = column <= down            ? column * leg / down
                           : column <= down + around ? leg + (column - down) * arc / around
                                                     : leg + arc + (column - down - around) * leg / down;
  }
  const Sheet sheet = make_sheet(strip);
  const double friction = 0.2, tension = 0.05;
  for (const double share : {0.97, 1.03}) {
    Environment environment = environment_of(sheet);
    environment.gravity.setZero();
    environment.materials[0] = {
        .membrane_stiffness = 2000, .bending_rigidity = 1e-9, .friction = friction, .air_drag = 5};
    environment.obstacles.push_back({mesh_shape(rod_surface(radius, 0.1, 60, 0.02))});
    for (int i = 0; i < sheet.rest.vertices.rows(); ++i) {
      const double s = sheet.rest.vertices(i, 0), y = sheet.rest.vertices(i, 1);
      const double angle = std::clamp((s - leg) / radius, 0.0, M_PI);
      const double below = std::max({0.0, leg - s, s - leg - arc});
      environment.state.positions.row(i) =
          Vector3d(-radius * std::cos(angle), y, radius * std::sin(angle) - below).transpose();
    }
    for (const int row : {0, 1}) {
      environment.loads.push_back({row * columns, {0, 0, -tension / 2}});
      environment.loads.push_back(
          {row * columns + columns - 1, {0, 0, -tension / 2 * share * std::exp(friction * M_PI)}});
    }
    Solver solver(sheet, {.tolerance = 1e-6});
    // First the strip is drawn tight. One that slips is off the rod after a fifth of a second.
    const int settling = share < 1 ? 60 : 2;
    for (int n = 0; n < settling; ++n) EXPECT_TRUE(solver.step(environment).converged) << n;
    const double start = environment.state.positions(columns - 1, 2);
    for (int n = 0; n < 5 * settling; ++n) EXPECT_TRUE(solver.step(environment).converged) << n;
    const double moved = start - environment.state.positions(columns - 1, 2);
    if (share < 1)
      EXPECT_LT(std::abs(moved), 1e-5) << share;
    else
      EXPECT_GT(moved, 5e-3) << share;
  }
}

TEST(MeshObstacle, ASheetSlidesIntoACreaseAndRestsAgainstBothSides) {
  // A step: floor and wall, which two planes are, too.
  const Sheet sheet = small_sheet(6, 0.12);
  const data::TriangleMesh step =
      prism_surface({{-0.1, -0.1}, {0.5, -0.1}, {0.5, 0}, {0, 0}, {0, 0.3}, {-0.1, 0.3}}, 3, 0.5);
  for (const double friction : {0.0, 0.3}) {
    Environment start = environment_of(sheet);
    start.materials[0].friction = friction;
    start.materials[0].bending_rigidity = 1e-3;
    start.materials[0].air_drag = 2;
    start.gravity = 9.81 * Vector3d(-0.6, 0, -0.8);
    start.state.positions.col(0).array() += 0.03;
    start.state.positions.col(2).array() += 0.01;
    Environment mesh = over(start, {{mesh_shape(step)}}),
                planes = over(start, {{Plane{}}, {Plane{Vector3d::Zero(), Vector3d::UnitX()}}});
    Solver on_mesh(sheet, {.tolerance = 1e-7}), on_planes(sheet, {.tolerance = 1e-7});
    StepReport report;
    for (int n = 0; n < 150; ++n) {
      report = on_mesh.step(mesh);
      on_planes.step(planes);
      EXPECT_TRUE(report.converged) << friction << " " << n;
      EXPECT_LT(deepest_of(mesh), 1e-9);
    }
    EXPECT_LT((mesh.state.positions - planes.state.positions).cwiseAbs().maxCoeff(), 1e-5) << friction;
    const Vector3d weight = weight_of(sheet, start) / 9.81 * start.gravity;
    EXPECT_LT((report.obstacle_forces[0] + weight).norm(), 1e-2 * weight.norm()) << friction;
  }
}

TEST(MeshObstacle, ASheetInABowlComesToRestAndStays) {
  // The lower half of a ball, met from within: every seam is a crease.
  data::TriangleMesh bowl = ball_surface(0.15, 3);
  std::vector<Eigen::Vector3i> kept;
  for (const auto& t : bowl.triangles.rowwise())
    if (bowl.vertices(t[0], 2) < 0.01 && bowl.vertices(t[1], 2) < 0.01 && bowl.vertices(t[2], 2) < 0.01)
      kept.emplace_back(t.transpose());
  bowl.triangles.resize(static_cast<Eigen::Index>(kept.size()), 3);
  for (std::size_t k = 0; k < kept.size(); ++k)
    bowl.triangles.row(static_cast<Eigen::Index>(k)) = kept[k].transpose();
  const Sheet sheet = small_sheet(8, 0.12);
  for (const double friction : {0.0, 0.4}) {
    Environment environment = environment_of(sheet);
    environment.materials[0].friction = friction;
    environment.materials[0].bending_rigidity = 1e-5;
    environment.materials[0].membrane_stiffness = 20;
    environment.materials[0].air_drag = 10;
    environment.state.positions.leftCols<2>().array() -= 0.05;
    environment.state.positions.col(2).array() -= 0.05;
    const Mesh shape = mesh_shape(
        [&] {
          // Its vertices that no triangle has any more go.
          data::TriangleMesh used;
          std::vector<int> place(static_cast<std::size_t>(bowl.vertices.rows()), -1), those;
          used.triangles = bowl.triangles;
          for (int& vertex : used.triangles.reshaped()) {
            if (place[vertex] < 0) {
              place[vertex] = static_cast<int>(those.size());
              those.push_back(vertex);
            }
            vertex = place[vertex];
          }
          used.vertices = bowl.vertices(those, Eigen::all);
          return used;
        }(),
        1e-3);
    EXPECT_FALSE(shape.surface->closed);
    environment.obstacles = {{shape}};
    Solver solver(sheet, {.tolerance = 1e-5});
    int unsolved = 0;
    StepReport report;
    for (int n = 0; n < 300; ++n) {
      unsolved += !(report = solver.step(environment)).converged;
      EXPECT_LT(deepest_of(environment), 1e-9) << n;
    }
    EXPECT_EQ(unsolved, 0) << friction;
    EXPECT_NEAR(report.obstacle_forces[0].z(), weight_of(sheet, environment),
                2e-2 * weight_of(sheet, environment));
    const data::Points settled = environment.state.positions;
    environment.materials[0].air_drag = 0;
    for (int n = 0; n < 100; ++n) solver.step(environment);
    if (friction > 0) {
      EXPECT_LT((environment.state.positions - settled).cwiseAbs().maxCoeff(), 1e-4);
    }
  }
}

TEST(MeshObstacle, NoVertexPassesThroughABoardAtTwentyMetresASecond) {
  // A board of 1 mm, turned, that is struck against a sheet at rest; and a finger that turns as it comes.
  const Sheet sheet = small_sheet(8, 0.16);
  for (const bool finger : {false, true}) {
    const data::TriangleMesh shape =
        finger ? moved_surface(rod_surface(0.01, 0.15, 12), at(0, 0, 0)) : box_surface({0.3, 0.3, 0.0005}, 2);
    Environment environment = environment_of(sheet);
    environment.gravity.setZero();
    environment.materials[0].friction = 0.2;
    const double time_step = 2e-3;
    data::Trajectory path;
    for (int n = 0; n <= 40; ++n) {
      const double time = n * time_step;
      path.times.push_back(time);
      path.poses.push_back(
          at(0.08, 0.08, 0.15 - 20 * time) *
          Isometry3d(Eigen::AngleAxisd(0.3 + 10 * time, Vector3d(0.2, finger ? 0.1 : 1, 0.3).normalized())));
    }
    const int frame = add_frame(environment, path, time_step);
    environment.obstacles = {{.shape = mesh_shape(shape), .frame = frame}};
    Solver solver(sheet, {.time_step = time_step});
    int passed = 0, touched = 0;
    for (int n = 0; n < 40; ++n) {
      const data::Points before = environment.state.positions;
      const double time = environment.state.time;
      const StepReport report = solver.step(environment);
      if (!report.converged) continue;
      touched += report.obstacle_forces[0].norm() > 0;
      if (report.substeps > 1) continue;
      const Isometry3d from = frame_pose(environment, frame, time).inverse(),
                       to = frame_pose(environment, frame, environment.state.time).inverse();
      for (Eigen::Index i = 0; i < before.rows(); ++i) {
        const Vector3d a = from * Vector3d(before.row(i)),
                       b = to * Vector3d(environment.state.positions.row(i));
        if (finger)
          passed += brute_winding(shape, b) > 0.5 && brute_distance(shape, b) > 1e-8;
        else
          passed += a.z() * b.z() < 0 && std::max(std::abs(b.x()), std::abs(b.y())) < 0.3 &&
                    std::abs(b.z()) > 0.0005 - 1e-8 && std::abs(a.z()) > 0.0005 - 1e-8;
      }
    }
    EXPECT_EQ(passed, 0) << finger;
    EXPECT_GT(touched, 1) << finger;
  }
}

TEST(MeshObstacle, WhatStartsInsideComesOutAtTheExitSpeed) {
  const Sheet sheet = small_sheet(6, 0.12);
  for (const double depth : {0.005, 0.05}) {
    Environment environment =
        over(environment_of(sheet), {{mesh_shape(box_surface({0.3, 0.3, 0.1}, 3), 0, at(0, 0, -0.1))}});
    environment.gravity.setZero();
    environment.state.positions.col(2).array() -= depth;
    Solver solver(sheet, {});
    double fastest = 0;
    StepReport report;
    for (int n = 0; n < 10; ++n) {
      report = solver.step(environment);
      EXPECT_TRUE(report.converged) << n;
      if (n == 0) {
        EXPECT_NEAR(report.start_penetration.depth, depth, 1e-9);
        EXPECT_EQ(report.start_penetration.obstacle, 0);
      }
      fastest = std::max(fastest, environment.state.velocities.col(2).maxCoeff());
    }
    EXPECT_LT(fastest, 1 + 1e-9);
    EXPECT_GT(fastest, 0.4);
    EXPECT_LT(report.penetration_max, 1e-9);
  }
}

TEST(MeshObstacle, EnvironmentsOfABatchShareAMeshAndAreTheSameAlone) {
  const Sheet sheet = small_sheet(8, 0.16);
  const auto plan = make_sheet_plan(sheet);
  const Mesh ball = mesh_shape(ball_surface(0.05, 2), 0, at(0.08, 0.08, -0.052));
  std::vector<Environment> environments;
  for (int e = 0; e < 5; ++e) {
    Environment environment = over(environment_of(sheet), {{ball}, {Plane{{0, 0, -0.1}}}});
    environment.materials[0].bending_rigidity = 1e-5 * (1 + e);
    environments.push_back(environment);
  }
  BatchSettings settings;
  settings.steps = 25;
  settings.threads = 2;
  Batch together(plan, environments, settings);
  together.advance(25);
  for (int e = 0; e < 5; ++e) {
    Batch alone(plan, {environments[static_cast<std::size_t>(e)]}, settings);
    alone.advance(25);
    EXPECT_EQ(together.state(e).positions, alone.state(0).positions);
    EXPECT_EQ(together.state(e).bristles, alone.state(0).bristles);
  }
}

}  // namespace
}  // namespace flash::sim
