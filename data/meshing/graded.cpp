#include "data/meshing/graded.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>
#include <utility>

namespace flash::data {
namespace {

using Eigen::Vector3d;
using Triangle = std::array<int, 3>;
using Edge = std::array<int, 2>;

constexpr double kOn = 1e-12;  // of a distance, over the size of the sheet: on the outline

/// A sheet that is cut finer.
class Cutting {
 public:
  explicit Cutting(const PlacedSheet& sheet) : added_(sheet.added) {
    for (Eigen::Index v = 0; v < sheet.rest.vertices.rows(); ++v) {
      rest_.emplace_back(sheet.rest.vertices.row(v).transpose());
      start_.emplace_back(sheet.start.row(v).transpose());
    }
    around_.resize(rest_.size());
    for (const auto& t : sheet.rest.triangles.rowwise()) add({t[0], t[1], t[2]});
  }

  PlacedSheet result() const {
    PlacedSheet sheet{{}, {}, added_};
    const auto count = static_cast<Eigen::Index>(rest_.size());
    sheet.rest.vertices.resize(count, 3);
    sheet.start.resize(count, 3);
    for (Eigen::Index v = 0; v < count; ++v) {
      sheet.rest.vertices.row(v) = rest_[std::size_t(v)].transpose();
      sheet.start.row(v) = start_[std::size_t(v)].transpose();
    }
    sheet.rest.triangles.resize(Eigen::Index(triangles_.size()), 3);
    for (std::size_t i = 0; i < triangles_.size(); ++i)
      for (int k = 0; k < 3; ++k) sheet.rest.triangles(Eigen::Index(i), k) = triangles_[i][std::size_t(k)];
    return sheet;
  }

  int triangle_count() const { return int(triangles_.size()); }
  int vertex_count() const { return int(rest_.size()); }
  const Vector3d& rest(int v) const { return rest_[std::size_t(v)]; }
  const Triangle& triangle(int i) const { return triangles_[std::size_t(i)]; }
  const std::vector<int>& around(int v) const { return around_[std::size_t(v)]; }

  /// The longest edge of a triangle; of equal ones the same from both sides.
  Edge longest(int i) const {
    const Triangle& t = triangle(i);
    Edge best{};
    double most = -1;
    for (std::size_t k = 0; k < 3; ++k) {
      const Edge edge = sorted(t[k], t[(k + 1) % 3]);
      const double squared = (rest(edge[0]) - rest(edge[1])).squaredNorm();
      if (squared > most || (squared == most && edge < best)) {
        most = squared;
        best = edge;
      }
    }
    return best;
  }

  std::vector<int> beside(const Edge& edge) const {
    std::vector<int> found;
    for (const int i : around(edge[0])) {
      const Triangle& t = triangle(i);
      if (std::find(t.begin(), t.end(), edge[1]) != t.end()) found.push_back(i);
    }
    return found;
  }

  std::vector<Edge> edges() const {
    std::vector<Edge> all;
    for (const Triangle& t : triangles_)
      for (std::size_t k = 0; k < 3; ++k) all.push_back(sorted(t[k], t[(k + 1) % 3]));
    std::sort(all.begin(), all.end());
    all.erase(std::unique(all.begin(), all.end()), all.end());
    return all;
  }

  /// A vertex on an edge, `share` of the way, which becomes one of all triangles beside it.
  int cut(const Edge& edge, double share) {
    const std::vector<int> both = beside(edge);
    const int middle = vertex_count();
    rest_.emplace_back((1 - share) * rest(edge[0]) + share * rest(edge[1]));
    start_.emplace_back((1 - share) * start_[std::size_t(edge[0])] + share * start_[std::size_t(edge[1])]);
    added_.push_back(edge);
    around_.emplace_back();
    for (const int i : both) {
      Triangle other = triangle(i);
      std::replace(other.begin(), other.end(), edge[0], middle);
      Triangle& own = triangles_[std::size_t(i)];
      std::replace(own.begin(), own.end(), edge[1], middle);
      std::erase(around_[std::size_t(edge[1])], i);
      around_[std::size_t(middle)].push_back(i);
      add(other);
    }
    return middle;
  }

