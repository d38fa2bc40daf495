#include "data/meshing/remesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <utility>
#include <vector>

#include "data/meshing/surface_topology.h"
#include "data/meshing/triangle_tree.h"

namespace flash::data {
namespace {

using Eigen::Vector3d;
using Triangle = std::array<int, 3>;
using Edge = std::array<int, 2>;

/// What a vertex may do.
enum class Place { inner, border, corner };

/// The pieces of the borders.
struct Borders {
  std::vector<std::array<Vector3d, 2>> pieces;

  Vector3d nearest(const Vector3d& p) const {
    Vector3d best = p;
    double least = std::numeric_limits<double>::infinity();
    for (const auto& [a, b] : pieces) {
      const double share = std::clamp((p - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
      const Vector3d place = a + share * (b - a);
      if (const double squared = (p - place).squaredNorm(); squared < least) {
        least = squared;
        best = place;
      }
    }
    return best;
  }
};

/// By how much a border turns about each of its vertices, between the places `arc` before and behind it
/// [rad].
std::vector<double> turns_along(const std::vector<Vector3d>& loop, double arc) {
  const int n = int(loop.size());
  const auto at = [&](int i) -> const Vector3d& { return loop[std::size_t((i % n + n) % n)]; };
  const auto place = [&](int from, int step) {
    double left = arc;
    for (int i = from, k = 0; k < n; i += step, ++k) {
      const double length = (at(i + step) - at(i)).norm();
      if (length >= left) return Vector3d(at(i) + left / length * (at(i + step) - at(i)));
      left -= length;
    }
    return at(from);
  };
  std::vector<double> turns;
  for (int i = 0; i < n; ++i) {
    const Vector3d before = at(i) - place(i, -1), behind = place(i, 1) - at(i);
    turns.push_back(std::atan2(before.cross(behind).norm(), before.dot(behind)));
  }
  return turns;
}

/// Those that turn by more than 50 degrees, and by more than any other within `arc`.
std::vector<int> corners_of(const std::vector<int>& border, const Points& points, double arc) {
  constexpr double least_turn = 50 * EIGEN_PI / 180;
  std::vector<Vector3d> loop;
  for (const int vertex : border) loop.emplace_back(points.row(vertex));
  const std::vector<double> turns = turns_along(loop, arc);
  std::vector<int> order(border.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = int(i);
  std::stable_sort(order.begin(), order.end(),
                   [&](int a, int b) { return turns[std::size_t(a)] > turns[std::size_t(b)]; });
  std::vector<int> corners;
  for (const int i : order) {
    if (turns[std::size_t(i)] < least_turn) break;
    if (std::all_of(corners.begin(), corners.end(), [&](int corner) {
          return (points.row(corner).transpose() - loop[std::size_t(i)]).norm() >= arc;
        }))
      corners.push_back(border[std::size_t(i)]);
  }
  return corners;
}

/// A surface that changes.
class Changing {
 public:
  Changing(const TriangleMesh& mesh, double edge) : surface_(mesh), edge_(edge) {
    for (const auto& row : mesh.vertices.rowwise()) vertices_.emplace_back(row.transpose());
    around_.resize(vertices_.size());
    places_.resize(vertices_.size(), Place::inner);
    for (const auto& t : mesh.triangles.rowwise()) add({t[0], t[1], t[2]});
    for (const std::vector<int>& border : topology_of(mesh).borders) {
      for (std::size_t i = 0; i < border.size(); ++i) {
        places_[std::size_t(border[i])] = Place::border;
        borders_.pieces.push_back({at(border[i]), at(border[(i + 1) % border.size()])});
      }
      for (const int corner : corners_of(border, mesh.vertices, edge))
        places_[std::size_t(corner)] = Place::corner;
    }
  }

  void split_long() {
    const double limit = 4.0 / 3 * edge_;
    for (bool again = true; again;) {
      again = false;
      for (const Edge& edge : edges())
        if (length(edge) > limit) {
          split(edge);
          again = true;
        }
    }
  }

  /// Those below `shortest`, where that makes none longer than `longest` [m].
  void collapse_short(double shortest, double longest) {
    for (const Edge& edge : edges())
      if (exists(edge) && length(edge) < shortest) collapse(edge, longest);
  }

  /// One triangle for the three about an inner vertex of no more: they keep the edges around from collapsing.
  void drop_threefold() {
    for (int v = 0; v < int(vertices_.size()); ++v) {
      const std::vector<int> three = around_[std::size_t(v)];
      if (place(v) != Place::inner || three.size() != 3) continue;
      Triangle t = triangle(three[0]);
      const std::set<int> ring = neighbours(v);
      if (ring.size() != 3) continue;
      for (const int w : ring)
        if (!has(t, w)) std::replace(t.begin(), t.end(), v, w);
      for (const int i : three) remove(i);
      add(t);
    }
  }

  void flip_to_delaunay() {
    constexpr int most_rounds = 20;
    bool again = true;
    for (int round = 0; again && round < most_rounds; ++round) {
      again = false;
      for (const Edge& edge : edges()) again = (exists(edge) && flip(edge)) || again;
    }
  }

  void relax() {
    const std::vector<Vector3d> before = vertices_;
    for (int v = 0; v < int(vertices_.size()); ++v) {
      if (around_[std::size_t(v)].empty() || place(v) == Place::corner) continue;
      Vector3d sum = Vector3d::Zero();
      int count = 0;
      for (const int w : neighbours(v))
        if (place(v) == Place::inner || is_border({v, w})) {
          sum += before[std::size_t(w)];
          ++count;
        }
      const Vector3d moved = sum / count, old = at(v);
      if (place(v) == Place::inner) {
        const Vector3d n = normal(v);
        at(v) = surface_.nearest(moved - n.dot(moved - old) * n).place;
      } else {
        at(v) = borders_.nearest(moved);
      }
      if (spoils(v, old)) at(v) = old;
    }
  }

  TriangleMesh result() const {
    std::vector<int> numbers(vertices_.size(), -1);
    std::vector<Vector3d> kept;
    TriangleMesh mesh;
    for (std::size_t v = 0; v < vertices_.size(); ++v)
      if (!around_[v].empty()) {
        numbers[v] = int(kept.size());
        kept.push_back(vertices_[v]);
      }
    mesh.vertices.resize(Eigen::Index(kept.size()), 3);
    for (std::size_t i = 0; i < kept.size(); ++i) mesh.vertices.row(Eigen::Index(i)) = kept[i];
    std::vector<int> corners;
    for (const Triangle& t : triangles_)
      if (t[0] >= 0)
        for (const int v : t) corners.push_back(numbers[std::size_t(v)]);
    mesh.triangles = Eigen::Map<Triangles>(corners.data(), Eigen::Index(corners.size() / 3), 3);
    return mesh;
  }

 private:
  Vector3d& at(int v) { return vertices_[std::size_t(v)]; }
  const Vector3d& at(int v) const { return vertices_[std::size_t(v)]; }
  Place place(int v) const { return places_[std::size_t(v)]; }
  const Triangle& triangle(int i) const { return triangles_[std::size_t(i)]; }
  double length(const Edge& edge) const { return (at(edge[1]) - at(edge[0])).norm(); }

  Vector3d area_vector(const Triangle& t) const { return (at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0])); }
  Vector3d normal(int v) const {
    Vector3d sum = Vector3d::Zero();
    for (const int i : around_[std::size_t(v)]) sum += area_vector(triangle(i));
    return sum.normalized();
  }

  void add(const Triangle& t) {
    for (const int v : t) around_[std::size_t(v)].push_back(int(triangles_.size()));
    triangles_.push_back(t);
  }
  void remove(int i) {
    for (const int v : triangle(i)) std::erase(around_[std::size_t(v)], i);
    triangles_[std::size_t(i)] = {-1, -1, -1};
  }
  void replace(int i, int old, int vertex) {
    Triangle t = triangle(i);
    std::replace(t.begin(), t.end(), old, vertex);
    std::erase(around_[std::size_t(old)], i);
    around_[std::size_t(vertex)].push_back(i);
    triangles_[std::size_t(i)] = t;
  }

  static bool has(const Triangle& t, int v) { return t[0] == v || t[1] == v || t[2] == v; }
  static int third(const Triangle& t, const Edge& edge) {
    for (const int v : t)
      if (v != edge[0] && v != edge[1]) return v;
    return -1;
  }

  std::vector<int> beside(const Edge& edge) const {
    std::vector<int> found;
    for (const int i : around_[std::size_t(edge[0])])
      if (has(triangle(i), edge[1])) found.push_back(i);
    return found;
  }
  bool exists(const Edge& edge) const { return !beside(edge).empty(); }
  bool is_border(const Edge& edge) const { return beside(edge).size() == 1; }

  std::set<int> neighbours(int v) const {
    std::set<int> found;
    for (const int i : around_[std::size_t(v)])
      for (const int w : triangle(i))
        if (w != v) found.insert(w);
    return found;
  }

  std::vector<Edge> edges() const {
    std::vector<Edge> found;
    for (const Triangle& t : triangles_)
      for (std::size_t k = 0; k < 3; ++k)
        if (t[0] >= 0) found.push_back({std::min(t[k], t[(k + 1) % 3]), std::max(t[k], t[(k + 1) % 3])});
    std::sort(found.begin(), found.end());
    found.erase(std::unique(found.begin(), found.end()), found.end());
    return found;
  }

  /// Whether a triangle about v looks another way than when v was at `old`, or is small and has shrunk.
  bool spoils(int v, const Vector3d& old) const {
    const auto moved = [&](int w) -> const Vector3d& { return w == v ? old : at(w); };
    return std::any_of(around_[std::size_t(v)].begin(), around_[std::size_t(v)].end(), [&](int i) {
      const Triangle& t = triangle(i);
      const Vector3d before = (moved(t[1]) - moved(t[0])).cross(moved(t[2]) - moved(t[0])),
                     now = area_vector(t);
      const bool shrinks = now.norm() < std::min(0.3 * edge_ * edge_, before.norm());
      return shrinks || now.dot(before) < 0.2 * now.norm() * before.norm();
    });
  }

  void split(const Edge& edge) {
    const std::vector<int> both = beside(edge);
    const int middle = int(vertices_.size());
    vertices_.emplace_back((at(edge[0]) + at(edge[1])) / 2);
    around_.emplace_back();
    places_.push_back(both.size() == 1 ? Place::border : Place::inner);
    for (const int i : both) {
      Triangle other = triangle(i);
      std::replace(other.begin(), other.end(), edge[0], middle);
      replace(i, edge[1], middle);
      add(other);
    }
  }

  /// Takes one end of the edge away where the surface stays one and no edge gets too long.
  void collapse(const Edge& edge, double longest) {
    auto [gone, kept] = edge;
    if (place(gone) > place(kept)) std::swap(gone, kept);
    if (place(gone) == Place::corner) return;
    const std::vector<int> both = beside(edge);
    if (place(gone) == Place::border && both.size() != 1) return;
    const std::set<int> of_gone = neighbours(gone), of_kept = neighbours(kept);
    std::vector<int> common;
    std::set_intersection(of_gone.begin(), of_gone.end(), of_kept.begin(), of_kept.end(),
                          std::back_inserter(common));
    if (common.size() != both.size()) return;  // a tunnel would close
    if (both.size() == 1 && around_[std::size_t(third(triangle(both[0]), edge))].size() == 1) return;
    if (of_kept.size() <= 3 && place(kept) == Place::inner) return;
    const Vector3d target = place(gone) == place(kept) ? Vector3d((at(gone) + at(kept)) / 2) : at(kept);
    const auto too_long = [&](int w) { return (at(w) - target).norm() > longest; };
    if (std::any_of(of_gone.begin(), of_gone.end(), too_long)) return;
    if (std::any_of(of_kept.begin(), of_kept.end(), too_long)) return;
    for (const int v : {gone, kept})
      for (const int i : around_[std::size_t(v)]) {
        if (std::find(both.begin(), both.end(), i) != both.end()) continue;
        const Triangle& t = triangle(i);
        const auto moved = [&](int w) -> const Vector3d& { return w == v ? target : at(w); };
        const Vector3d now = (moved(t[1]) - moved(t[0])).cross(moved(t[2]) - moved(t[0]));
        const Vector3d before = area_vector(t);
        // Slivers have no direction to keep.
        const bool sliver = before.norm() < 1e-4 * edge_ * edge_;
        if (!sliver && now.dot(before) < 0.2 * now.norm() * before.norm()) return;
      }
    for (const int i : both) remove(i);
    const std::vector<int> left = around_[std::size_t(gone)];
    for (const int i : left) replace(i, gone, kept);
    at(kept) = target;
  }

  /// Whether the edge was turned within its two triangles: where the angles against it add up to more than a
  /// half turn.
  bool flip(const Edge& edge) {
    const std::vector<int> both = beside(edge);
    if (both.size() != 2) return false;
    int first = both[0], second = both[1];
    const int a = edge[0], b = edge[1];
    if (!runs(triangle(first), a, b)) std::swap(first, second);
    const int c = third(triangle(first), edge), d = third(triangle(second), edge);
    if (exists({c, d})) return false;
    const auto angle = [&](int apex) {
      const Vector3d u = at(a) - at(apex), v = at(b) - at(apex);
      return std::atan2(u.cross(v).norm(), u.dot(v));
    };
    if (angle(c) + angle(d) <= EIGEN_PI + 1e-6) return false;
    const Triangle one = {c, d, b}, other = {d, c, a};
    const Vector3d mean = area_vector(triangle(first)) + area_vector(triangle(second));
    for (const Triangle& t : {one, other})
      if (area_vector(t).dot(mean) < 0.5 * area_vector(t).norm() * mean.norm()) return false;
    if (around_[std::size_t(a)].size() <= 3 && place(a) == Place::inner) return false;
    if (around_[std::size_t(b)].size() <= 3 && place(b) == Place::inner) return false;
    remove(first);
    remove(second);
    add(one);
    add(other);
    return true;
  }
  static bool runs(const Triangle& t, int a, int b) {
    for (std::size_t k = 0; k < 3; ++k)
      if (t[k] == a && t[(k + 1) % 3] == b) return true;
    return false;
  }

  TriangleTree surface_;
  Borders borders_;
  double edge_;
  std::vector<Vector3d> vertices_;
  std::vector<Place> places_;
  std::vector<Triangle> triangles_;
  std::vector<std::vector<int>> around_;  ///< triangles of each vertex
};

}  // namespace

EdgeLengths edge_lengths(const TriangleMesh& mesh) {
  EdgeLengths result{std::numeric_limits<double>::infinity()};
  double sum = 0;
  int count = 0;
  std::set<Edge> seen;
  for (const auto& t : mesh.triangles.rowwise())
    for (int k = 0; k < 3; ++k) {
      const int a = t[k], b = t[(k + 1) % 3];
      if (!seen.insert({std::min(a, b), std::max(a, b)}).second) continue;
      const double length = (mesh.vertices.row(a) - mesh.vertices.row(b)).norm();
      result.least = std::min(result.least, length);
      result.largest = std::max(result.largest, length);
      sum += length;
      ++count;
    }
  result.mean = sum / std::max(1, count);
  return result;
}

TriangleMesh remeshed(const TriangleMesh& mesh, double edge) {
  constexpr int rounds = 10;
  Changing changing(mesh, edge);
  for (int round = 0; round < rounds; ++round) {
    changing.split_long();
    changing.drop_threefold();
    changing.collapse_short(0.8 * edge, 4.0 / 3 * edge);
    changing.flip_to_delaunay();
    for (int step = 0; step < 3; ++step) changing.relax();
  }
  changing.drop_threefold();
  changing.collapse_short(0.6 * edge, 1.5 * edge);  // what was too near others to go before
  changing.flip_to_delaunay();
  return changing.result();
}

}  // namespace flash::data
