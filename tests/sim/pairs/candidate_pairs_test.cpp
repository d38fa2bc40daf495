#include "sim/pairs/candidate_pairs.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <map>
#include <random>
#include <set>

#include "data/mesh/procedural_mesh.h"
#include "sim/pairs/intersection.h"

namespace flash::sim {
namespace {

using data::Points;
using Eigen::Vector3d;
using Key = std::pair<bool, std::array<int, 4>>;

Sheet irregular_sheet(int cells, double side, unsigned seed = 1) {
  return make_sheet(data::rectangle({.width = side,
                                     .height = side,
                                     .cells_x = cells,
                                     .cells_y = cells,
                                     .pattern = data::DiagonalPattern::jittered,
                                     .seed = seed}));
}

/// A sheet thrown into folds, and where its vertices may go.
struct Crumpled {
  Points places;
  std::vector<Bounds> boxes;
};

Crumpled crumpled(const Sheet& sheet, double way, std::mt19937_64& engine) {
  std::uniform_real_distribution<> even(-1, 1);
  const double a = even(engine), b = even(engine), wave = 40 + 60 * std::abs(even(engine));
  Crumpled result{sheet.rest.vertices, {}};
  for (int i = 0; i < result.places.rows(); ++i) {
    const double along = std::cos(a) * result.places(i, 0) + std::sin(a) * result.places(i, 1);
    result.places(i, 2) = 0.01 * std::sin(wave * along + b);
    result.places(i, 0) *= 0.4 + 0.2 * b;
    const Eigen::Array3d place = result.places.row(i).transpose().array(),
                         moved = place + way * Eigen::Array3d(even(engine), even(engine), even(engine));
    result.boxes.push_back({place.min(moved), place.max(moved)});
  }
  return result;
}

std::multiset<Key> keys_of(const std::vector<CandidatePair>& pairs) {
  std::multiset<Key> keys;
  for (const CandidatePair& pair : pairs) {
    std::array<int, 4> v = pair.vertices;
    const bool edges = pair.kind == PairKind::edge_edge;
    if (edges && std::pair(v[0], v[1]) > std::pair(v[2], v[3])) v = {v[2], v[3], v[0], v[1]};
    keys.insert({edges, v});
  }
  return keys;
}

Bounds box_of(const std::vector<Bounds>& boxes, std::initializer_list<int> vertices) {
  Bounds box;
  for (const int v : vertices) box.take(boxes[v]);
  return box;
}

/// All pairs of all features, each with each.
std::multiset<Key> brute_force(const PairSurface& surface, const std::vector<Bounds>& boxes, double reach,
                               const std::vector<bool>& carried) {
  std::multiset<Key> keys;
  const auto all_carried = [&](const std::array<int, 4>& v) {
    return carried[v[0]] && carried[v[1]] && carried[v[2]] && carried[v[3]];
  };
  for (int t = 0; t < surface.triangles.rows(); ++t) {
    const int a = surface.triangles(t, 0), b = surface.triangles(t, 1), c = surface.triangles(t, 2);
    for (int v = 0; v < surface.rest.rows(); ++v)
      if (v != a && v != b && v != c && !all_carried({v, a, b, c}) &&
          near(boxes[v], box_of(boxes, {a, b, c}), reach))
        keys.insert({false, {v, a, b, c}});
  }
  std::set<std::pair<int, int>> edges;
  for (int t = 0; t < surface.triangles.rows(); ++t)
    for (int k = 0; k < 3; ++k)
      edges.insert(std::minmax(int(surface.triangles(t, k)), int(surface.triangles(t, (k + 1) % 3))));
  for (auto e = edges.begin(); e != edges.end(); ++e)
    for (auto f = std::next(e); f != edges.end(); ++f) {
      const auto [a, b] = *e;
      const auto [c, d] = *f;
      if (a == c || a == d || b == c || b == d || all_carried({a, b, c, d})) continue;
      if (near(box_of(boxes, {a, b}), box_of(boxes, {c, d}), reach)) keys.insert({true, {a, b, c, d}});
    }
  return keys;
}

TEST(CandidatePairs, AreThoseOfAllPairs) {
  std::mt19937_64 engine(3);
  const Sheet both[2] = {irregular_sheet(8, 0.1), irregular_sheet(5, 0.1, 2)};
  const Sheet whole = joined(both);
  PairSurface surface(whole);
  std::size_t found = 0;
  for (int draw = 0; draw < 40; ++draw) {
    const double reach = draw % 2 == 0 ? 1e-3 : 4e-3;
    const Crumpled c = crumpled(whole, draw % 3 == 0 ? 0 : 0.005, engine);
    std::vector<bool> carried(static_cast<std::size_t>(surface.rest.rows()));
    for (std::size_t i = 0; i < carried.size(); ++i) carried[i] = draw % 4 == 3 && i % 2 == 0;
    std::vector<CandidatePair> pairs;
    find_candidates(surface, c.boxes, reach, carried, pairs);
    ASSERT_EQ(keys_of(pairs), brute_force(surface, c.boxes, reach, carried)) << draw;
    found += pairs.size();
  }
  EXPECT_GT(found, 10000u);
}

TEST(CandidatePairs, CloseFeaturesOfABodyMeetBelowTheirDistanceAtRest) {
  const Sheet sheet = irregular_sheet(8, 0.01);  // cells of 1.25 mm
  PairSurface surface(sheet);
  std::vector<Bounds> boxes;
  for (int i = 0; i < surface.rest.rows(); ++i)
    boxes.push_back({surface.rest.row(i).transpose().array(), surface.rest.row(i).transpose().array()});
  std::vector<CandidatePair> pairs;
  constexpr double thickness = 2e-3;
  find_candidates(surface, boxes, thickness, std::vector<bool>(boxes.size(), false), pairs);
  EXPECT_FALSE(pairs.empty());
  for (const CandidatePair& pair : pairs) {
    Vector3<double> x[4];
    for (int k = 0; k < 4; ++k)
      x[k] = {surface.rest(pair.vertices[k], 0), surface.rest(pair.vertices[k], 1),
              surface.rest(pair.vertices[k], 2)};
    const double distance = nearest_points(pair.kind, x).distance;
    EXPECT_LE(pair.thickness, thickness);
    EXPECT_LT(pair.thickness, distance);
  }
}

/// Between two flat layers the vertices of both sides, and the crossings of edges, stand for the area.
TEST(CandidatePairs, AreasOfTwoLayersAddUpToTheirs) {
  constexpr double side = 0.1, area = side * side, distance = 1e-3;
  const Sheet both[2] = {irregular_sheet(30, 2 * side), irregular_sheet(14, side, 9)};
  const Sheet whole = joined(both);
  PairSurface surface(whole);
  double faces = 0, edges = 0;
  constexpr int turns = 24;
  for (int turn = 0; turn < turns; ++turn) {
    Points x = whole.rest.vertices;
    auto small = rows_of(whole.bodies[1], x);
    small.rowwise() -= Eigen::RowVector3d(side / 2, side / 2, 0);
    small = (small * Eigen::AngleAxisd(turn * 2 * M_PI / turns + 0.1, Vector3d::UnitZ()).toRotationMatrix())
                .eval();
    small.rowwise() += Eigen::RowVector3d(side, side, distance);
    std::vector<Bounds> boxes;
    for (int i = 0; i < x.rows(); ++i)
      boxes.push_back({x.row(i).transpose().array(), x.row(i).transpose().array()});
    std::vector<CandidatePair> pairs;
    find_candidates(surface, boxes, 2e-3, std::vector<bool>(boxes.size(), false), pairs);
    for (const CandidatePair& pair : pairs) {
      Vector3<double> p[4];
      for (int k = 0; k < 4; ++k)
        p[k] = {x(pair.vertices[k], 0), x(pair.vertices[k], 1), x(pair.vertices[k], 2)};
      const bool between_layers = surface.body[pair.vertices[0]] != surface.body[pair.vertices[3]];
      if (!between_layers || nearest_points(pair.kind, p).distance > (1 + 1e-9) * distance) continue;
      (pair.kind == PairKind::vertex_face ? faces : edges) += pair.area / turns;
    }
  }
  // The small sheet's vertices stand for its area exactly, those of the large one as points in a square do,
  // and crossings on the mean over directions.
  EXPECT_NEAR(faces, 0.5 * area, 0.01 * area);
  EXPECT_NEAR(edges, 0.5 * area, 0.01 * area);
}

TEST(Intersection, IsThatOfAllTriangles) {
  std::mt19937_64 engine(4);
  const Sheet sheet = irregular_sheet(7, 0.1);
  PairSurface surface(sheet);
  int passing = 0;
  for (int draw = 0; draw < 60; ++draw) {
    Points x = crumpled(sheet, 0, engine).places;
    std::uniform_real_distribution<> even(-1, 1);
    const double noise = draw % 3 == 0 ? 0 : draw % 3 == 1 ? 0.004 : 0.01;
    for (double& value : x.reshaped()) value += noise * even(engine);
    std::optional<std::pair<int, int>> expected;
    const auto& t = surface.triangles;
    for (int a = 0; a < t.rows() && !expected; ++a)
      for (int b = a + 1; b < t.rows() && !expected; ++b) {
        bool share = false, pass = false;
        for (int i = 0; i < 3; ++i)
          for (int j = 0; j < 3; ++j) share = share || t(a, i) == t(b, j);
        if (share) continue;
        const auto cut = [&](int s, int u) {
          // The segment's point at the plane of the triangle, by its barycentric coordinates.
          for (int k = 0; k < 3; ++k) {
            const Vector3d p = x.row(t(s, k)), q = x.row(t(s, (k + 1) % 3)), o = x.row(t(u, 0));
            const Vector3d e = Vector3d(x.row(t(u, 1))) - o, f = Vector3d(x.row(t(u, 2))) - o;
            Eigen::Matrix3d m;
            m << e, f, p - q;
            const Vector3d s_t = m.fullPivLu().solve(p - o);
            pass = pass || (s_t[0] > 0 && s_t[1] > 0 && s_t[0] + s_t[1] < 1 && s_t[2] > 0 && s_t[2] < 1);
          }
        };
        cut(a, b);
        cut(b, a);
        if (pass) expected = {a, b};
      }
    ASSERT_EQ(first_intersection(surface, x), expected) << draw;
    passing += expected.has_value();
  }
  EXPECT_GT(passing, 10);
  EXPECT_LT(passing, 50);
}

}  // namespace
}  // namespace flash::sim
