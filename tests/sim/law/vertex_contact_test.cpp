// The formulas of one vertex beside those of contact sets.
#include "sim/law/vertex_contact.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "sim/newton/active_set.h"
#include "sim/step/feasible_positions.h"

namespace flash::sim {
namespace {

using data::Points;
using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double time_step = 0.01;
constexpr int vertices = 400;

/// Vertices above, on and in one to three obstacles, some of which move.
struct World {
  Environment environment;
  Points positions, force, direction;

  explicit World(unsigned seed) {
    std::mt19937 engine(seed);
    std::uniform_real_distribution<double> number(-1, 1);
    const auto vector = [&] { return Vector3d(number(engine), number(engine), number(engine)); };
    const auto pose = [&](double size) {
      return Isometry3d(Eigen::Translation3d(size * vector()) *
                        Eigen::AngleAxisd(size * number(engine), vector().normalized()));
    };
    const Isometry3d from = pose(0.02), to = pose(0.02);
    environment.schedule = std::make_shared<const Schedule>(Schedule{0, time_step, {{from, to}}});
    const int count = 1 + static_cast<int>(seed % 3);
    for (int k = 0; k < count; ++k) {
      Obstacle obstacle{Plane{0.01 * vector(), (vector() + 3 * Vector3d::UnitZ()).normalized()}};
      if ((seed / 3 + static_cast<unsigned>(k)) % 3 == 1)
        obstacle.shape = Box{0.02 * Vector3d::Ones() + 0.05 * vector().cwiseAbs(), pose(0.05)};
      if ((seed / 3 + static_cast<unsigned>(k)) % 3 == 2)
        obstacle.shape = Cylinder{0.02 * vector(), vector().normalized(), 0.03};
      obstacle.friction = {k == 1 ? 0 : 0.5};
      obstacle.frame = seed % 2 == 0 && k == 0 ? 0 : base_frame;
      environment.obstacles.push_back(obstacle);
    }
    const auto points = [&](double size) {
      Points p(vertices, 3);
      for (int i = 0; i < vertices; ++i) p.row(i) = size * vector();
      return p;
    };
    environment.state.positions = points(0.08);
    positions = environment.state.positions + points(0.01);
    // Some rest where their surface takes them.
    for (int i = 0; i < vertices; i += 3) positions.row(i) = environment.state.positions.row(i);
    force = points(1);
    direction = points(0.02);
  }
};

Matrix3d matrix(const Symmetric3& a) {
  Matrix3d m;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) m(r, c) = a.at(r, c);
  return m;
}

/// Both do the same arithmetic but for the order of sums.
constexpr double rounding = 1e-9;

void expect_near(const Vector3<double>& own, const Vector3d& expected) {
  EXPECT_LE((vector3d(own) - expected).norm(), rounding * (1 + expected.norm()));
}

void expect_equal(const VertexContact& own, const VertexConstraint& expected) {
  EXPECT_EQ(own.freedom, expected.freedom);
  expect_near(own.correction, expected.correction);
  EXPECT_LE((matrix(own.free) - expected.free).norm(), rounding);
}

TEST(VertexContact, IsDecidedAsInAContactSet) {
  int seen[4] = {}, on_several = 0, exchanged = 0, moved = 0;
  Sheet sheet;
  sheet.bodies = {{.vertex_count = vertices}};
  for (unsigned seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE(seed);
    World world(seed);
    const ContactStep step(sheet, world.environment, time_step, {.speed = 1});
    const ObstacleStep<double> view = step.view();
    const Points& start = world.environment.state.positions;
    ContactSet none = begin_step(step, world.positions);
    Points feasible = world.positions;
    project_to_feasible(step, none, feasible);
    ContactSet set = none;
    update_contacts(step, feasible, world.force, set);
    ContactSet linear = set;
    Points residual = world.force, gradient;
    for (const VertexConstraint& c : set.constraints) residual.row(c.vertex) -= c.reaction.transpose();
    gradient = residual;
    const Points force_at_end = 0.5 * world.force.colwise().reverse();
    exchange_contacts({step, feasible, world.force, residual}, world.direction, force_at_end, gradient,
                      linear);
    Points trial = feasible + world.direction;
    const Points straight = trial;
    project_to_feasible(step, linear, trial);
    const double potential = friction_potential(step, set, trial);
    double own_potential = 0;
    const std::vector<Matrix3d> couplings = friction_couplings(set);

    for (int i = 0; i < vertices; ++i) {
      const Vector3<double> from = vector3(start, i);
      // Between faces that press against each other there is no such place, and rounding decides.
      const auto is_outside = [&](const Vector3<double>& at) {
        return clearance_of(view, from, at) >= -rounding;
      };
      const Vector3<double> point = vector3(feasible, i);
      if (is_outside(point))
        expect_near(projected_out(view, from, nullptr, vector3(world.positions, i)), feasible.row(i));
      EXPECT_LE(std::abs(clearance_of(view, from, point) - set.clearance[i]), rounding);
      VertexTouch touches[most_obstacles];
      find_touches(view, from, point, touches);
      VertexContact contact = decide_contact(view, from, point, vector3(world.force, i), touches);
      const VertexConstraint* expected = set.find(i);
      ASSERT_EQ(contact.freedom != Freedom::free && set.clearance[i] <= touching_gap, expected != nullptr);
      if (expected != nullptr) {
        expect_equal(contact, *expected);
        expect_near(contact.reaction, expected->reaction);
        expect_near(contact.slip_direction, expected->slip_direction);
        EXPECT_LE((matrix(contact.slip_stiffness) - expected->slip_stiffness).norm(),
                  rounding * (1 + expected->slip_stiffness.norm()));
        ++seen[static_cast<int>(contact.freedom)];
        on_several +=
            contact.free.xx + contact.free.yy + contact.free.zz < 1.5 && contact.freedom == Freedom::slip;
        for (int axis = 0; axis < 3; ++axis)
          expect_near(friction_coupling(view, contact, touches, axis),
                      couplings[static_cast<std::size_t>(set.place[i])].col(axis));
        own_potential += friction_potential_of(view, from, vector3(trial, i), contact, touches);
      }
      // The linear problem.
      const Vector3<double> way = vector3(world.direction, i);
      constexpr double any_reach = std::numeric_limits<double>::infinity();
      if (expected == nullptr) {
        find_touches(view, from, point, touches);
        contact = {};
        if (set.clearance[i] <= norm(way)) exchanged += hold(view.count, way, any_reach, contact, touches);
      } else if (release(view, vector3(force_at_end, i), contact, touches)) {
        ++exchanged;
      } else if (contact.freedom != Freedom::stick) {
        exchanged += hold(view.count, way, any_reach, contact, touches);
      }
      const VertexConstraint* exchanged_to = linear.find(i);
      if (exchanged_to == nullptr)
        EXPECT_EQ(contact.freedom, Freedom::free);
      else
        expect_equal(contact, *exchanged_to);
      const bool listed = exchanged_to != nullptr;
      const Vector3<double> place =
          feasible_place(view, from, contact, listed ? touches : nullptr, vector3(straight, i));
      // An edge across the slip at the iterate leaves its sign to rounding.
      const auto turns = [&] {
        const Vector3<double> there = projected_out(view, from, touches, vector3(straight, i));
        return dot(slip_against(view, from, there, touches), contact.slip_direction);
      };
      const bool clear =
          contact.freedom != Freedom::slip || is_zero(contact.slip_direction) || std::abs(turns()) > 1e-15;
      if (is_outside(vector3(trial, i)) && clear) expect_near(place, trial.row(i));
      moved += (vector3d(place) - straight.row(i).transpose()).norm() > rounding;
    }
    EXPECT_NEAR(own_potential, potential, rounding * (1 + potential));
  }
  // The worlds have all of it.
  EXPECT_GT(seen[static_cast<int>(Freedom::slip)], 1000);
  EXPECT_GT(seen[static_cast<int>(Freedom::stick)], 30);
  EXPECT_GT(on_several, 20);
  EXPECT_GT(exchanged, 1000);
  EXPECT_GT(moved, 1000);
}

}  // namespace
}  // namespace flash::sim
