// Several bodies in one environment. They do not touch each other, so that each has to move as it does alone.

#include <gtest/gtest.h>

#include "sim/newton/step_problem.h"
#include "sim/oracle/projective_system.h"
#include "tests/sim/sheet_scene.h"

namespace flash::sim {
namespace {

using data::Points;
using Eigen::Vector3d;

constexpr double time_step = 0.01;

// Friction sets in over a slip of 1e-8 m: a vertex near the rim of its cone may creep by some of that. What
// the tolerance of the solver leaves, h^2 g 1e-9 times the vertices that share it, is less.
constexpr double same_position = 1e-7;                      // [m]
constexpr double same_force = 300 * same_position;          // by the stiffest membrane [N]
constexpr double same_energy = same_force * 1 * time_step;  // over the way of a step at 1 m/s [J]

/// Sheets with an environment for each.
struct Worlds {
  std::vector<Sheet> sheets;
  std::vector<Environment> environments;
};

/// The same in one environment. All have the same obstacles; friction is each one's own.
struct JoinedWorld {
  Sheet sheet;
  Environment environment;
};

JoinedWorld join(const Worlds& worlds) {
  JoinedWorld whole{joined(worlds.sheets), worlds.environments.front()};
  Environment& environment = whole.environment;
  environment.materials.clear();
  environment.holds.clear();
  environment.loads.clear();
  for (Obstacle& obstacle : environment.obstacles) obstacle.friction.clear();
  const Eigen::Index vertices = whole.sheet.rest.vertices.rows();
  environment.state.positions.resize(vertices, 3);
  environment.state.velocities.resize(vertices, 3);
  for (std::size_t b = 0; b < worlds.environments.size(); ++b) {
    const Environment& own = worlds.environments[b];
    const Body& body = whole.sheet.bodies[b];
    environment.materials.push_back(own.materials[0]);
    rows_of(body, environment.state.positions) = own.state.positions;
    rows_of(body, environment.state.velocities) = own.state.velocities;
    for (std::size_t k = 0; k < own.obstacles.size(); ++k)
      environment.obstacles[k].friction.push_back(friction_between(own, own.obstacles[k], 0));
    for (Hold hold : own.holds) {
      for (int& vertex : hold.vertices) vertex += body.first_vertex;
      environment.holds.push_back(hold);
    }
    for (const Load& load : own.loads)
      environment.loads.push_back({body.first_vertex + load.vertex, load.force});
  }
  return whole;
}

/// Three sheets of different meshes and materials: one slides down an incline and is blown at, one sticks to
/// it, one hangs from a hold and swings with damping.
Worlds three_sheets() {
  Worlds worlds;
  worlds.sheets = {small_sheet(6), small_sheet(5, 0.2), small_sheet(4, 0.1)};
  const Vector3d normal = Vector3d(0.3, 0, 1).normalized();
  for (std::size_t b = 0; b < worlds.sheets.size(); ++b) {
    Environment environment = environment_of(worlds.sheets[b]);
    Points& x = environment.state.positions;
    for (Eigen::Index i = 0; i < x.rows(); ++i) {
      x(i, 2) = -0.3 * x(i, 0) + (b == 2 ? 0.15 : 1e-4) + 5e-3 * std::pow(x(i, 1), 2);
      x(i, 1) += 0.4 * static_cast<double>(b);
    }
    environment.obstacles.push_back({Plane{Vector3d::Zero(), normal}, {b == 0 ? 0.1 : 0.8}});
    environment.obstacles.push_back({Box{.half_extents = {0.05, 0.5, 0.01},
                                         .pose = Eigen::Isometry3d(Eigen::Translation3d(0.35, 0.4, -0.1))}});
    data::SheetMaterial& material = environment.materials[0];
    material.membrane_stiffness = 100 * static_cast<double>(b + 1);
    material.areal_density = 0.1 * static_cast<double>(b + 1);
    material.bending_rigidity = 1e-4 / static_cast<double>(b + 1);
    material.poissons_ratio = 0.1 * static_cast<double>(b);
    if (b == 0) material.air_drag = 0.5;
    if (b == 1) material.constitutive = data::Constitutive::tri_stvk;
    if (b == 2) {
      material.stiffness_damping = 2e-3;
      environment.holds = {support(0, {true, true, true}, x.row(0).transpose())};
    }
    environment.loads = {{3, {0, 1e-3, 0}}};
    worlds.environments.push_back(environment);
  }
  return worlds;
}

/// Models of the three bodies: all the same, and mixed.
class Bodies : public testing::TestWithParam<std::array<data::BendingModel, 3>> {
 protected:
  Worlds worlds_ = [] {
    Worlds worlds = three_sheets();
    for (std::size_t b = 0; b < 3; ++b) worlds.environments[b].materials[0].bending_model = GetParam()[b];
    return worlds;
  }();
};

TEST_P(Bodies, EachMovesAsItDoesAlone) {
  JoinedWorld whole = join(worlds_);
  const SolverSettings settings{.time_step = time_step, .max_iterations = 200, .tolerance = 1e-9};
  Solver together(whole.sheet, settings);
  std::vector<Solver> alone;
  for (const Sheet& sheet : worlds_.sheets) alone.emplace_back(sheet, settings);
  double slid = 0, stuck = 0;
  for (int step = 0; step < 25; ++step) {
    const State before = whole.environment.state;
    const StepReport report = together.step(whole.environment);
    EXPECT_TRUE(report.converged) << step << " " << report.residual;
    Vector3d plane_force = Vector3d::Zero();
    double kinetic = 0, elastic = 0;
    for (std::size_t b = 0; b < worlds_.sheets.size(); ++b) {
      const Body& body = whole.sheet.bodies[b];
      Environment& own = worlds_.environments[b];
      own.state.positions = rows_of(body, before.positions);
      own.state.velocities = rows_of(body, before.velocities);
      const StepReport expected = alone[b].step(own);
      EXPECT_TRUE(expected.converged) << step << " " << expected.residual;
      EXPECT_LT(
          (rows_of(body, whole.environment.state.positions) - own.state.positions).cwiseAbs().maxCoeff(),
          same_position)
          << "body " << b << ", step " << step;
      plane_force += expected.obstacle_forces[0];
      kinetic += expected.kinetic;
      elastic += expected.membrane + expected.bending;
      for (std::size_t k = 0; k < expected.hold_forces.size(); ++k)
        EXPECT_LT((report.hold_forces[k] - expected.hold_forces[k]).norm(), same_force);
    }
    EXPECT_LT((report.obstacle_forces[0] - plane_force).norm(), same_force);
    EXPECT_NEAR(report.kinetic, kinetic, same_energy);
    EXPECT_NEAR(report.membrane + report.bending, elastic, same_energy);
    slid = whole.environment.state.velocities.row(10).norm();
    stuck = whole.environment.state.velocities.row(whole.sheet.bodies[1].first_vertex + 8).norm();
  }
  EXPECT_GT(slid, 10 * stuck);  // friction is each one's own
}

constexpr auto plate = data::BendingModel::plate, hinge = data::BendingModel::hinge,
               isometric = data::BendingModel::isometric;

INSTANTIATE_TEST_SUITE_P(Models, Bodies,
                         testing::Values(std::array{plate, plate, plate}, std::array{hinge, hinge, hinge},
                                         std::array{plate, hinge, isometric}),
                         [](const auto& models) {
                           std::string name;
                           for (const data::BendingModel model : models.param)
                             name += model == plate ? "Plate" : model == hinge ? "Hinge" : "Isometric";
                           return name;
                         });

TEST(BodiesTogether, ThePublishedMethodHasAMatrixBlockForEach) {
  const Worlds worlds = three_sheets();
  const JoinedWorld whole = join(worlds);
  const ProjectiveSystem together(*make_sheet_plan(whole.sheet), whole.environment.materials, time_step);
  Eigen::MatrixXd left = together.matrix();
  for (std::size_t b = 0; b < 3; ++b) {
    const ProjectiveSystem alone(*make_sheet_plan(worlds.sheets[b]), worlds.environments[b].materials,
                                 time_step);
    const Body& body = whole.sheet.bodies[b];
    left.block(body.first_vertex, body.first_vertex, body.vertex_count, body.vertex_count) -=
        Eigen::MatrixXd(alone.matrix());
  }
  EXPECT_EQ(left.cwiseAbs().maxCoeff(), 0);
}

TEST(BodiesTogether, EachIsSolvedToTheToleranceOfItsOwnWeight) {
  Worlds worlds = three_sheets();
  worlds.environments[0].materials[0].areal_density = 1e-3;
  JoinedWorld whole = join(worlds);
  update_holds(whole.environment, time_step);
  const auto plan = make_sheet_plan(whole.sheet);
  const StepProblem problem(*plan, whole.environment, time_step, {.speed = 1});
  Iterate iterate;
  iterate.positions = whole.environment.state.positions;
  iterate.contacts = begin_step(problem.contacts, iterate.positions);
  problem.evaluate(iterate);
  for (const Body& body : whole.sheet.bodies) {
    const double weight = 9.81 * rows_of(body, problem.potential.mass()).norm();
    const Points random = Points::Random(body.vertex_count, 3);
    iterate.residual.setZero();
    rows_of(body, iterate.residual) = 2e-3 * weight / random.norm() * random;
    EXPECT_NEAR(problem.relative_residual(iterate), 2e-3, 1e-15);
    EXPECT_FALSE(problem.balanced(iterate, 1.9e-3));
    EXPECT_TRUE(problem.balanced(iterate, 2.1e-3));
  }
}

TEST(BodiesTogether, APlanMakesABendingOperatorForABodyAndAPoissonsRatio) {
  const Worlds worlds = three_sheets();
  JoinedWorld whole = join(worlds);
  const auto plan = make_sheet_plan(whole.sheet);
  body_laws(*plan, whole.environment);
  EXPECT_EQ(count_bending_operators(*plan), 3u);
  whole.environment.materials[1].poissons_ratio = 0.4;
  body_laws(*plan, whole.environment);
  body_laws(*plan, whole.environment);
  EXPECT_EQ(count_bending_operators(*plan), 4u);
}

TEST(BodiesTogether, ABodyAloneIsTheSheetThatWasJoined) {
  const Worlds worlds = three_sheets();
  const Sheet whole = joined(worlds.sheets);
  ASSERT_EQ(whole.bodies.size(), 3u);
  for (std::size_t b = 0; b < 3; ++b) {
    const Sheet alone = body_alone(whole, whole.bodies[b]);
    const Sheet& sheet = worlds.sheets[b];
    EXPECT_EQ(alone.rest.vertices, sheet.rest.vertices);
    EXPECT_EQ(alone.rest.triangles, sheet.rest.triangles);
    EXPECT_EQ(alone.vertex_area, sheet.vertex_area);
    ASSERT_EQ(alone.triangles.size(), sheet.triangles.size());
    for (std::size_t t = 0; t < sheet.triangles.size(); ++t) {
      EXPECT_EQ(alone.triangles[t].vertices, sheet.triangles[t].vertices);
      EXPECT_EQ(alone.triangles[t].inverse_edges, sheet.triangles[t].inverse_edges);
    }
    EXPECT_EQ(body_of(whole, whole.bodies[b].first_vertex), static_cast<int>(b));
    EXPECT_EQ(body_of(whole, whole.bodies[b].first_vertex + whole.bodies[b].vertex_count - 1),
              static_cast<int>(b));
  }
}

TEST(BodiesTogether, AReachTakesVerticesOfItsOwnBodyAlone) {
  Worlds worlds;
  worlds.sheets = {small_sheet(4), small_sheet(4)};
  for (const Sheet& sheet : worlds.sheets) worlds.environments.push_back(environment_of(sheet));
  JoinedWorld whole = join(worlds);
  const Body& second = whole.sheet.bodies[1];
  whole.environment.holds = {{.name = "hand",
                              .reach = Reach{.object = "second",
                                             .first_vertex = second.first_vertex,
                                             .vertex_count = second.vertex_count,
                                             .half_extents = {0.01, 0.01, 0.01},
                                             .threshold = 1e-3}}};
  update_holds(whole.environment, time_step);
  EXPECT_EQ(whole.environment.state.held[0].vertices, (std::vector{second.first_vertex}));
}

}  // namespace
}  // namespace flash::sim
