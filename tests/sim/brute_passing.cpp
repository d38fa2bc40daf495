#include "tests/sim/brute_passing.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <set>

#include "tests/sim/brute_surface.h"

namespace flash::sim {

using data::Points;

namespace {

using Vector = Eigen::Matrix<long double, 3, 1>;

constexpr long double same_place = 1e-12L;  ///< [m]

long double volume(const Vector& a, const Vector& b, const Vector& c) { return a.dot(b.cross(c)); }

long double point_to_segment(const Vector& p, const Vector& a, const Vector& b) {
  const long double share =
      std::clamp((p - a).dot(b - a) / std::max((b - a).squaredNorm(), 1e-40L), 0.0L, 1.0L);
  return (p - a - share * (b - a)).norm();
}

long double vertex_to_face(const Vector* x) {
  long double nearest = std::min({point_to_segment(x[0], x[1], x[2]), point_to_segment(x[0], x[2], x[3]),
                                  point_to_segment(x[0], x[3], x[1])});
  const Vector u = x[2] - x[1], v = x[3] - x[1], p = x[0] - x[1], n = u.cross(v);
  const long double squared = n.squaredNorm();
  if (squared == 0) return nearest;
  const long double b = p.cross(v).dot(n) / squared, c = u.cross(p).dot(n) / squared;
  if (b >= 0 && c >= 0 && b + c <= 1) nearest = std::min(nearest, std::abs(p.dot(n)) / std::sqrt(squared));
  return nearest;
}

long double edge_to_edge(const Vector* x) {
  long double nearest = std::min({point_to_segment(x[0], x[2], x[3]), point_to_segment(x[1], x[2], x[3]),
                                  point_to_segment(x[2], x[0], x[1]), point_to_segment(x[3], x[0], x[1])});
  const Vector u = x[1] - x[0], v = x[3] - x[2], r = x[2] - x[0], n = u.cross(v);
  const long double squared = n.squaredNorm();
  if (squared == 0) return nearest;
  const long double s = r.cross(v).dot(n) / squared, t = r.cross(u).dot(n) / squared;
  if (s >= 0 && s <= 1 && t >= 0 && t <= 1)
    nearest = std::min(nearest, std::abs(r.dot(n)) / std::sqrt(squared));
  return nearest;
}

/// Four vertices on straight ways.
struct Way {
  bool edges;
  Vector start[4], move[4];

