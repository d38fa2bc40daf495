#include "data/meshing/sampled_surface.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <nanoflann.hpp>
#include <utility>
#include <vector>

namespace flash::data {
namespace {

using Node = std::array<int, 3>;  ///< of the grid

constexpr int reach = 2;  ///< cells about those that hold samples in which the surface is sought

/// What the samples say of a place.
struct Here {
  double distance = 0;  ///< above the surface [m]
  double beyond = 0;    ///< above 0 beyond a border [m]
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
};

class Field {
 public:
  Field(const PointSamples& samples, double width)
      : samples_(samples), width_(width), tree_(3, samples.points, 10) {}

  Here at(const Eigen::Vector3d& x) const {
    constexpr double cutoff = 3;  // widths
    std::vector<std::pair<Eigen::Index, double>> near;
    const double radius = cutoff * width_;
    tree_.index->radiusSearch(x.data(), radius * radius, near, nanoflann::SearchParams());
    double total = 0, along_own = 0;
    Eigen::Vector3d normal = Eigen::Vector3d::Zero(), offset = Eigen::Vector3d::Zero();
    for (const auto& [index, squared] : near) {
      const double weight = samples_.weights[index] * std::exp(-squared / (2 * width_ * width_));
      const Eigen::Vector3d from = x - samples_.points.row(index).transpose(),
                            own = samples_.normals.row(index);
      total += weight;
      along_own += weight * own.dot(from);
      normal += weight * own;
      offset += weight * from;
    }
    if (total == 0) return {0, radius, Eigen::Vector3d::Zero()};
    Here here;
    here.normal = normal.normalized();
    offset /= total;
    const double along_mean = here.normal.dot(offset);
    here.distance = (along_own / total + along_mean) / 2;
    here.beyond = (offset - along_mean * here.normal).norm() - width_ * std::sqrt(2 / EIGEN_PI);
    return here;
  }

 private:
  const PointSamples& samples_;
  double width_;
  nanoflann::KDTreeEigenMatrixAdaptor<Points, 3> tree_;
};

/// The cells that hold samples, and those within reach of them, in order.
std::vector<Node> cells_near(const Points& points, double cell) {
  std::vector<Node> cells;
  for (const auto& point : points.rowwise())
    cells.push_back({int(std::floor(point[0] / cell)), int(std::floor(point[1] / cell)),
                     int(std::floor(point[2] / cell))});
  const auto unite = [&] {
    std::sort(cells.begin(), cells.end());
    cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
  };
  unite();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t count = cells.size();
    for (std::size_t i = 0; i < count; ++i)
      for (int step = -reach; step <= reach; ++step) {
        Node moved = cells[i];
        moved[axis] += step;
        if (step != 0) cells.push_back(moved);
      }
    unite();
  }
  return cells;
}

/// Vertices on the edges of the grid that the surface crosses, and the triangles between them.
class Marching {
 public:
  Marching(const Field& field, double cell) : field_(field), cell_(cell) {}

  void add(const Node& cell) {
    // Six tetrahedra about the diagonal of the cube: their edges are the same from both sides of a face.
    static constexpr int orders[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {1, 0, 2}, {0, 2, 1}, {2, 1, 0}};
    for (int i = 0; i < 6; ++i) {
      std::array<Node, 4> corners;
      corners.fill(cell);
      for (std::size_t k = 1; k < 4; ++k) {
        corners[k] = corners[k - 1];
        ++corners[k][std::size_t(orders[i][k - 1])];
      }
      if (i >= 3) std::swap(corners[2], corners[3]);  // the odd orders are mirrored
      add(corners);
    }
  }

  TriangleMesh mesh() const {
    return {Eigen::Map<const Points>(coordinates_.data(), Eigen::Index(coordinates_.size() / 3), 3),
            Eigen::Map<const Triangles>(corners_.data(), Eigen::Index(corners_.size() / 3), 3)};
  }

 private:
  Eigen::Vector3d place(const Node& node) const { return cell_ * Eigen::Vector3d(node[0], node[1], node[2]); }

  double distance(const Node& node) {
    const auto [value, is_new] = distances_.emplace(node, 0.0);
    if (is_new) value->second = field_.at(place(node)).distance;
    return value->second;
  }

