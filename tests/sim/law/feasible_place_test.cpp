#include "sim/law/feasible_place.h"

#include "tests/sim/law/contact_world.h"

namespace flash::sim {
namespace {

using Eigen::Vector3d;

/// The nearest point of an intersection of half-spaces, by Dykstra's alternating projections.
Vector3d nearest_outside(const std::vector<Obstacle>& planes, Vector3d x) {
  std::vector<Vector3d> corrections(planes.size(), Vector3d::Zero());
  for (int round = 0; round < 20'000; ++round) {
    double moved = 0;
    for (std::size_t k = 0; k < planes.size(); ++k) {
      const Plane& plane = std::get<Plane>(planes[k].shape);
      const Vector3d from = x + corrections[k];
      const Vector3d to = from - std::min(0.0, plane.normal.dot(from - plane.point)) * plane.normal;
      corrections[k] = from - to;
      moved = std::max(moved, (to - x).norm());
      x = to;
    }
    if (moved < 1e-13) break;
  }
  return x;
}

TEST(FeasiblePlace, IsTheNearestBesidePlanes) {
  int moved = 0;
  for (unsigned seed = 0; seed < 25; ++seed) {
    SCOPED_TRACE(seed);
    const ContactWorld world = world_of_planes(seed);
    const ContactStep step = world.step();
    ContactRoom room(step.obstacles.size());
    for (int i = 0; i < ContactWorld::vertices; ++i) {
      const Vector3d point = world.positions.row(i);
      const Vector3d place =
          vector3d(projected_out(step.view(), step.start(i), nullptr, vector3(point), room));
      const Vector3d expected = nearest_outside(world.environment.obstacles, point);
      // Dykstra's method converges slowly along sharp edges.
      EXPECT_LE((place - expected).norm(), 1e-6);
      moved += place != point;
    }
  }
  EXPECT_GT(moved, 3000);
}

TEST(FeasiblePlace, IsOutsideOfObstaclesOfAllShapes) {
  int moved = 0;
  for (unsigned seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE(seed);
    const ContactWorld world = mixed_world(seed);
    if (world.environment.obstacles.size() > 1) continue;
    const ContactStep step = world.step();
    ContactRoom room(step.obstacles.size());
    for (int i = 0; i < ContactWorld::vertices; ++i) {
      const Vector3<double> point = vector3(world.positions, i);
      const Vector3<double> place = projected_out(step.view(), step.start(i), nullptr, point, room);
      EXPECT_GE(clearance_of(step.view(), step.start(i), place), -touching_gap);
      const bool was_outside = clearance_of(step.view(), step.start(i), point) >= 0;
      EXPECT_EQ(norm(place - point) == 0, was_outside);
      moved += !was_outside;
    }
  }
  EXPECT_GT(moved, 500);
}

TEST(FeasiblePlace, ASlipThatTurnedIsStopped) {
  const std::vector<Obstacle> table = {Obstacle{Plane{}, {0.5}}};
  ContactWorld world;
  world.sheet.bodies = {{.vertex_count = 1}};
  world.environment.obstacles = table;
  world.environment.state.positions = data::Points::Zero(1, 3);
  const ContactStep step = world.step();
  ContactRoom room(1);
  // At the iterate it slips along x.
  const Vector3<double> start = step.start(0), iterate{1e-3, 0, 0};
  std::vector<VertexTouch> touches(1);
  find_touches(step.view(), start, iterate, touches.data());
  carry_bristles(
      step.view(),
      [](int) {
        return Vector3<double>{0.2, -0.3, 0};
      },
      touches.data());
  const VertexContact contact = decide_contact(step.view(), start, iterate, {0, 0, 1}, touches.data(), room);
  ASSERT_EQ(contact.freedom, Freedom::slip);
  const auto place = [&](const Vector3<double>& point) {
    return vector3d(feasible_place(step.view(), start, contact, touches.data(), point, room));
  };
  EXPECT_EQ(place({2e-3, 1e-3, 0}), Vector3d(2e-3, 1e-3, 0));
  // Where the bristles are straight.
  EXPECT_LE(
      (place({-2e-3, 1e-3, 0}) - bristle_length(ContactWorld::time_step) * Vector3d(-0.2, 0.3, 0)).norm(),
      resting_slip);
  EXPECT_EQ(place({2e-3, 0, -1e-3}), Vector3d(2e-3, 0, 0));
}

}  // namespace
}  // namespace flash::sim
