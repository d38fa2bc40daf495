#include "sim/law/contact_exchange.h"

#include "tests/sim/law/contact_world.h"

namespace flash::sim {
namespace {

TEST(ContactExchange, AVertexIsHeldWhereItsWayWouldLeadInside) {
  int held = 0, on_several = 0;
  for (unsigned seed = 0; seed < 25; ++seed) {
    SCOPED_TRACE(seed);
    const ContactWorld world = world_of_planes(seed);
    const ContactStep step = world.step();
    const data::Points way = world.positions - world.environment.state.positions;
    for (int i = 0; i < ContactWorld::vertices; ++i) {
      std::vector<VertexTouch> touches(step.obstacles.size());
      find_touches(step.view(), step.start(i), step.start(i), touches.data());
      VertexContact contact;
      bool enters = false;
      for (const VertexTouch& touch : touches)
        enters = enters || touch.gap + dot(touch.normal, vector3(way, i)) < -1e-12;
      ASSERT_EQ(hold(step.view(), vector3(way, i), no_such_side, contact, touches.data()), enters);
      int count = 0;
      for (const VertexTouch& touch : touches) {
        if (!touch.holds) continue;
        ++count;
        // The correction leads onto the surface, and what is left free leads along it. The inverse of the
        // least part of a normal that counts as free is 1e3.
        EXPECT_NEAR(touch.gap + dot(touch.normal, contact.correction), 0, 1e-12);
        EXPECT_NEAR(norm(contact.free * touch.normal), 0, 1e-12);
      }
      if (count == 0) continue;
      EXPECT_EQ(contact.freedom, Freedom::slip);
      ++held;
      on_several += count > 1;
    }
  }
  EXPECT_GT(held, 3000);
  EXPECT_GT(on_several, 300);
}

TEST(ContactExchange, AReleasedSurfaceIsOneThatWouldHaveToPull) {
  int released = 0, kept = 0;
  for (unsigned seed = 0; seed < 25; ++seed) {
    SCOPED_TRACE(seed);
    const ContactWorld world = world_of_planes(seed);
    const ContactStep step = world.step();
    const data::Points way = world.positions - world.environment.state.positions;
    ContactRoom room(step.obstacles.size());
    for (int i = 0; i < ContactWorld::vertices; ++i) {
      std::vector<VertexTouch> touches(step.obstacles.size());
      find_touches(step.view(), step.start(i), step.start(i), touches.data());
      VertexContact contact;
      if (!hold(step.view(), vector3(way, i), no_such_side, contact, touches.data())) continue;
      const std::vector<VertexTouch> before = touches;
      const Vector3<double> force = vector3(world.force, i);
      const bool any = release(step.view(), force, contact, touches.data(), room);
      Vector3<double> rest = force;
      bool lost = false;
      for (const VertexTouch& touch : touches) rest = rest - touch.normal_force * touch.normal;
      for (std::size_t k = 0; k < touches.size(); ++k) {
        EXPECT_FALSE(touches[k].holds && !before[k].holds);
        EXPECT_EQ(touches[k].released, before[k].holds && !touches[k].holds);
        EXPECT_GE(touches[k].normal_force, 0);
        lost = lost || touches[k].released;
        kept += touches[k].holds;
        // What the others leave of the force does not press against a surface that was released.
        if (touches[k].released) {
          EXPECT_LE(dot(touches[k].normal, rest), 1e-3);
        }
      }
      EXPECT_EQ(any, lost);
      released += any;
      // It is not held there again.
      const std::vector<VertexTouch> after = touches;
      hold(step.view(), vector3(way, i), no_such_side, contact, touches.data());
      for (std::size_t k = 0; k < touches.size(); ++k) EXPECT_FALSE(after[k].released && touches[k].holds);
    }
  }
  EXPECT_GT(released, 1000);
  EXPECT_GT(kept, 1000);
}

}  // namespace
}  // namespace flash::sim