  int crossing(const Node& below, const Node& above) {
    const auto [vertex, is_new] = vertices_.emplace(std::minmax(below, above), int(coordinates_.size() / 3));
    if (is_new) {
      const double a = distance(below), b = distance(above);
      const Eigen::Vector3d x =
          place(below) + std::clamp(a / (a - b), 1e-3, 1 - 1e-3) * (place(above) - place(below));
      coordinates_.insert(coordinates_.end(), x.data(), x.data() + 3);
    }
    return vertex->second;
  }

  /// A tetrahedron of positive volume; triangles are counter-clockwise seen from where the distance is above
  /// 0.
  void add(const std::array<Node, 4>& corners) {
    std::array<Node, 4> sorted = corners;  // those below the surface first, by an even number of swaps
    int below = 0;
    bool odd = false;
    for (std::size_t i = 0; i < 4; ++i)
      if (distance(sorted[i]) < 0) {
        std::swap(sorted[i], sorted[std::size_t(below)]);
        odd ^= i != std::size_t(below);
        ++below;
      }
    if (below == 0 || below == 4) return;
    if (odd) {
      if (below == 1)
        std::swap(sorted[2], sorted[3]);
      else
        std::swap(sorted[0], sorted[1]);
    }
    const auto at = [&](std::size_t i, std::size_t k) { return crossing(sorted[i], sorted[k]); };
    if (below == 1) {
      corners_.insert(corners_.end(), {at(0, 1), at(0, 2), at(0, 3)});
    } else if (below == 3) {
      corners_.insert(corners_.end(), {at(0, 3), at(1, 3), at(2, 3)});
    } else {
      const int a = at(0, 2), b = at(0, 3), c = at(1, 3), d = at(1, 2);
      corners_.insert(corners_.end(), {a, b, c, a, c, d});
    }
  }

  const Field& field_;
  double cell_;
  std::map<Node, double> distances_;
  std::map<std::pair<Node, Node>, int> vertices_;
  std::vector<double> coordinates_;
  std::vector<int> corners_;
};

/// The part of the mesh where `beyond`, of its vertices, is at most 0.
TriangleMesh clipped(const TriangleMesh& mesh, const Eigen::VectorXd& beyond) {
  std::vector<double> coordinates(mesh.vertices.data(), mesh.vertices.data() + mesh.vertices.size());
  std::vector<int> corners;
  std::map<std::pair<int, int>, int> cuts;
  for (const auto& t : mesh.triangles.rowwise()) {
    std::vector<int> inside;  // its corners, with the cuts between them
    for (int k = 0; k < 3; ++k) {
      const int a = t[k], b = t[(k + 1) % 3];
      if (beyond[a] <= 0) inside.push_back(a);
      if ((beyond[a] <= 0) == (beyond[b] <= 0)) continue;
      const auto [first, second] = std::minmax(a, b);
      const auto [cut, is_new] = cuts.emplace(std::pair(first, second), int(coordinates.size() / 3));
      if (is_new) {
        const double share = std::clamp(beyond[first] / (beyond[first] - beyond[second]), 1e-3, 1 - 1e-3);
        const Eigen::RowVector3d x =
            mesh.vertices.row(first) + share * (mesh.vertices.row(second) - mesh.vertices.row(first));
        coordinates.insert(coordinates.end(), x.data(), x.data() + 3);
      }
      inside.push_back(cut->second);
    }
    for (std::size_t k = 2; k < inside.size(); ++k)
      corners.insert(corners.end(), {inside[0], inside[k - 1], inside[k]});
  }
  return {Eigen::Map<Points>(coordinates.data(), Eigen::Index(coordinates.size() / 3), 3),
          Eigen::Map<Triangles>(corners.data(), Eigen::Index(corners.size() / 3), 3)};
}

}  // namespace

TriangleMesh sampled_surface(const PointSamples& samples, const SampledSurfaceSettings& settings) {
  const Field field(samples, settings.width);
  Marching marching(field, settings.cell);
  for (const Node& cell : cells_near(samples.points, settings.cell)) marching.add(cell);
  TriangleMesh mesh = marching.mesh();
  Eigen::VectorXd beyond(mesh.vertices.rows());
  for (Eigen::Index i = 0; i < mesh.vertices.rows(); ++i) {
    const Here here = field.at(mesh.vertices.row(i));
    beyond[i] = here.beyond;
    // The distance is not linear between the nodes: one step of Newton's method ends what is left.
    const double step = std::clamp(here.distance, -settings.cell / 4, settings.cell / 4);
    mesh.vertices.row(i) -= step * here.normal;
  }
  return clipped(mesh, beyond);
}

}  // namespace flash::data
