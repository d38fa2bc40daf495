#include "sim/law/vertex_contact.h"

#include "sim/step/feasible_positions.h"
#include "tests/sim/law/contact_world.h"

namespace flash::sim {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

const double longest = bristle_length(ContactWorld::time_step);  ///< slip in which bristles bend [m]

/// A vertex of a world on its surfaces, with what decides of it.
struct Decided {
  ObstacleStep<double> view;
  Vector3<double> start, point, needed;
  std::vector<Vector3<double>> bristles;  ///< of each obstacle, as in State
  std::vector<VertexTouch> touches;
  VertexContact contact;

  Decided(const ContactStep& step, const data::Points& positions, const data::Points& force, int i)
      : view(step.view()), start(step.start(i)), point(vector3(positions, i)), needed(vector3(force, i)) {
    for (int k = 0; k < view.count; ++k) bristles.push_back(step.bristle(k, i));
    decide();
  }
  void decide() {
    touches.assign(static_cast<std::size_t>(view.count), {});
    find_touches(view, start, point, touches.data());
    carry_bristles(
        view, [&](int k) { return bristles[static_cast<std::size_t>(k)]; }, touches.data());
    ContactRoom room(touches.size());
    contact = decide_contact(view, start, point, needed, touches.data(), room);
  }
  /// The slip against a surface.
  Vector3<double> slip_on(const VertexTouch& touch) const {
    return along_plane(touch.normal, touch.bristle + point - start - touch.surface_moved);
  }
  /// Longest slip against a surface that is touched.
  double slipped() const {
    double most = 0;
    for (const VertexTouch& touch : touches)
      if (touch.touches()) most = std::max(most, norm(slip_on(touch)));
    return most;
  }
  Vector3d friction() const {
    Vector3d sum = Vector3d::Zero();
    for (const VertexTouch& touch : touches) sum += vector3d(touch.friction);
    return sum;
  }
};

/// Bristles on each obstacle of a world.
data::Points random_bristles(const ContactWorld& world, std::mt19937& engine) {
  const auto obstacles = static_cast<Eigen::Index>(world.environment.obstacles.size());
  data::Points bristles(obstacles * ContactWorld::vertices, 3);
  for (Eigen::Index k = 0; k < obstacles; ++k)
    bristles.middleRows(k * ContactWorld::vertices, ContactWorld::vertices) = random_points(0.5, engine);
  return bristles;
}

/// Calls `check` with each vertex of many worlds that something holds, moved out of the obstacles.
/// `world_of`: mixed_world or world_of_planes.
template <typename Check>
void for_each_held(ContactWorld (*world_of)(unsigned), const Check& check) {
  for (unsigned seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE(seed);
    ContactWorld world = world_of(seed);
    std::mt19937 engine(seed);
    world.environment.state.bristles = random_bristles(world, engine);
    const ContactStep step = world.step();
    ContactSet set = begin_step(step, world.positions);
    project_to_feasible(step, set, world.positions);
    for (int i = 0; i < ContactWorld::vertices; ++i) {
      const Decided decided(step, world.positions, world.force, i);
      if (decided.contact.freedom != Freedom::free) check(decided);
    }
  }
}

/// Forces are of one newton. Faces that are not parallel span a volume of a thousandth at least.
constexpr double rounding = 1e-11;

TEST(VertexTouch, SurfacesShareAForceByNonNegativeLeastSquares) {
  std::mt19937 engine(1);
  std::normal_distribution<double> number;
  const auto random = [&] { return Vector3d(number(engine), number(engine), number(engine)); };
  for (int sample = 0; sample < 2000; ++sample) {
    std::vector<VertexTouch> touches(static_cast<std::size_t>(1 + sample % 6));
    std::vector<MovingObstacle<double>> obstacles(touches.size());
    for (VertexTouch& touch : touches) touch.normal = vector3(random().normalized());
    const Vector3d needed = random();
    ContactRoom room(touches.size());
    share_force(
        ObstacleStep<double>{obstacles.data(), static_cast<int>(touches.size())}, vector3(needed), false,
        [](const VertexTouch&) { return true; }, touches.data(), room);
    // The conditions of the minimum of |needed - sum forces * normals|^2 over forces not below zero.
    Vector3d rest = needed;
    for (const VertexTouch& touch : touches) rest -= touch.normal_force * vector3d(touch.normal);
    for (const VertexTouch& touch : touches) {
      EXPECT_GE(touch.normal_force, 0);
      EXPECT_EQ(touch.holds, touch.normal_force > 0);
      // Three faces that span a volume of less than a thousandth count as two of them.
      EXPECT_LE(vector3d(touch.normal).dot(rest), 1e-3 * needed.norm());
      // Rounding, by three normals that span a volume of 1e-3 at least.
      EXPECT_NEAR(touch.normal_force * vector3d(touch.normal).dot(rest), 0, 1e-7);
    }
  }
}

TEST(VertexContact, ObeysTheLawsOfSignoriniAndCoulomb) {
  int sticking = 0, slipping = 0, on_several = 0;
  for_each_held(mixed_world, [&](const Decided& d) {
    if (has_no_unique_force(d.touches)) return;
    const Vector3d rest = vector3d(d.needed - d.contact.reaction);
    Vector3d sum = Vector3d::Zero();
    double bound = 0;
    int held = 0;
    for (int k = 0; k < d.view.count; ++k) {
      const VertexTouch& touch = d.touches[static_cast<std::size_t>(k)];
      const double own_bound = d.view.obstacles[k].friction * touch.normal_force;
      EXPECT_GE(touch.normal_force, 0);
      if (!touch.touches()) {
        EXPECT_EQ(touch.normal_force, 0);
        continue;
      }
      bound += own_bound;
      held += touch.holds;
      sum += vector3d(touch.normal_force * touch.normal + touch.friction);
      EXPECT_LE(norm(touch.friction), own_bound + rounding);
      if (!touch.holds) continue;
      EXPECT_NEAR(norm(d.contact.free * touch.normal), 0, rounding);
      // A spring whose force is the bound at longest; beyond, of that size and against the slip.
      const Vector3<double> slip = d.slip_on(touch);
      const double length = std::max(norm(slip), longest);
      EXPECT_LE(norm(touch.friction + (own_bound / length) * slip), rounding);
    }
    EXPECT_NEAR(d.contact.friction_bound, bound, rounding);
    EXPECT_EQ(d.contact.freedom, Freedom::slip);
    EXPECT_NEAR((vector3d(d.contact.reaction) - sum).norm(), 0, rounding);
    (d.slipped() <= longest ? sticking : slipping) += 1;
    on_several += held > 1;
    // No surface has to push more, and those that push, push what is needed.
    for (const VertexTouch& touch : d.touches) {
      const double left = vector3d(touch.normal).dot(rest);
      EXPECT_LE(touch.touches() ? left : 0, rounding);
      EXPECT_NEAR(touch.holds ? left : 0, 0, rounding);
    }
  });
  EXPECT_GT(sticking, 30);
  EXPECT_GT(slipping, 1000);
  EXPECT_GT(on_several, 20);
}

TEST(VertexContact, FrictionFollowsTheForceAsItsCouplingSays) {
  constexpr double step = 1e-6;  // [N]; the law is linear in the force while the same surfaces hold
  int checked = 0;
  for_each_held(mixed_world, [&](const Decided& d) {
    if (d.contact.freedom != Freedom::slip || has_no_unique_force(d.touches)) return;
    for (int axis = 0; axis < 3; ++axis) {
      Vector3d ends[2];
      bool same = true;
      for (const int side : {0, 1}) {
        Decided moved = d;
        moved.needed[axis] += side == 0 ? -step : step;
        moved.decide();
        ends[side] = moved.friction();
        for (std::size_t k = 0; k < d.touches.size(); ++k)
          same = same && moved.touches[k].holds == d.touches[k].holds;
      }
      if (!same) continue;
      const Vector3d coupling = vector3d(friction_coupling(d.view, d.contact, d.touches.data(), axis));
      EXPECT_LE((-(ends[1] - ends[0]) / (2 * step) - coupling).norm(), 1e-7 * (1 + coupling.norm()));
      ++checked;
    }
  });
  EXPECT_GT(checked, 3000);
}

TEST(VertexContact, FrictionOnAPlaneIsTheGradientOfItsPotential) {
  int sliding = 0, sticking = 0;
  for_each_held(mixed_world, [&](const Decided& d) {
    const double slip = d.slipped();
    const bool slides = slip > 1e-4;
    if (d.view.count != 1 || d.view.obstacles[0].shape != ObstacleShape::plane || d.view.obstacles[0].moves ||
        (!slides && slip > 0.9 * longest))
      return;
    const auto potential = [&](const Vector3<double>& at) {
      return friction_potential_of(d.view, d.start, at, d.contact, d.touches.data());
    };
    // A spring's potential is of second order: its differences are exact.
    const double first = slides ? 1e-7 : 0.05 * longest, second = slides ? 1e-5 : first;  // [m]
    const auto gradient = [&](const Vector3<double>& at) {
      Vector3d g;
      for (int axis = 0; axis < 3; ++axis) {
        Vector3<double> more = at, less = at;
        more[axis] += first;
        less[axis] -= first;
        g[axis] = (potential(more) - potential(less)) / (2 * first);
      }
      return g;
    };
    const double bound = d.contact.friction_bound;
    EXPECT_LE((gradient(d.point) + d.friction()).norm(), 1e-6 * bound + 1e-9);
    const Matrix3d stiffness = matrix3d(d.contact.slip_stiffness);
    Matrix3d differences;
    for (int axis = 0; axis < 3; ++axis) {
      Vector3<double> more = d.point, less = d.point;
      more[axis] += second;
      less[axis] -= second;
      differences.col(axis) = (gradient(more) - gradient(less)) / (2 * second);
    }
    // The third derivative is of the size bound / slip^3; rounding of the potential is divided by both steps.
    EXPECT_LE((differences - stiffness).norm(),
              (slides ? bound * 1e-10 / std::pow(slip, 3) : 0) + 1e-3 * stiffness.norm() + 1e-3);
    (slides ? sliding : sticking) += 1;
  });
  EXPECT_GT(sliding, 100);
  EXPECT_GT(sticking, 10);
}

TEST(VertexContact, BristlesKeepTheFriction) {
  int kept_by_one = 0, kept_by_several = 0;
  const auto check = [&](const Decided& d) {
    Decided next = d;
    next.start = d.point;
    int held = 0;
    bool starts_inside = false;
    for (int k = 0; k < d.view.count; ++k) {
      const auto at = static_cast<std::size_t>(k);
      const VertexTouch& touch = d.touches[at];
      const double bound = d.view.obstacles[k].friction * touch.normal_force;
      const Vector3<double> kept = next.bristles[at] = bristle_at_end(d.view.obstacles[k], touch);
      EXPECT_LE(norm(kept), 1 + 1e-12);
      EXPECT_LE((bound * vector3d(kept) + vector3d(touch.friction)).norm(), rounding);
      held += touch.holds ? 1 : 0;
      starts_inside = starts_inside || touch.starts_inside;
    }
    if (d.view.obstacles[0].moves || starts_inside) return;
    // A step without motion from there on has the same friction.
    next.decide();
    if (next.contact.freedom == Freedom::free) return;
    EXPECT_LE((next.friction() - d.friction()).norm(), rounding + 1e-9 * d.contact.friction_bound);
    (held == 1 ? kept_by_one : kept_by_several) += 1;
  };
  for_each_held(mixed_world, check);
  for_each_held(world_of_planes, check);
  EXPECT_GT(kept_by_one, 300);
  EXPECT_GT(kept_by_several, 30);
}

TEST(VertexContact, BristlesTurnWithTheirObstacle) {
  // A quarter turn about z takes bristles along x to y, and those along z stay.
  MovingObstacle<double> obstacle;
  obstacle.start = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 2, 3}};
  obstacle.end = {{0, 1, 0}, {-1, 0, 0}, {0, 0, 1}, {3, 2, 1}};
  obstacle.moves = true;
  EXPECT_EQ(vector3d(turned_with(obstacle, {0.5, 0, 0.25})), Vector3d(0, 0.5, 0.25));
}

}  // namespace
}  // namespace flash::sim
