#include "sim/projective.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numeric>

#include "data/procedural_mesh.h"

namespace flash::sim {
namespace {

using data::Points;
using Eigen::Vector3d;

constexpr double h = 0.01;
constexpr double g = 9.81;

Sheet square_sheet(double size, int cells) {
  data::RectangleMesh mesh;
  mesh.width = mesh.height = size;
  mesh.cells_x = mesh.cells_y = cells;
  return make_sheet(data::rectangle(mesh));
}

Environment environment_of(const Sheet& sheet) {
  Environment environment;
  environment.state.positions = sheet.rest.vertices;
  environment.state.velocities = Points::Zero(sheet.rest.vertices.rows(), 3);
  return environment;
}

/// Plane through the origin that falls along +x by `slope` [rad].
Plane incline(double slope) { return {Vector3d::Zero(), Vector3d(std::sin(slope), 0, std::cos(slope))}; }

void lay_on(const Plane& plane, Environment& environment) {
  const Eigen::Matrix3d turn =
      Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), plane.normal).toRotationMatrix();
  environment.state.positions = environment.state.positions * turn.transpose();
}

double total_mass(const Sheet& sheet, const Environment& environment) {
  return environment.material.areal_density * sheet.vertex_area.sum();
}

Vector3d mean(const Points& x) { return x.colwise().mean(); }

TEST(Projective, FreeFallIsTheDiscreteLaw) {
  const Sheet sheet = square_sheet(0.2, 6);
  Environment environment = environment_of(sheet);
  environment.state.velocities.rowwise() = Eigen::RowVector3d(0.3, -0.2, 1.0);
  ProjectiveSolver solver(sheet, {});
  const int steps = 40;
  for (int k = 0; k < steps; ++k) {
    const ProjectiveReport report = solver.step(environment);
    EXPECT_TRUE(report.converged);
  }
  // x_n = x_0 + v_0 t + g h^2 n (n + 1) / 2, to rounding of 40 steps.
  const Vector3d moved =
      Vector3d(0.3, -0.2, 1.0) * steps * h - Vector3d(0, 0, g * h * h * steps * (steps + 1) / 2);
  const Points expected = sheet.rest.vertices.rowwise() + moved.transpose();
  EXPECT_LE((environment.state.positions - expected).cwiseAbs().maxCoeff(), 1e-9);
}

struct Slide {
  double slope, friction;
  bool slides;
};

TEST(Projective, InclineSticksAndSlipsToAThousandthInBothTangentBases) {
  const Sheet sheet = square_sheet(0.1, 3);
  const double slope = 10 * M_PI / 180, critical = std::tan(slope);
  for (const double tangents : {0.0, M_PI / 4})
    for (const double offset : {-0.001, 0.001}) {
      Environment environment = environment_of(sheet);
      const Plane plane = incline(slope);
      lay_on(plane, environment);
      const Points start = environment.state.positions;
      environment.obstacles.push_back({plane, critical + offset});
      ProjectiveSettings settings;
      settings.tolerance = 1e-8;
      settings.tangent_angle = tangents;
      ProjectiveSolver solver(sheet, settings);
      const int steps = 100;
      for (int k = 0; k < steps; ++k) {
        const ProjectiveReport report = solver.step(environment);
        EXPECT_TRUE(report.converged) << k << " " << report.residual;
        EXPECT_LE(report.penetration_max, 1e-8);
        EXPECT_LE(report.cone_violation, 1e-9);
        // Normal force and its friction: the weight's share, resolved along the plane's frame.
        const double weight = total_mass(sheet, environment) * g;
        EXPECT_NEAR(report.obstacle_forces[0].dot(plane.normal), weight * std::cos(slope), 1e-6 * weight);
      }
      const Vector3d moved = mean(environment.state.positions) - mean(start);
      const double acceleration =
          offset < 0 ? g * (std::sin(slope) - (critical + offset) * std::cos(slope)) : 0.0;
      const double distance = acceleration * h * h * steps * (steps + 1) / 2;
      EXPECT_NEAR(moved.norm(), distance, 1e-6) << "offset " << offset << " tangents " << tangents;
      EXPECT_NEAR(moved.y(), 0, 1e-9);
    }
}

TEST(Projective, SlidingStopsAfterVSquaredOverTwoMuG) {
  const Sheet sheet = square_sheet(0.1, 3);
  for (const double angle : {0.0, 0.7}) {
    Environment environment = environment_of(sheet);
    environment.obstacles.push_back({Plane{}, 0.4});
    const Vector3d v(0.5 * std::cos(angle), 0.5 * std::sin(angle), 0);
    environment.state.velocities.rowwise() = v.transpose();
    ProjectiveSettings settings;
    settings.tolerance = 1e-8;
    ProjectiveSolver solver(sheet, settings);
    for (int k = 0; k < 30; ++k) solver.step(environment);
    // Discrete law: v drops by mu g h a step until it would turn; the last step stops short.
    double speed = 0.5, distance = 0;
    while (speed > 0) distance += h * (speed = std::max(0.0, speed - 0.4 * g * h));
    const Vector3d moved = mean(environment.state.positions - sheet.rest.vertices);
    EXPECT_LE((moved - distance * v.normalized()).norm(), 1e-6);
    EXPECT_LE(environment.state.velocities.cwiseAbs().maxCoeff(), 1e-6);
  }
}

TEST(Projective, EveryNamedSolverAndBothComplementaritiesGiveTheSameStep) {
  const Sheet sheet = square_sheet(0.2, 5);
  Points reference;
  for (const std::string& name : dual_solver_names())
    for (const auto complementarity : {Complementarity::minimum_map, Complementarity::fischer_burmeister}) {
      Environment environment = environment_of(sheet);
      environment.state.positions.col(2).array() += 1e-3;
      environment.state.velocities.col(0).setConstant(0.3);
      environment.obstacles.push_back({Plane{}, 0.3});
      ProjectiveSettings settings;
      settings.iterations = 60;
      settings.tolerance = 1e-8;
      settings.constraints.linear.solver = dual_solver_from_name(name);
      settings.constraints.complementarity = complementarity;
      ProjectiveSolver solver(sheet, settings);
      for (int k = 0; k < 10; ++k) EXPECT_TRUE(solver.step(environment).converged) << name << " " << k;
      if (reference.size() == 0) reference = environment.state.positions;
      // Ten steps converged to 1e-8 m each.
      EXPECT_LE((environment.state.positions - reference).cwiseAbs().maxCoeff(), 1e-7) << name;
    }
}

}  // namespace
}  // namespace flash::sim
