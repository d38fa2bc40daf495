#include "sim/scene/hold.h"

#include <gtest/gtest.h>

#include <cmath>

#include "data/files/error.h"
#include "sim/oracle/projective.h"
#include "tests/sim/sheet_scene.h"

namespace flash::sim {
namespace {

using data::Points;
using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr double h = 0.01;
constexpr double g = 9.81;

/// Both integrators keep the same promises about grasps.
template <typename Integrator>
struct Tight;

template <>
struct Tight<Solver> {
  static Solver make(const Sheet& sheet) { return Solver(sheet, {.max_iterations = 100, .tolerance = 1e-7}); }
};

template <>
struct Tight<ProjectiveSolver> {
  static ProjectiveSolver make(const Sheet& sheet) {
    return ProjectiveSolver(sheet, {.iterations = 3000, .tolerance = 1e-6, .acceleration = 10});
  }
};

template <typename Integrator>
class Grasping : public testing::Test {};
using Integrators = testing::Types<Solver, ProjectiveSolver>;
TYPED_TEST_SUITE(Grasping, Integrators);

/// A gripper that turns, climbs and swings, sampled at twice the step rate.
data::Trajectory swinging_gripper(double seconds, const Vector3d& start = Vector3d::Zero()) {
  data::Trajectory trajectory;
  for (int k = 0; k <= 2 * static_cast<int>(std::lround(seconds / h)); ++k) {
    const double t = 0.5 * k * h;
    Isometry3d pose = Isometry3d::Identity();
    pose.translation() = start + Vector3d(0.03 * std::sin(3 * t), 0.2 * t * t, 0.1 * t);
    pose.linear() = Eigen::AngleAxisd(0.8 * t, Vector3d(1, 2, 3).normalized()).toRotationMatrix();
    trajectory.times.push_back(t);
    trajectory.poses.push_back(pose);
  }
  return trajectory;
}

data::Trajectory still_gripper(const Vector3d& position) {
  data::Trajectory trajectory;
  trajectory.times = {0.0};
  trajectory.poses = {Isometry3d(Eigen::Translation3d(position))};
  return trajectory;
}

Eigen::VectorXd masses(const Sheet& sheet, const Environment& environment) {
  return environment.materials[0].areal_density * sheet.vertex_area;
}

Vector3d momentum(const Sheet& sheet, const Environment& environment) {
  return (masses(sheet, environment).transpose() * environment.state.velocities).transpose();
}

std::vector<int> near_corner(const Sheet& sheet, double radius) {
  std::vector<int> vertices;
  for (int i = 0; i < sheet.rest.vertices.rows(); ++i)
    if (sheet.rest.vertices.row(i).norm() < radius) vertices.push_back(i);
  return vertices;
}

TYPED_TEST(Grasping, HeldVerticesFollowTheGripperRigidly) {
  const Sheet sheet = small_sheet();
  Environment environment = environment_of(sheet);
  const data::Trajectory gripper = swinging_gripper(0.5, {0.01, 0.01, 0.02});
  const std::vector<int> held = near_corner(sheet, 0.035);
  ASSERT_GE(held.size(), 3u);
  environment.holds = {gripped(environment, held, gripper)};
  auto solver = Tight<TypeParam>::make(sheet);
  const Isometry3d first = data::pose_at(gripper, 0).inverse();
  for (int n = 1; n <= 40; ++n) {
    solver.step(environment);  // converged or not: held coordinates are prescribed
    const Isometry3d moved = data::pose_at(gripper, n * h) * first;
    for (const int i : held) {
      const Vector3d expected = moved * sheet.rest.vertices.row(i).transpose();
      // The promise is 1e-6 m; rounding is all there is.
      EXPECT_LE((environment.state.positions.row(i).transpose() - expected).norm(), 1e-12);
    }
  }
}

TYPED_TEST(Grasping, ReactionIsWeightPlusInertiaInEveryStep) {
  const Sheet sheet = small_sheet();
  Environment environment = environment_of(sheet);
  environment.materials[0].stiffness_damping = 1e-3;
  environment.materials[0].bending_rigidity = 1e-3;  // projective dynamics does not converge on a limp one
  environment.holds = {gripped(environment, near_corner(sheet, 0.035), swinging_gripper(0.5))};
  auto solver = Tight<TypeParam>::make(sheet);
  const double mass = masses(sheet, environment).sum();
  for (int n = 1; n <= 40; ++n) {
    const Vector3d before = momentum(sheet, environment);
    const StepReport report = solver.step(environment);
    // Newton's second law of the whole sheet over the step: nothing else acts on it.
    const Vector3d expected = (momentum(sheet, environment) - before) / h - mass * environment.gravity;
    EXPECT_LE((report.hold_forces[0] - expected).norm(), 1e-4 * expected.norm()) << n;  // 0.1 % is promised
  }
}

TYPED_TEST(Grasping, AtRestTheGripperCarriesTheWeight) {
  const Sheet sheet = small_sheet(4);
  Environment environment = environment_of(sheet);
  environment.materials[0].air_drag = 20;
  environment.materials[0].bending_rigidity = 1e-3;
  environment.holds = {gripped(environment, near_corner(sheet, 0.05), still_gripper(Vector3d::Zero()))};
  auto solver = Tight<TypeParam>::make(sheet);
  StepReport report;
  for (int n = 0; n < 150; ++n) report = solver.step(environment);
  const double weight = masses(sheet, environment).sum() * g;
  EXPECT_LE((report.hold_forces[0] - Vector3d(0, 0, weight)).norm(), 1e-3 * weight);
}

TYPED_TEST(Grasping, ReleasedItFallsAndTakenAgainItKeepsItsNewPlaceInTheGripper) {
  const Sheet sheet = small_sheet();
  Environment environment = environment_of(sheet);
  const data::Trajectory path = swinging_gripper(0.5);
  Hold first = gripped(environment, near_corner(sheet, 0.035), path), second = first;
  first.to = 0.1;
  second.from = 0.2;
  environment.holds = {first, second};
  auto solver = Tight<TypeParam>::make(sheet);
  const double mass = masses(sheet, environment).sum();
  Points offsets;
  for (int n = 1; n <= 35; ++n) {
    const double start = (n - 1) * h;
    const Points before = environment.state.positions;
    const Vector3d momentum_before = momentum(sheet, environment);
    const StepReport report = solver.step(environment);
    if (n == 21) {
      const Isometry3d gripper = data::pose_at(path, start).inverse();
      offsets.resize(Eigen::Index(second.vertices.size()), 3);
      for (std::size_t v = 0; v < second.vertices.size(); ++v)
        offsets.row(v) = gripper * before.row(second.vertices[v]).transpose();
    }
    if (n > 10 && n <= 20) {
      EXPECT_EQ(report.hold_forces[0].norm(), 0);
      EXPECT_EQ(report.hold_forces[1].norm(), 0);
      const Vector3d acceleration = (momentum(sheet, environment) - momentum_before) / (h * mass);
      EXPECT_LE((acceleration - environment.gravity).norm(), 1e-5 * g) << n;
    }
    if (n > 20)
      for (std::size_t v = 0; v < second.vertices.size(); ++v) {
        const Vector3d expected = data::pose_at(path, n * h) * Vector3d(offsets.row(v).transpose());
        EXPECT_LE((environment.state.positions.row(second.vertices[v]).transpose() - expected).norm(), 1e-12);
      }
    const bool held = n <= 10 || n > 20;
    EXPECT_EQ(report.hold_forces[n > 20 ? 1 : 0].norm() > 0, held) << n;
  }
}

TYPED_TEST(Grasping, TwoEndEffectorsPullWithTheTensionOfTheSheet) {
  const double side = 0.12, strain = 0.05, stiffness = 80;
  const Sheet sheet = small_sheet(6, side);
  Environment environment = environment_of(sheet);
  environment.gravity.setZero();
  environment.materials[0].membrane_stiffness = stiffness;
  environment.materials[0].poissons_ratio = 0;
  environment.materials[0].air_drag = 200;
  std::vector<int> left, right;
  for (int i = 0; i < sheet.rest.vertices.rows(); ++i) {
    if (sheet.rest.vertices(i, 0) < 1e-9) left.push_back(i);
    if (sheet.rest.vertices(i, 0) > side - 1e-9) right.push_back(i);
  }
  environment.holds = {
      gripped(environment, left, still_gripper(Vector3d::Zero())),
      gripped(environment, right, straight_path(Vector3d::Zero(), Vector3d(strain * side, 0, 0), 0.1))};
  auto solver = Tight<TypeParam>::make(sheet);
  StepReport report;
  for (int n = 0; n < 150; ++n) report = solver.step(environment);
  // nu = 0: the stretch is uniform, T = E t e, on the clamped width.
  const double tension = stiffness * strain * side;
  EXPECT_NEAR(report.hold_forces[1].x(), tension, 1e-3 * tension);
  EXPECT_NEAR(report.hold_forces[0].x(), -tension, 1e-3 * tension);
  EXPECT_LE((report.hold_forces[0] + report.hold_forces[1]).norm(), 1e-4 * tension);
  for (int i = 0; i < sheet.rest.vertices.rows(); ++i)
    EXPECT_NEAR(environment.state.positions(i, 0), (1 + strain) * sheet.rest.vertices(i, 0), 1e-5);
}

TYPED_TEST(Grasping, ZeroLengthPullsToTheGripperWhereKeptOffsetsDoNot) {
  const Sheet sheet = small_sheet();
  for (const bool zero_length : {false, true}) {
    Environment environment = environment_of(sheet);
    Hold grasp = gripped(environment, near_corner(sheet, 0.035), still_gripper({0.01, 0.01, 0.005}));
    grasp.closing_time = 0.1;
    grasp.at_origin = zero_length;
    environment.holds = {grasp};
    auto solver = Tight<TypeParam>::make(sheet);
    double last = 1;
    for (int n = 1; n <= 15; ++n) {
      solver.step(environment);
      double farthest = 0;
      for (const int i : grasp.vertices) {
        const Vector3d x = environment.state.positions.row(i);
        farthest = std::max(farthest, (x - Vector3d(0.01, 0.01, 0.005)).norm());
        const double moved = (x.transpose() - sheet.rest.vertices.row(i)).norm();
        EXPECT_TRUE(zero_length || moved <= 1e-12) << moved;
      }
      if (zero_length) {
        EXPECT_LE(farthest, last);
        EXPECT_TRUE(n < 10 || farthest <= 1e-12) << farthest;
        EXPECT_TRUE(n != 5 || farthest > 1e-3) << farthest;  // on its way, not at once
      }
      last = farthest;
    }
  }
}

TYPED_TEST(Grasping, AHeldCornerOverATableSharesTheWeightWithIt) {
  const Sheet sheet = small_sheet();
  Environment environment = environment_of(sheet);
  environment.obstacles.push_back({Plane{}, {0.3}});
  environment.materials[0].air_drag = 5;
  environment.holds = {gripped(environment, near_corner(sheet, 0.025),
                               straight_path(Vector3d::Zero(), Vector3d(0.01, 0.01, 0.03), 0.3))};
  auto solver = Tight<TypeParam>::make(sheet);
  const Eigen::VectorXd mass = masses(sheet, environment);
  for (int n = 1; n <= 40; ++n) {
    const Vector3d before = momentum(sheet, environment);
    const StepReport report = solver.step(environment);
    EXPECT_TRUE(report.converged) << n;
    EXPECT_LE(report.penetration_max, 1e-7);
    const Vector3d drag = -environment.materials[0].air_drag * momentum(sheet, environment);
    const Vector3d expected =
        (momentum(sheet, environment) - before) / h - mass.sum() * environment.gravity - drag;
    const Vector3d found = report.hold_forces[0] + report.obstacle_forces[0];
    // The halves of a step have each their own drag: their mean is within that of the change of momentum.
    const double halved = report.substeps > 1 ? environment.materials[0].air_drag *
                                                    (momentum(sheet, environment) - before).norm()
                                              : 0;
    EXPECT_LE((found - expected).norm(), 1e-4 * expected.norm() + halved) << n;
    EXPECT_GE(report.obstacle_forces[0].z(), 0);
  }
}

/// A strip of `small_sheet` without weight; vertex 0 is a corner.
Environment weightless(const Sheet& sheet) {
  Environment environment = environment_of(sheet);
  environment.gravity.setZero();
  return environment;
}

TEST(Hold, MovesASupportEvenlyAndSaysWhenItHasArrived) {
  const Sheet sheet = small_sheet();
  Environment environment = weightless(sheet);
  const Vector3d start = sheet.rest.vertices.row(0), end = start + Vector3d(0, 0, 0.02);
  Hold moving = support(0, {true, true, true}, end);
  moving.from = 0;
  moving.closing_time = 0.1;
  moving.closing = Closing::even;
  environment.holds = {moving};
  Solver solver(sheet, {});
  for (int n = 1; n <= 12; ++n) {
    solver.step(environment);
    const double share = std::min(1.0, n / 10.0);
    EXPECT_LE((environment.state.positions.row(0).transpose() - (start + share * (end - start))).norm(),
              1e-12);
    EXPECT_EQ(motion_is_over(environment), n >= 10) << n;
  }
}

TEST(Hold, GoesToADistantPlaceInOneStepAndHalfwayInHalfOfIt) {
  const Sheet sheet = small_sheet();
  Environment environment = weightless(sheet);
  const Vector3d start = sheet.rest.vertices.row(0), end = start + Vector3d(0, 0, 0.01);
  environment.holds = {support(0, {true, true, true}, end)};
  update_holds(environment, h);
  const auto place_at = [&](double time) {
    return Vector3d(held_places(environment.holds[0], environment.state.held[0], time).row(0));
  };
  EXPECT_LE((place_at(0.5 * h) - 0.5 * (start + end)).norm(), 1e-15);
  EXPECT_EQ(place_at(h), end);
  EXPECT_EQ(place_at(9 * h), end);
}

TEST(Hold, OfTwoOnAVertexTheLaterRulesEachAxisThatItHolds) {
  const Sheet sheet = small_sheet();
  Environment environment = environment_of(sheet);
  const Vector3d start = sheet.rest.vertices.row(0);
  const Hold clamp = support(0, {true, true, true}, start);
  const Hold lifted = support(0, {false, false, true}, start + Vector3d(0, 0, 0.003));
  environment.holds = {clamp, lifted};
  const StepReport report = Solver(sheet, {}).step(environment);
  EXPECT_LE((environment.state.positions.row(0).transpose() - start - Vector3d(0, 0, 0.003)).norm(), 1e-15);
  EXPECT_EQ(report.hold_forces[0].z(), 0);
  EXPECT_GT(report.hold_forces[1].z(), 0);
  EXPECT_EQ(report.hold_forces[1].head<2>().norm(), 0);
}

TEST(Hold, AReachTakesWhatIsInItWhenItCloses) {
  const Sheet sheet = small_sheet();
  Environment environment = weightless(sheet);
  environment.holds = {{.name = "hand", .from = 2 * h, .reach = Reach{.threshold = 0.011}}};
  Solver solver(sheet, {});
  for (int n = 1; n <= 3; ++n) {
    solver.step(environment);
    EXPECT_EQ(environment.state.held[0].vertices.empty(), n < 3) << n;
  }
  // Within 11 mm of a box of 20 mm about the corner: cells of 20 mm, whose vertices jitter by less than half.
  EXPECT_EQ(environment.state.held[0].vertices, near_corner(sheet, 0.0211));
}

TEST(Hold, AReachWithoutAVertexIsRefusedByName) {
  const Sheet sheet = small_sheet();
  Environment environment = weightless(sheet);
  environment.state.positions.col(2).array() += 0.5;
  environment.holds = {{.name = "hand", .reach = Reach{.object = "towel"}}};
  try {
    Solver(sheet, {}).step(environment);
    FAIL() << "a hand that takes nothing";
  } catch (const data::InputError& error) {
    EXPECT_STREQ(error.what(),
                 "end effector hand: grasps: no vertex of towel within 0.01 m of its box at 0 s; the nearest "
                 "is 0.49 m away");
  }
}

TEST(Hold, OneThatFollowsAnotherBetweenTwoStepsLeavesNoStepOut) {
  const Sheet sheet = small_sheet();
  for (const double change : {0.02, 0.0201, 0.025, 0.0299}) {
    Environment environment = environment_of(sheet);
    Hold first = support(0, {true, true, true}, sheet.rest.vertices.row(0)), second = first;
    first.to = second.from = change;
    environment.holds = {first, second};
    Solver solver(sheet, {});
    for (int n = 1; n <= 5; ++n) {
      const StepReport report = solver.step(environment);
      EXPECT_GT((report.hold_forces[0] + report.hold_forces[1]).norm(), 0) << change << " " << n;
      EXPECT_EQ(environment.state.positions.row(0), sheet.rest.vertices.row(0));
    }
    EXPECT_TRUE(environment.state.held[0].vertices.empty());
  }
}

TEST(Hold, MotionIsNotOverBeforeWhatIsStillToCome) {
  const Sheet sheet = small_sheet();
  Environment still = weightless(sheet);
  EXPECT_TRUE(motion_is_over(still));
  Environment later = still;
  later.holds = {support(0, {true, true, true}, sheet.rest.vertices.row(0))};
  later.holds[0].from = 1;
  EXPECT_FALSE(motion_is_over(later));
  later.holds[0].from = 0;
  later.holds[0].to = 1;
  EXPECT_FALSE(motion_is_over(later));
  Environment moved = still;
  add_frame(moved, straight_path(Vector3d::Zero(), Vector3d::UnitX(), 1));
  moved.state.time = 0.99;
  EXPECT_FALSE(motion_is_over(moved));
  moved.state.time = 1;
  EXPECT_TRUE(motion_is_over(moved));
}

}  // namespace
}  // namespace flash::sim
