#include "sim/step/layer_stiffness.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <random>

#include "tests/sim/sheet_scene.h"

namespace flash::sim {
namespace {

using data::Points;
using Matrix12 = Eigen::Matrix<double, 12, 12>;
using Vector12 = Eigen::Matrix<double, 12, 1>;

constexpr double time_step = 0.01, thickness = 1e-2;

/// Two triangles, each a sheet of its own.
Sheet two_triangles(const Points& places) {
  Sheet each[2];
  for (int k = 0; k < 2; ++k) {
    data::TriangleMesh mesh;
    mesh.vertices = places.middleRows(3L * k, 3);
    mesh.triangles.resize(1, 3);
    mesh.triangles << 0, 1, 2;
    each[k] = make_sheet(mesh);
  }
  return joined(each);
}

/// How the pressure of the only touch changes along a move of the vertices.
struct OneTouch {
  bool alone = false;  ///< there is one touch, of the same vertices before and after
  LayerTouch touch;
  Vector12 slope, expected;
  double size = 0;
  Matrix12 positive;
};

OneTouch differentiate(const Points& places, const Points& move, double step) {
  const Sheet sheet = two_triangles(places);
  Environment environment = environment_of(sheet);
  environment.self_contact = SelfContact{.thickness = thickness, .friction = 0, .pressure = 2500};
  PairSurface surface(sheet);
  LayerStep layers(surface, environment, time_step);
  const auto forces = [&](const Points& x, LayerContact& contact) {
    Points force = Points::Zero(6, 3);
    layers.add_forces(x, contact, force);
    return force;
  };
  LayerContact at, up, down;
  const Points x = environment.state.positions;
  forces(x, at);
  const Points slope = (forces(x + step * move, up) - forces(x - step * move, down)) / (2 * step);
  OneTouch one;
  if (at.touches.size() != 1 || up.touches.size() != 1 || down.touches.size() != 1) return one;
  one.touch = at.touches[0];
  one.alone = true;
  for (int k = 0; k < 4; ++k)  // where the nearest points change their features the slope jumps
    one.alone =
        one.alone && (up.touches[0].nearest.weights[k] == 0) == (down.touches[0].nearest.weights[k] == 0);
  const Matrix12 exact = pressure_stiffness(one.touch, x, Curvature::exact);
  one.positive = pressure_stiffness(one.touch, x, Curvature::positive);
  Vector12 way;
  for (int k = 0; k < 4; ++k) {
    way.segment<3>(3L * k) = move.row(one.touch.vertices[k]);
    one.slope.segment<3>(3L * k) = slope.row(one.touch.vertices[k]);
  }
  one.expected = exact * way;
  one.size = exact.norm() * way.norm();
  return one;
}

Points drawn(std::mt19937_64& engine, double size) {
  std::uniform_real_distribution<> even(-size, size);
  Points all(6, 3);
  for (double& value : all.reshaped()) value = even(engine);
  return all;
}

TEST(LayerStiffness, IsTheDerivativeOfTheForceAndItsPositivePartIsPositive) {
  constexpr double step = 1e-8;  // a millionth of the distance
  std::mt19937_64 engine(3);
  int compared[2] = {};
  for (int draw = 0; draw < 60000; ++draw) {
    const Points places = drawn(engine, 0.03), move = drawn(engine, 1);
    const OneTouch one = differentiate(places, move, step);
    if (!one.alone || one.touch.crossing < 1 || one.touch.nearest.distance < 0.2 * thickness ||
        one.touch.nearest.distance > 0.95 * thickness)
      continue;
    EXPECT_LT((one.slope - one.expected).norm(), 1e-4 * one.size) << draw;
    const double least = Eigen::SelfAdjointEigenSolver<Matrix12>(one.positive).eigenvalues().minCoeff();
    EXPECT_GT(least, -1e-12 * one.positive.norm()) << draw;
    ++compared[one.touch.kind == PairKind::edge_edge];
  }
  EXPECT_GT(compared[0], 100);
  EXPECT_GT(compared[1], 100);
}

/// The twist of nearly parallel edges is that of Gauss and Newton: off by the sine.
TEST(LayerStiffness, OfNearlyParallelEdgesIsTheDerivativeOfTheForceToTheirSine) {
  constexpr double step = 1e-9, above = 0.6 * thickness;
  std::mt19937_64 engine(4);
  for (const double sine : {0.015, 0.03, 0.06}) {
    // Two edges so long that their ends are far apart, the triangles behind each turned away from the other.
    Points places(6, 3);
    places << -1, -sine, 0, 1, sine, 0, 0.1, 0, -1, -1, 0, above, 1, 0, above, 0, 0.1, 1 + above;
    const OneTouch one = differentiate(places, drawn(engine, 1), step);
    ASSERT_TRUE(one.alone);
    ASSERT_LT(one.touch.crossing, 1);
    EXPECT_LT((one.slope - one.expected).norm(), 3 * sine * one.size) << sine;
  }
}

}  // namespace
}  // namespace flash::sim