  /// Cuts the triangle by its longest edge, and first those that would be left with a vertex on an edge.
  void bisect(int i) {
    const Triangle was = triangle(i);
    while (triangle(i) == was) {
      int at = i;
      while (true) {
        const Edge edge = longest(at);
        const std::vector<int> both = beside(edge);
        const auto next = std::find_if(both.begin(), both.end(), [&](int t) { return longest(t) != edge; });
        if (next == both.end()) {
          cut(edge, 0.5);
          break;
        }
        at = *next;
      }
    }
  }

  /// Moves a vertex along an edge towards its other end, in both places, unless a triangle would look another
  /// way or lose most of its area. Whether it did.
  bool slide(int v, int towards, double share) {
    const Vector3d moved = (1 - share) * rest(v) + share * rest(towards);
    for (const int i : around(v)) {
      const Vector3d before = area_vector(i, v, rest(v)), now = area_vector(i, v, moved);
      if (now.dot(before) < kLeastArea * before.squaredNorm()) return false;
    }
    rest_[std::size_t(v)] = moved;
    Vector3d& start = start_[std::size_t(v)];
    start = ((1 - share) * start + share * start_[std::size_t(towards)]).eval();
    return true;
  }

  /// Puts a vertex at a place of a triangle about it, by its weights of the corners.
  bool place_in(int v, int i, const Vector3d& weights) {
    const Triangle& t = triangle(i);
    Vector3d moved = Vector3d::Zero(), start = Vector3d::Zero();
    for (std::size_t k = 0; k < 3; ++k) {
      moved += weights[Eigen::Index(k)] * rest(t[k]);
      start += weights[Eigen::Index(k)] * start_[std::size_t(t[k])];
    }
    for (const int j : around(v)) {
      const Vector3d before = area_vector(j, v, rest(v)), now = area_vector(j, v, moved);
      if (now.dot(before) < kLeastArea * before.squaredNorm()) return false;
    }
    rest_[std::size_t(v)] = moved;
    start_[std::size_t(v)] = start;
    return true;
  }

  /// A new vertex inside a triangle, which is cut in three.
  void cut_inside(int i, const Vector3d& weights) {
    const Triangle t = triangle(i);
    const int middle = vertex_count();
    Vector3d at = Vector3d::Zero(), start = Vector3d::Zero();
    for (std::size_t k = 0; k < 3; ++k) {
      at += weights[Eigen::Index(k)] * rest(t[k]);
      start += weights[Eigen::Index(k)] * start_[std::size_t(t[k])];
    }
    rest_.push_back(at);
    start_.push_back(start);
    added_.push_back({-1, -1});
    around_.emplace_back();
    triangles_[std::size_t(i)] = {t[0], t[1], middle};
    std::erase(around_[std::size_t(t[2])], i);
    around_[std::size_t(middle)].push_back(i);
    add({t[1], t[2], middle});
    add({t[2], t[0], middle});
  }

  /// The other ends of the edges at a vertex that belong to one triangle alone.
  std::vector<int> along_border(int v) const {
    std::vector<int> ends;
    for (const int i : around(v))
      for (const int w : triangle(i))
        if (w != v && beside(sorted(v, w)).size() == 1) ends.push_back(w);
    return ends;
  }
  bool on_border(int v) const { return !along_border(v).empty(); }

  /// Whether a vertex may slide along an edge: from the inside of the sheet, or along a border that does not
  /// turn there.
  bool may_slide(int v, int towards) const {
    constexpr double kStraight = 0.999;  // cosine of the turn
    const std::vector<int> ends = along_border(v);
    if (ends.empty()) return true;
    if (ends.size() != 2 || (ends[0] != towards && ends[1] != towards)) return false;
    const Vector3d before = (rest(v) - rest(ends[0])).normalized(),
                   behind = (rest(ends[1]) - rest(v)).normalized();
    return before.dot(behind) > kStraight;
  }

  static Edge sorted(int a, int b) { return {std::min(a, b), std::max(a, b)}; }

 private:
  static constexpr double kLeastArea = 0.2;  // of a triangle that a vertex slides over

  void add(const Triangle& t) {
    for (const int v : t) around_[std::size_t(v)].push_back(int(triangles_.size()));
    triangles_.push_back(t);
  }
  Vector3d area_vector(int i, int v, const Vector3d& at) const {
    const Triangle& t = triangle(i);
    const auto place = [&](int w) -> const Vector3d& { return w == v ? at : rest(w); };
    return (place(t[1]) - place(t[0])).cross(place(t[2]) - place(t[0]));
  }

