#include "sim/law/feature_pair.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "sim/law/layer_law.h"

namespace flash::sim {
namespace {

using Place = Vector3<double>;
using Places = std::array<Place, 4>;

constexpr PairKind kinds[] = {PairKind::vertex_face, PairKind::edge_edge};

class Drawn {
 public:
  double number(double low, double high) { return std::uniform_real_distribution<>(low, high)(engine_); }
  Place place(double size) { return {number(-size, size), number(-size, size), number(-size, size)}; }
  /// Four places; every second time of a kind that is not general: in one plane, on a line, edges alike, or
  /// two of the places the same.
  Places places(int draw) {
    Places x;
    for (Place& p : x) p = place(1);
    if (draw % 8 == 1)
      for (Place& p : x) p.z = 0;
    if (draw % 8 == 3)
      for (Place& p : x) p.y = p.z = 0;
    if (draw % 8 == 5) x[3] = x[2] + (x[1] - x[0]);
    if (draw % 8 == 7) x[3] = x[2];
    return x;
  }

 private:
  std::mt19937_64 engine_{5};
};

Place between(const Places& x, const double* weights) {
  Place sum{};
  for (int i = 0; i < 4; ++i) sum = sum + weights[i] * x[i];
  return sum;
}

TEST(FeaturePair, NearestPointsLieInTheFeaturesAndNoneAreNearer) {
  constexpr double rounding = 1e-12;  // of coordinates and products of order one, squared distances
  Drawn drawn;
  for (int draw = 0; draw < 20000; ++draw)
    for (const PairKind kind : kinds) {
      const Places x = drawn.places(draw);
      const NearestPoints nearest = nearest_points(kind, x.data());
      const double* w = nearest.weights;
      const int split = kind == PairKind::vertex_face ? 1 : 2;
      double first = 0, second = 0;
      for (int i = 0; i < 4; ++i) {
        (i < split ? first : second) += w[i];
        ASSERT_GE(i < split ? w[i] : -w[i], -rounding);
      }
      ASSERT_NEAR(first, 1, rounding);
      ASSERT_NEAR(second, -1, rounding);
      const Place rel = between(x, w);
      ASSERT_NEAR(norm(rel), nearest.distance, rounding);
      ASSERT_NEAR(norm(rel - nearest.distance * nearest.normal), 0, rounding);
      // Both features are convex: their nearest points are those from which no corner leads nearer.
      Place a{}, b{};
      for (int i = 0; i < 4; ++i) (i < split ? a : b) = (i < split ? a : b) + std::abs(w[i]) * x[i];
      for (int i = 0; i < 4; ++i)
        if (i < split)
          ASSERT_GE(dot(x[i] - a, rel), -1e-6) << draw;  // parallel to 1e-6: the ends decide
        else
          ASSERT_LE(dot(x[i] - b, rel), 1e-6) << draw;
    }
}

TEST(FeaturePair, WeightsAndNormalAreTheDerivativeOfTheDistance) {
  constexpr double step = 1e-6;
  Drawn drawn;
  for (int draw = 0; draw < 2000; draw += 2)
    for (const PairKind kind : kinds) {
      const Places x = drawn.places(draw);
      const NearestPoints nearest = nearest_points(kind, x.data());
      if (nearest.distance < 0.05) continue;  // its curvature grows as one over it
      for (int i = 0; i < 4; ++i)
        for (int axis = 0; axis < 3; ++axis) {
          Places up = x, down = x;
          up[i][axis] += step;
          down[i][axis] -= step;
          const double slope =
              (nearest_points(kind, up.data()).distance - nearest_points(kind, down.data()).distance) /
              (2 * step);
          // Where the nearest points change their kind within the step, the second derivative jumps.
          ASSERT_NEAR(slope, nearest.weights[i] * nearest.normal[axis], 1e-4) << draw;
        }
    }
}

/// The least distance on a way, to within what it can change between samples.
double least_on_way(PairKind kind, const Places& x, const Places& move, double share,
                    double& between_samples) {
  constexpr int samples = 2000;
  double longest = 0, least = 1e300;
  for (const Place& m : move) longest = std::max(longest, norm(m));
  between_samples = 2 * longest * share / samples / 2;
  for (int s = 0; s <= samples; ++s) {
    Places at = x;
    for (int i = 0; i < 4; ++i) at[i] = x[i] + (share * s / samples) * move[i];
    least = std::min(least, nearest_points(kind, at.data()).distance);
  }
  return least;
}

TEST(FeaturePair, FreeWaysKeepTheirDistanceAndWhatStaysFarIsFree) {
  int whole = 0, cut = 0;
  Drawn drawn;
  for (int draw = 0; draw < 4000; ++draw)
    for (const PairKind kind : kinds) {
      const Places x = drawn.places(draw);
      const double size = std::pow(10, drawn.number(-3, 1)), reach = std::pow(10, drawn.number(-3, 0));
      Places move;
      const Place common = drawn.place(10);
      for (Place& m : move) m = common + drawn.place(size);
      const NearestPoints nearest = nearest_points(kind, x.data());
      const double start = nearest.distance, felt = std::min(start, reach);
      if (draw % 4 < 2)  // at each other
        for (int i = 0; i < (kind == PairKind::vertex_face ? 1 : 2); ++i)
          move[i] = move[i] - (drawn.number(1, 3) * start) * nearest.normal;
      const double share = free_share(kind, x.data(), move.data(), reach);
      ASSERT_GE(share, 0);
      ASSERT_LE(share, 1);
      if (start < 1e-9) continue;  // they meet already
      double between_samples;
      const double least = least_on_way(kind, x, move, share, between_samples);
      ASSERT_GE(least, 0.25 * felt - 1e-12) << draw;
      ++(share < 1 ? cut : whole);
      if (share < 1) {
        Places at = x;
        for (int i = 0; i < 4; ++i) at[i] = x[i] + share * move[i];
        ASSERT_LE(nearest_points(kind, at.data()).distance, 0.5 * felt + 1e-12) << draw;
      }
    }
  EXPECT_GT(whole, 1000);
  EXPECT_GT(cut, 1000);
}

TEST(FeaturePair, WhatStaysApartDoesSoOnAllOfItsWay) {
  int apart = 0, near = 0;
  Drawn drawn;
  for (int draw = 0; draw < 4000; ++draw)
    for (const PairKind kind : kinds) {
      const Places x = drawn.places(draw);
      const double size = std::pow(10, drawn.number(-3, 1));
      Places move, end;
      for (Place& m : move) m = drawn.place(size);
      const NearestPoints nearest = nearest_points(kind, x.data());
      if (draw % 4 < 2)  // at each other, and past
        for (int i = 0; i < (kind == PairKind::vertex_face ? 1 : 2); ++i)
          move[i] = move[i] - (drawn.number(0.5, 3) * nearest.distance) * nearest.normal;
      for (int i = 0; i < 4; ++i) end[i] = x[i] + move[i];
      const double kept = 0.01 * std::min(nearest.distance, nearest_points(kind, end.data()).distance);
      double between_samples;
      const double least = least_on_way(kind, x, move, 1, between_samples);
      if (stay_apart(kind, x.data(), move.data())) {
        ++apart;
        ASSERT_GE(least, kept - 1e-12) << draw;
      } else {
        ++near;
        ASSERT_LE(least, 2 * kept + between_samples + 1e-12) << draw;
      }
    }
  EXPECT_GT(apart, 1000);
  EXPECT_GT(near, 1000);
}

TEST(FeaturePair, FallsMeetWhenTheyShould) {
  const Places above_face = {{{0.2, 0.3, 1}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}}};
  const Places crossed = {{{-1, 0, 1}, {1, 0, 1}, {0, -1, 0}, {0, 1, 0}}};
  const Places parallel = {{{-1, 0, 1}, {1, 0, 1}, {-1, 0, 0}, {1, 0, 0}}};
  const Places end_on = {{{0, 0, 1}, {0, 0, 2}, {0, 0, 0}, {0, 0, -1}}};
  constexpr double reach = 1e-3, speed = 2;
  const auto check = [&](PairKind kind, const Places& x, int falling) {
    Places move{};
    for (int i = 0; i < falling; ++i) move[i].z = -speed;
    const double share = free_share(kind, x.data(), move.data(), reach);
    EXPECT_LT(share, 1 / speed);
    EXPECT_GE(share, (1 - 0.5 * reach) / speed - 1e-12);  // it ends below half of the reach
  };
  check(PairKind::vertex_face, above_face, 1);
  check(PairKind::edge_edge, crossed, 2);
  check(PairKind::edge_edge, parallel, 2);
  check(PairKind::edge_edge, end_on, 2);
}

TEST(LayerLaw, ForceAndStiffnessAreDerivativesAndStartSmoothly) {
  constexpr double thickness = 2e-3, pressure = 2500, step = 1e-6 * thickness;
  for (const double u : {0.01, 0.1, 0.3, 0.52, 0.8, 0.99}) {
    const double d = u * thickness;
    const LayerResponse at = layer_response(thickness, pressure, d),
                        up = layer_response(thickness, pressure, d + step),
                        down = layer_response(thickness, pressure, d - step);
    // Truncation by step^2 / d^2 and rounding by 1e-16 over the relative step.
    EXPECT_NEAR((down.energy - up.energy) / (2 * step), at.force, 1e-6 * at.force + 1e-9 * pressure);
    EXPECT_NEAR((down.force - up.force) / (2 * step), at.stiffness,
                1e-6 * at.stiffness + 1e-8 * pressure / thickness);
  }
  EXPECT_NEAR(layer_response(thickness, pressure, 0.5325 * thickness).force, pressure, 1e-3 * pressure);
  EXPECT_EQ(layer_response(thickness, pressure, thickness).stiffness, 0);
  EXPECT_EQ(layer_response(thickness, pressure, 1.5 * thickness).energy, 0);
}

}  // namespace
}  // namespace flash::sim