  bool meets_at(long double share) const {
    Vector x[4];
    for (int k = 0; k < 4; ++k) x[k] = start[k] + share * move[k];
    return (edges ? edge_to_edge(x) : vertex_to_face(x)) <= same_place;
  }
};

/// Whether they meet: they are in one plane then, which is a cubic in the share.
bool meet(const Way& way) {
  const Vector a = way.start[1] - way.start[0], b = way.start[2] - way.start[0],
               c = way.start[3] - way.start[0];
  const Vector da = way.move[1] - way.move[0], db = way.move[2] - way.move[0], dc = way.move[3] - way.move[0];
  const long double k0 = volume(a, b, c), k1 = volume(da, b, c) + volume(a, db, c) + volume(a, b, dc),
                    k2 = volume(da, db, c) + volume(da, b, dc) + volume(a, db, dc), k3 = volume(da, db, dc);
  const auto f = [&](long double s) { return k0 + s * (k1 + s * (k2 + s * k3)); };
  const long double size =
      std::max({a.norm(), b.norm(), c.norm()}) + std::max({da.norm(), db.norm(), dc.norm()});
  const long double rounding = 1e-15L * size * size * size;  // the coordinates are rounded to 1e-16
  if (std::max({std::abs(k0), std::abs(k1), std::abs(k2), std::abs(k3)}) <= rounding) {
    // They move in one plane.
    constexpr int samples = 400;
    for (int k = 0; k <= samples; ++k)
      if (way.meets_at(static_cast<long double>(k) / samples)) return true;
    return false;
  }
  // Between the places where the cubic turns it has one root at most.
  std::vector<long double> turns = {0, 1};
  const auto turn = [&](long double s) {
    if (s > 0 && s < 1) turns.push_back(s);
  };
  if (const long double root = k2 * k2 - 3 * k3 * k1; root >= 0) {
    const long double q = -(k2 + std::copysign(std::sqrt(root), k2));
    if (k3 != 0) turn(q / (3 * k3));
    if (q != 0) turn(k1 / q);
  }
  std::sort(turns.begin(), turns.end());
  for (const long double s : turns)
    if (std::abs(f(s)) <= rounding && way.meets_at(s)) return true;
  for (std::size_t k = 1; k < turns.size(); ++k) {
    long double low = turns[k - 1], high = turns[k];
    const bool rises = f(low) < 0;
    if (rises == (f(high) < 0)) continue;
    for (int cut = 0; cut < 100 && low < high; ++cut) {
      const long double middle = (low + high) / 2;
      ((f(middle) < 0) == rises ? low : high) = middle;
    }
    if (way.meets_at(low) || way.meets_at(high)) return true;
  }
  return false;
}

bool apart(const Points& from, const Points& to, const std::array<int, 4>& v, int split) {
  for (int axis = 0; axis < 3; ++axis) {
    double low[2] = {1e300, 1e300}, high[2] = {-1e300, -1e300};
    for (int k = 0; k < 4; ++k)
      for (const double at : {from(v[k], axis), to(v[k], axis)}) {
        low[k >= split] = std::min(low[k >= split], at);
        high[k >= split] = std::max(high[k >= split], at);
      }
    if (low[0] > high[1] + 1e-9 || low[1] > high[0] + 1e-9) return true;
  }
  return false;
}

}  // namespace

BruteFeatures::BruteFeatures(const Sheet& sheet, std::vector<bool> carried_in)
    : triangles(visible_triangles(sheet)), carried(std::move(carried_in)) {
  std::set<std::array<int, 2>> all;
  std::set<int> seen;
  for (const auto& t : triangles.rowwise())
    for (int k = 0; k < 3; ++k) {
      seen.insert(t[k]);
      all.insert({std::min(t[k], t[(k + 1) % 3]), std::max(t[k], t[(k + 1) % 3])});
    }
  edges.assign(all.begin(), all.end());
  vertices.assign(seen.begin(), seen.end());
}

std::vector<BruteMeeting> brute_meetings(const BruteFeatures& features, const Points& from,
                                         const Points& to) {
  std::vector<BruteMeeting> meetings;
  const auto follow = [&](bool edges, const std::array<int, 4>& v) {
    if (features.carried[v[0]] && features.carried[v[1]] && features.carried[v[2]] && features.carried[v[3]])
      return;
    if (apart(from, to, v, edges ? 2 : 1)) return;
    Way way{.edges = edges, .start = {}, .move = {}};
    for (int k = 0; k < 4; ++k) {
      way.start[k] = from.row(v[k]).transpose().cast<long double>();
      way.move[k] = to.row(v[k]).transpose().cast<long double>() - way.start[k];
    }
    if (meet(way)) meetings.push_back({edges, v});
  };
  for (const auto& t : features.triangles.rowwise())
    for (const int v : features.vertices)
      if (v != t[0] && v != t[1] && v != t[2]) follow(false, {v, t[0], t[1], t[2]});
  for (std::size_t e = 0; e < features.edges.size(); ++e)
    for (std::size_t f = e + 1; f < features.edges.size(); ++f) {
      const auto &a = features.edges[e], &b = features.edges[f];
      if (a[0] != b[0] && a[0] != b[1] && a[1] != b[0] && a[1] != b[1])
        follow(true, {a[0], a[1], b[0], b[1]});
    }
  return meetings;
}

bool brute_intersects(const BruteFeatures& features, const Points& positions) {
  const auto at = [&](int i) { return Vector(positions.row(i).transpose().cast<long double>()); };
  for (const auto& t : features.triangles.rowwise()) {
    const Vector x[3] = {at(t[0]), at(t[1]), at(t[2])};
    for (const auto& e : features.edges) {
      if (e[0] == t[0] || e[0] == t[1] || e[0] == t[2] || e[1] == t[0] || e[1] == t[1] || e[1] == t[2])
        continue;
      if (features.carried[e[0]] && features.carried[e[1]] && features.carried[t[0]] &&
          features.carried[t[1]] && features.carried[t[2]])
        continue;
      const Vector a = at(e[0]), way = at(e[1]) - a, n = (x[1] - x[0]).cross(x[2] - x[0]);
      const long double before = n.dot(a - x[0]), after = n.dot(a + way - x[0]);
      if (!(before * after < 0)) continue;
      int positive = 0, negative = 0;
      for (int k = 0; k < 3; ++k) {
        const long double side = volume(way, x[k] - a, x[(k + 1) % 3] - a);
        positive += side > 0;
        negative += side < 0;
      }
      if (positive == 3 || negative == 3) return true;
    }
  }
  return false;
}

int brute_enclosed(const Sheet& sheet, const BruteFeatures& features, const Points& positions) {
  int enclosed = 0;
  for (std::size_t b = 0; b < sheet.bodies.size(); ++b) {
    if (!sheet.bodies[b].is_solid()) continue;
    data::TriangleMesh own;
    own.vertices = positions;
    for (const auto& t : features.triangles.rowwise()) {
      if (body_of(sheet, t[0]) != static_cast<int>(b)) continue;
      own.triangles.conservativeResize(own.triangles.rows() + 1, 3);
      own.triangles.bottomRows(1) = t;
    }
    for (const int v : features.vertices)
      enclosed += body_of(sheet, v) != static_cast<int>(b) &&
                  std::abs(brute_winding(own, positions.row(v).transpose())) > 0.5;
  }
  return enclosed;
}

}  // namespace flash::sim