  std::vector<Vector3d> rest_, start_;
  std::vector<Edge> added_;
  std::vector<Triangle> triangles_;
  std::vector<std::vector<int>> around_;  ///< triangles of each vertex
};

double size_of(const PlacedSheet& sheet) {
  return (sheet.rest.vertices.colwise().maxCoeff() - sheet.rest.vertices.colwise().minCoeff()).norm();
}

/// Where the distance along an edge is zero, as a share of the way; of ends on both sides of an outline.
double crossing(const Outline& outline, const Vector3d& a, const Vector3d& b) {
  double low = 0, high = 1;
  const bool rises = outline.distance(b) > outline.distance(a);
  for (int round = 0; round < 60; ++round) {
    const double middle = 0.5 * (low + high);
    const bool beyond = outline.distance(a + middle * (b - a)) > 0;
    (beyond == rises ? high : low) = middle;
  }
  return 0.5 * (low + high);
}

/// Puts a vertex at a corner of an outline: the nearest inner one of the triangle that it lies in slides
/// there, or the triangle is cut.
void take_corner(Cutting& cutting, const Vector3d& corner, double size) {
  for (int v = 0; v < cutting.vertex_count(); ++v)
    if ((cutting.rest(v) - corner).norm() < 1e-9 * size) return;
  for (int i = 0; i < cutting.triangle_count(); ++i) {
    const Triangle t = cutting.triangle(i);
    Eigen::Matrix3d edges;
    edges.col(0) = cutting.rest(t[1]) - cutting.rest(t[0]);
    edges.col(1) = cutting.rest(t[2]) - cutting.rest(t[0]);
    const double area = edges.col(0).cross(edges.col(1)).norm();
    edges.col(2) = edges.col(0).cross(edges.col(1)) / std::sqrt(area);
    const Vector3d x = edges.inverse() * (corner - cutting.rest(t[0]));
    const Vector3d weights(1 - x[0] - x[1], x[0], x[1]);
    if (weights.minCoeff() < -1e-9 || std::abs(x[2]) * std::sqrt(area) > 1e-6 * size) continue;
    std::array<std::size_t, 3> order = {0, 1, 2};
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return weights[Eigen::Index(a)] > weights[Eigen::Index(b)];
    });
    for (const std::size_t k : order)
      if (!cutting.on_border(t[k]) && cutting.place_in(t[k], i, weights)) return;
    cutting.cut_inside(i, weights);
    return;
  }
}

/// Vertices on an outline and edges across it; what lies on it counts as neither side.
void align(Cutting& cutting, const Outline& outline, double size) {
  constexpr double kNear = 0.35;    // of an edge: its end slides
  constexpr double kSliver = 0.05;  // of an edge: its end counts as on the outline
  for (const Vector3d& corner : outline.corners) take_corner(cutting, corner, size);
  std::vector<double> distance;
  const auto measure = [&](int v) {
    const double d = outline.distance(cutting.rest(v));
    return std::abs(d) < kOn * size ? 0.0 : d;
  };
  for (int v = 0; v < cutting.vertex_count(); ++v) distance.push_back(measure(v));
  struct Slide {
    double way;  ///< [m]
    int vertex, towards;
    double share;
  };
  std::vector<Slide> slides;
  const auto crosses = [&](const Edge& edge) {
    return distance[std::size_t(edge[0])] * distance[std::size_t(edge[1])] < 0;
  };
  for (const Edge& edge : cutting.edges()) {
    if (!crosses(edge)) continue;
    const double share = crossing(outline, cutting.rest(edge[0]), cutting.rest(edge[1]));
    const double length = (cutting.rest(edge[1]) - cutting.rest(edge[0])).norm();
    for (const int end : {0, 1}) {
      const double part = end == 0 ? share : 1 - share;
      const int v = edge[std::size_t(end)];
      const int other = edge[std::size_t(1 - end)];
      if (part < kNear && cutting.may_slide(v, other)) slides.push_back({part * length, v, other, part});
    }
  }
  std::sort(slides.begin(), slides.end(), [](const Slide& a, const Slide& b) {
    return std::tie(a.way, a.vertex, a.towards) < std::tie(b.way, b.vertex, b.towards);
  });
  for (const Slide& slide : slides) {
    const auto v = std::size_t(slide.vertex), w = std::size_t(slide.towards);
    if (!(distance[v] * distance[w] < 0)) continue;  // one of them lies on the outline by now
    if (cutting.slide(slide.vertex, slide.towards, slide.share)) distance[v] = 0;
  }
  for (const Edge& edge : cutting.edges()) {
    if (!crosses(edge)) continue;
    const double share = crossing(outline, cutting.rest(edge[0]), cutting.rest(edge[1]));
    if (std::min(share, 1 - share) < kSliver) {
      distance[std::size_t(edge[share < 0.5 ? 0 : 1])] = 0;
      continue;
    }
    cutting.cut(edge, share);
    distance.push_back(0);
  }
}

}  // namespace

