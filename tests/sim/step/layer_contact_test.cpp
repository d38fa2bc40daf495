#include "sim/step/layer_contact.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <random>

#include "sim/law/vertex_contact.h"
#include "sim/step/moving_obstacles.h"
#include "tests/sim/sheet_scene.h"

namespace flash::sim {
namespace {

using data::Points;
using Eigen::Vector3d;

constexpr double time_step = 0.01;

/// Two irregular sheets, the second above the first and turned against it, each somewhat bent.
struct TwoLayers {
  Sheet sheet;
  Environment environment;

  explicit TwoLayers(double distance, double friction, double bend = 2e-4) {
    const Sheet both[2] = {small_sheet(6, 0.06), small_sheet(5, 0.05)};
    sheet = joined(both);
    environment = environment_of(sheet);
    environment.materials.resize(2);
    environment.self_contact = SelfContact{.thickness = 1e-3, .friction = friction, .pressure = 2500};
    Points& x = environment.state.positions;
    auto upper = rows_of(sheet.bodies[1], x);
    upper = (upper * Eigen::AngleAxisd(0.3, Vector3d::UnitZ()).toRotationMatrix()).eval();
    upper.col(2).array() += distance;
    std::mt19937_64 engine(7);
    std::uniform_real_distribution<> even(-bend, bend);
    for (int i = 0; i < x.rows(); ++i) x(i, 2) += even(engine);
  }
};

std::vector<bool> none_carried(const Environment& environment) {
  return std::vector<bool>(static_cast<std::size_t>(environment.state.positions.rows()), false);
}

Points forces_at(LayerStep& step, const Points& x, LayerContact& contact) {
  Points force = Points::Zero(x.rows(), 3);
  step.add_forces(x, contact, force);
  return force;
}

TEST(LayerContact, PressureIsTheDerivativeOfItsEnergyAndConservesMomentum) {
  TwoLayers layers(6e-4, 0);
  LayerMemory memory(layers.sheet);
  LayerStep step(memory, layers.environment, time_step, none_carried(layers.environment));
  const Points& x = layers.environment.state.positions;
  LayerContact contact;
  const Points force = forces_at(step, x, contact);
  EXPECT_GT(contact.touches.size(), 50u);
  const double size = force.cwiseAbs().sum();
  EXPECT_LT(force.colwise().sum().norm(), 1e-14 * size);
  Vector3d turn = Vector3d::Zero();
  for (int i = 0; i < x.rows(); ++i) turn += Vector3d(x.row(i)).cross(Vector3d(force.row(i)));
  EXPECT_LT(turn.norm(), 1e-14 * size);
  // The step is a millionth of the distance; nearest points of edges that change their kind within it count
  // to the order of the step as well.
  constexpr double move = 1e-9;
  std::mt19937_64 engine(2);
  std::uniform_real_distribution<> even(-1, 1);
  for (int draw = 0; draw < 20; ++draw) {
    Points along(x.rows(), 3);
    for (double& value : along.reshaped()) value = even(engine);
    const double slope = (step.energy(x + move * along) - step.energy(x - move * along)) / (2 * move);
    EXPECT_NEAR(slope, force.cwiseProduct(along).sum(), 1e-5 * size);
  }
}

TEST(LayerContact, FrictionIsTheDerivativeOfItsPotentialAtTheForcesOfTheIterate) {
  TwoLayers layers(6e-4, 0.4);
  LayerMemory memory(layers.sheet);
  LayerStep step(memory, layers.environment, time_step, none_carried(layers.environment));
  TwoLayers smooth(6e-4, 0);
  LayerStep without(memory, smooth.environment, time_step, none_carried(smooth.environment));
  std::mt19937_64 engine(2);
  std::uniform_real_distribution<> even(-1, 1);
  for (const double slip : {3e-7, 1e-5}) {  // bristles bend over 1e-6 m
    Points x = layers.environment.state.positions;
    for (double& value : x.reshaped()) value += slip * even(engine);
    LayerContact contact, other;
    const Points force = forces_at(step, x, contact) - forces_at(without, x, other);
    const double size = force.cwiseAbs().sum();
    ASSERT_GT(size, 0);
    EXPECT_LT(force.colwise().sum().norm(), 1e-12 * size);
    constexpr double move = 1e-10;
    for (int draw = 0; draw < 10; ++draw) {
      Points along(x.rows(), 3);
      for (double& value : along.reshaped()) value = even(engine);
      const double slope = (step.friction_potential(contact, x + move * along) -
                            step.friction_potential(contact, x - move * along)) /
                           (2 * move);
      EXPECT_NEAR(slope, force.cwiseProduct(along).sum(), 1e-4 * size) << slip;
    }
  }
}

/// A triangle that comes down on another with a corner, or with an edge on an edge. It moves as a whole, and
/// so the normal does not turn: nothing is left out of the stiffness.
TEST(LayerContact, StiffnessIsTheDerivativeOfTheForce) {
  const auto triangle = [](const Vector3d& a, const Vector3d& b, const Vector3d& c) {
    data::TriangleMesh mesh;
    mesh.vertices.resize(3, 3);
    mesh.vertices << a.transpose(), b.transpose(), c.transpose();
    mesh.triangles.resize(1, 3);
    mesh.triangles << 0, 1, 2;
    return make_sheet(mesh);
  };
  constexpr double above = 6e-4, friction = 0.4;
  const Sheet corner[2] = {triangle({-0.1, -0.1, 0}, {0.1, -0.1, 0}, {0, 0.1, 0}),
                           triangle({0, 0, above}, {0.03, 0, 0.05}, {-0.03, 0.01, 0.05})};
  const Sheet edges[2] = {triangle({-0.1, 0.01, 0}, {0.1, -0.02, 0}, {0, 0, -0.1}),
                          triangle({0, -0.1, above}, {0.02, 0.1, above}, {0, 0, 0.1})};
  for (const bool by_edges : {false, true}) {
    Environment environment;
    const Sheet sheet = joined(by_edges ? edges : corner);
    environment = environment_of(sheet);
    environment.self_contact = SelfContact{.thickness = 1e-3, .friction = friction, .pressure = 2500};
    LayerMemory memory(sheet);
    LayerStep step(memory, environment, time_step, none_carried(environment));
    for (const double slip : {3e-7, 1e-5}) {  // the bristles bend, or slide
      Points x = environment.state.positions;
      x.bottomRows(3).rowwise() += Eigen::RowVector3d(slip, 0.5 * slip, 0);
      LayerContact contact;
      forces_at(step, x, contact);
      ASSERT_EQ(contact.touches.size(), 1u);
      ASSERT_EQ(contact.touches[0].kind == PairKind::edge_edge, by_edges);
      contact.touches[0].dual = contact.touches[0].slip_direction;
      const LayerTouch& touch = contact.touches[0];
      const Eigen::Matrix3d expected =
          matrix3d(stiffness_of(touch, friction, time_step)) -
          vector3d(friction_coupling_of(touch, friction)) * vector3d(touch.normal).transpose();
      constexpr double move = 1e-10;
      for (int axis = 0; axis < 3; ++axis) {
        const auto pushed = [&](double way) {
          Points y = x;
          y.bottomRows(3).col(axis).array() += way;
          LayerContact unused;
          return Vector3d(forces_at(step, y, unused).bottomRows(3).colwise().sum().transpose());
        };
        const Vector3d slope = (pushed(move) - pushed(-move)) / (2 * move);
        EXPECT_LT((slope - expected.col(axis)).norm(), 1e-4 * expected.norm()) << by_edges << axis;
      }
    }
  }
}

/// A mass on a spring that friction holds: m x + mu N z(x) = f with |f| < mu N. Newton's method on x goes
/// from sliding to sliding; with the duals it ends within the bristles, from 10,000 times their length, in
/// few steps.
TEST(LayerContact, DualsLetWhatSlidesStop) {
  TwoLayers layers(6e-4, 0.4);
  LayerMemory memory(layers.sheet);
  const LayerStep step(memory, layers.environment, time_step, none_carried(layers.environment));
  const double length = bristle_length(time_step);
  constexpr double spring = 1, bound = 1;  // [N/m], [N]
  const Vector3<double> pull{0.3, -0.5, 0};
  LayerContact now, next;
  now.touches.resize(1);
  now.touches[0].normal = {0, 0, 1};
  now.touches[0].normal_force = bound;
  Vector3<double> slip{1e4 * length, 3e3 * length, 0};
  const auto place = [&](const Vector3<double>& at, LayerTouch& touch) {
    touch.slip = norm(at);
    touch.slip_direction = (1 / friction_length(touch.slip, time_step)) * at;
  };
  place(slip, now.touches[0]);
  int iterations = 0;
  const auto residual = [&] { return spring * slip + bound * now.touches[0].slip_direction - pull; };
  for (; iterations < 60 && norm(residual()) > 1e-9; ++iterations) {
    const Eigen::Matrix3d matrix =
        spring * Eigen::Matrix3d::Identity() + matrix3d(stiffness_of(now.touches[0], 1.0, time_step));
    EXPECT_GE(Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(matrix).eigenvalues()[0], spring * (1 - 1e-9));
    slip = slip - vector3(Vector3d(matrix.ldlt().solve(vector3d(residual()))));
    next = now;
    place(slip, next.touches[0]);
    step.carry_duals(now, 1, next);
    EXPECT_LE(norm(next.touches[0].dual), 1 + 1e-15);
    now = next;
  }
  EXPECT_LE(iterations, 15);
  // The bristles balance the pull, but for what the spring adds at their length.
  EXPECT_LT(norm(slip - length * pull), 1e-3 * length);
}

TEST(LayerContact, BristlesComeBackInTheNextStep) {
  TwoLayers layers(6e-4, 0.4);
  LayerMemory memory(layers.sheet);
  Points x = layers.environment.state.positions;
  rows_of(layers.sheet.bodies[1], x).col(0).array() += 5e-7;
  LayerContact contact;
  {
    LayerStep step(memory, layers.environment, time_step, none_carried(layers.environment));
    forces_at(step, x, contact);
    layers.environment.state.pair_bristles = step.bristles_at_end(contact);
  }
  ASSERT_EQ(layers.environment.state.pair_bristles.size(), contact.touches.size());
  layers.environment.state.positions = x;
  LayerStep next(memory, layers.environment, time_step, none_carried(layers.environment));
  LayerContact again;
  forces_at(next, x, again);
  ASSERT_EQ(again.touches.size(), contact.touches.size());
  for (std::size_t k = 0; k < contact.touches.size(); ++k) {
    ASSERT_EQ(again.touches[k].vertices, contact.touches[k].vertices);
    EXPECT_NEAR(again.touches[k].slip, contact.touches[k].slip, 1e-12);
    EXPECT_NEAR(norm(again.touches[k].slip_direction - contact.touches[k].slip_direction), 0, 1e-6);
  }
}

}  // namespace
}  // namespace flash::sim
