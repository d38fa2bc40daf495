#include "sim/oracle/projective.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "data/mesh/procedural_mesh.h"
#include "sim/oracle/projective_contact.h"
#include "tests/sim/sheet_scene.h"

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

/// Plane through the origin that falls along +x by `slope` [rad].
Plane incline(double slope) { return {Vector3d::Zero(), Vector3d(std::sin(slope), 0, std::cos(slope))}; }

void lay_on(const Plane& plane, Environment& environment) {
  const Eigen::Matrix3d turn =
      Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), plane.normal).toRotationMatrix();
  environment.state.positions = environment.state.positions * turn.transpose();
}

double total_mass(const Sheet& sheet, const Environment& environment) {
  return environment.materials[0].areal_density * sheet.vertex_area.sum();
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

TEST(Projective, InclineSticksAndSlipsToAThousandthInBothTangentBases) {
  const Sheet sheet = square_sheet(0.1, 3);
  const double slope = 10 * M_PI / 180, critical = std::tan(slope);
  for (const double tangents : {0.0, M_PI / 4})
    for (const double offset : {-0.001, 0.001}) {
      Environment environment = environment_of(sheet);
      const Plane plane = incline(slope);
      lay_on(plane, environment);
      const Points start = environment.state.positions;
      environment.obstacles.push_back({plane, {critical + offset}});
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
    environment.obstacles.push_back({Plane{}, {0.4}});
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
      environment.obstacles.push_back({Plane{}, {0.3}});
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

/// A sheet hung over a thin horizontal rail at its middle row, at rest: few contacts carry all of it.
Environment over_a_peg(const Sheet& sheet, double friction) {
  Environment environment = environment_of(sheet);
  environment.materials[0].membrane_stiffness = 200;
  environment.materials[0].bending_rigidity = 1e-4;
  const double size = sheet.rest.vertices.col(0).maxCoeff(), radius = 0.01;
  environment.obstacles.push_back(
      {Cylinder{Vector3d(size / 2, 0, -radius), Vector3d::UnitY(), radius}, {friction}});
  return environment;
}

/// The largest move of the vertices that start on the peg.
double creep(const Sheet& sheet, const Environment& environment) {
  const double middle = sheet.rest.vertices.col(0).maxCoeff() / 2;
  double largest = 0;
  for (Eigen::Index i = 0; i < sheet.rest.vertices.rows(); ++i)
    if (std::abs(sheet.rest.vertices(i, 0) - middle) < 1e-9)
      largest = std::max(largest, (environment.state.positions.row(i) - sheet.rest.vertices.row(i)).norm());
  return largest;
}

TEST(Projective, SheetOnAPegNeitherSinksNorCreepsWithTheFullMetric) {
  const Sheet sheet = square_sheet(0.2, 10);
  Environment environment = over_a_peg(sheet, 0.5);
  environment.gravity = g * Vector3d(0, std::sin(0.2), -std::cos(0.2));  // the peg slopes by 0.2 rad
  environment.materials[0].air_drag = 10;
  ProjectiveSolver solver(sheet, {});
  ProjectiveReport report;
  double slid = 0;
  for (int k = 0; k < 200; ++k) {
    report = solver.step(environment);
    EXPECT_EQ(report.metric, ContactMetric::full);  // chosen by `automatic`
    EXPECT_LE(report.penetration_max, 1e-12) << k;
    EXPECT_LE(report.cone_violation, 1e-12) << k;
    if (k == 30) slid = creep(sheet, environment);  // while it fell and hardly weighed on the peg
    EXPECT_TRUE(report.warning.empty());
  }
  EXPECT_NEAR(creep(sheet, environment), slid, 1e-9);  // 170 steps to the rounding of a slip
  const double weight = total_mass(sheet, environment) * g;
  // Nearly at rest, the rest of it to the tolerance on |r| / |M g| of 121 vertices.
  EXPECT_NEAR((report.obstacle_forces[0] / weight + environment.gravity / g).norm(), 0, 1e-3 * 11);
}

TEST(Projective, TheInertiaMetricSinksAndCreepsAsDocumentedAndSaysSo) {
  const Sheet sheet = square_sheet(0.2, 10);
  const double carried = 121.0 / 11;
  double last_penetration = 1;
  for (const int iterations : {10, 30}) {
    Environment environment = over_a_peg(sheet, 0.5);
    environment.gravity = g * Vector3d(0, std::sin(0.2), -std::cos(0.2));
    environment.materials[0].air_drag = 10;
    ProjectiveSettings settings;
    settings.metric = ContactMetric::inertia;
    settings.iterations = iterations;
    ProjectiveSolver solver(sheet, settings);
    ProjectiveReport report;
    for (int k = 0; k < 200; ++k) report = solver.step(environment);
    const double estimate = carried * g * h * h / iterations;
    // The estimate is one of size: neighbours help to carry.
    EXPECT_GT(report.penetration_max, 0.1 * estimate);
    EXPECT_LT(report.penetration_max, 3 * estimate);
    EXPECT_LT(report.penetration_max, last_penetration);
    EXPECT_GT(creep(sheet, environment), 1e-3);
    EXPECT_NE(report.warning.find("use metric full"), std::string::npos);
    last_penetration = report.penetration_max;
  }
}

TEST(Projective, ConvergesToTheStepThatNewtonsMethodFinds) {
  // Two formulations of one law: multipliers with a Schur complement here, constraints condensed into
  // vertices there.
  const Sheet sheet = square_sheet(0.2, 6);
  for (const auto constitutive : {data::Constitutive::tri_arap, data::Constitutive::tri_corotated,
                                  data::Constitutive::tri_stvk, data::Constitutive::tri_neohookean})
    for (const auto bending :
         {data::BendingModel::plate, data::BendingModel::isometric, data::BendingModel::hinge}) {
      if (constitutive != data::Constitutive::tri_corotated && bending != data::BendingModel::plate) continue;
      Environment a = environment_of(sheet);
      a.materials[0].constitutive = constitutive;
      a.materials[0].bending_model = bending;
      a.materials[0].membrane_stiffness = 60;
      a.materials[0].bending_rigidity = 1e-4;
      a.materials[0].air_drag = 0.5;
      a.materials[0].stiffness_damping = 1e-3;
      a.materials[0].friction = 0.3;
      a.obstacles.push_back({Plane{}});
      a.loads.push_back({24, {0.01, 0, 0.005}});
      // A corner is lifted off the table and dragged.
      data::Trajectory gripper;
      for (int k = 0; k <= 20; ++k) {
        Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
        pose.translation() = Vector3d(0.3 * k * h, 0.1 * k * h, 0.4 * k * h);
        gripper.times.push_back(k * h);
        gripper.poses.push_back(pose);
      }
      a.holds = {gripped(a, {0, 1}, gripper, h)};
      Environment b = a;
      ProjectiveSettings settings;
      settings.iterations = 3000;
      settings.acceleration = 10;
      settings.tolerance = 1e-8;
      ProjectiveSolver projective(sheet, settings);
      SolverSettings newton_settings;
      newton_settings.tolerance = 1e-9;
      newton_settings.max_iterations = 200;
      Solver newton(sheet, newton_settings);
      for (int k = 0; k < 10; ++k) {
        const ProjectiveReport report = projective.step(a);
        const StepReport expected = newton.step(b);
        EXPECT_TRUE(report.converged) << k << " " << report.residual;
        EXPECT_TRUE(expected.converged) << k << " " << expected.residual;
        const double difference = (a.state.positions - b.state.positions).cwiseAbs().maxCoeff();
        EXPECT_LE(difference, 1e-9) << k;  // |r| / |M g| <= 1e-8: h^2 g 1e-8 times the vertices that share it
        EXPECT_LE((report.hold_forces[0] - expected.hold_forces[0]).norm(), 1e-8);
        EXPECT_LE((report.obstacle_forces[0] - expected.obstacle_forces[0]).norm(), 1e-8);
        b.state = a.state;
      }
    }
}

TEST(Projective, AnUnconvergedStepIsReported) {
  const Sheet sheet = square_sheet(0.2, 10);
  Environment environment = over_a_peg(sheet, 0.5);
  ProjectiveSettings settings;
  settings.iterations = 3;
  ProjectiveSolver solver(sheet, settings);
  const ProjectiveReport report = solver.step(environment);
  EXPECT_FALSE(report.converged);
  EXPECT_EQ(report.iterations, 3);
  EXPECT_GT(report.residual, settings.tolerance);
}

TEST(Projective, EveryNamedSolverSolvesTheMetricOfARealSheet) {
  // 25 contacts in the middle of a stiff sheet, the rest free: neighbours coupled over the whole patch.
  const Sheet sheet = square_sheet(0.2, 8);
  const auto plan = make_sheet_plan(sheet);
  Environment environment = environment_of(sheet);
  environment.materials[0].membrane_stiffness = 300;
  environment.obstacles.push_back({Box{.half_extents = {0.051, 0.051, 0.01},
                                       .pose = Eigen::Isometry3d(Eigen::Translation3d(0.1, 0.1, -0.01))},
                                   {0.3}});
  ProjectiveSystem system(*plan, environment.materials, h);
  system.hold({std::vector<int>{0, 8}, {0}, {0, 8, 40}});
  std::vector<Vector3d> free_axes(81, Vector3d::Ones());
  const auto contacts = find_contacts(sheet, environment, h, h, environment.state.positions,
                                      Eigen::VectorXd::Constant(81, 1e-6), free_axes, 0.3);
  ASSERT_EQ(contacts.size(), 25u);
  const Eigen::MatrixXd W = full_metric(contacts, system);
  // Column by column against the definition, with A^-1 on the free coordinates.
  for (int j = 0; j < W.cols(); j += 7) {
    const Points u = system.solve(contact_forces(contacts, Eigen::VectorXd::Unit(W.cols(), j), 81));
    EXPECT_LE((along_contacts(contacts, u) - W.col(j)).norm(), 1e-10 * W.col(j).norm());
    EXPECT_EQ(u(0, 1), 0);
    EXPECT_NEAR(u.row(8).norm(), std::abs(u(8, 1)), 1e-15);
  }
  const Eigen::VectorXd b = W * Eigen::VectorXd::LinSpaced(W.cols(), -1, 1);
  const Eigen::VectorXd exact = W.partialPivLu().solve(b);
  for (const std::string& name : dual_solver_names()) {
    DualSolverSettings settings;
    settings.solver = dual_solver_from_name(name);
    const DualSolution found = solve_symmetric(W, b, settings);
    EXPECT_TRUE(found.converged) << name;
    EXPECT_LE((b - W * found.x).norm(), 2 * settings.tolerance * b.norm()) << name;
    EXPECT_LE((found.x - exact).norm(), 1e-5 * exact.norm()) << name;
  }
}

}  // namespace
}  // namespace flash::sim