PlacedSheet refined_towards(const PlacedSheet& sheet, const std::vector<Outline>& outlines, double growth,
                            double corner_growth) {
  constexpr double kLong = 4.0 / 3;  // of the wanted length: halves are as far below it as these are above
  Cutting cutting(sheet);
  for (bool again = true; again;) {
    again = false;
    for (int i = 0; i < cutting.triangle_count(); ++i) {
      const Edge edge = cutting.longest(i);
      const Vector3d &a = cutting.rest(edge[0]), &b = cutting.rest(edge[1]);
      const Triangle& t = cutting.triangle(i);
      const Vector3d middle = (cutting.rest(t[0]) + cutting.rest(t[1]) + cutting.rest(t[2])) / 3;
      double wanted = std::numeric_limits<double>::infinity();
      for (const Outline& outline : outlines)
        for (const Vector3d& place : {a, b, middle}) {
          wanted = std::min(wanted, outline.near + (growth - 1) * std::abs(outline.distance(place)));
          for (const Vector3d& corner : outline.corners)
            wanted = std::min(wanted, outline.near_corner + (corner_growth - 1) * (place - corner).norm());
        }
      if ((b - a).norm() <= kLong * wanted) continue;
      cutting.bisect(i);
      again = true;
    }
  }
  return cutting.result();
}

PlacedSheet aligned_with(const PlacedSheet& sheet, const std::vector<Outline>& outlines) {
  Cutting cutting(sheet);
  for (const Outline& outline : outlines) align(cutting, outline, size_of(sheet));
  return cutting.result();
}

PlacedSheet halved_cells(const PlacedSheet& sheet) {
  PlacedSheet halves{{}, {}, sheet.added};
  const Eigen::Index vertices = sheet.rest.vertices.rows(), triangles = sheet.rest.triangles.rows();
  std::map<Edge, int> middles;
  for (const auto& t : sheet.rest.triangles.rowwise())
    for (int k = 0; k < 3; ++k) {
      const Edge edge = Cutting::sorted(t[k], t[(k + 1) % 3]);
      if (middles.try_emplace(edge, int(vertices) + int(middles.size())).second) halves.added.push_back(edge);
    }
  halves.rest.vertices.resize(vertices + Eigen::Index(middles.size()), 3);
  halves.start.resize(halves.rest.vertices.rows(), 3);
  halves.rest.vertices.topRows(vertices) = sheet.rest.vertices;
  halves.start.topRows(vertices) = sheet.start;
  for (const auto& [edge, middle] : middles) {
    halves.rest.vertices.row(middle) =
        0.5 * (sheet.rest.vertices.row(edge[0]) + sheet.rest.vertices.row(edge[1]));
    halves.start.row(middle) = 0.5 * (sheet.start.row(edge[0]) + sheet.start.row(edge[1]));
  }
  halves.rest.triangles.resize(4 * triangles, 3);
  for (Eigen::Index i = 0; i < triangles; ++i) {
    const Eigen::Vector3i t = sheet.rest.triangles.row(i).transpose();
    Eigen::Vector3i m;
    for (int k = 0; k < 3; ++k) m[k] = middles.at(Cutting::sorted(t[k], t[(k + 1) % 3]));
    halves.rest.triangles.middleRows(4 * i, 4) << t[0], m[0], m[2], m[0], t[1], m[1], m[2], m[1], t[2], m[0],
        m[1], m[2];
  }
  return halves;
}

}  // namespace flash::data
