#include "data/meshing/triangle_tree.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <utility>

namespace flash::data {

Eigen::Vector3d nearest_in_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                    const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  const Eigen::Vector3d ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return a;
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return b;
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + d1 / (d1 - d3) * ab;
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return c;
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + d2 / (d2 - d6) * ac;
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) return b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b);
  return a + (vb * ab + vc * ac) / (va + vb + vc);
}

TriangleTree::TriangleTree(TriangleMesh mesh) : mesh_(std::move(mesh)) {
  const Triangles& t = mesh_.triangles;
  Points middles(t.rows(), 3);
  for (Eigen::Index i = 0; i < t.rows(); ++i)
    middles.row(i) =
        (mesh_.vertices.row(t(i, 0)) + mesh_.vertices.row(t(i, 1)) + mesh_.vertices.row(t(i, 2))) / 3;
  order_.resize(std::size_t(t.rows()));
  std::iota(order_.begin(), order_.end(), 0);
  build(0, int(t.rows()), middles);
}

int TriangleTree::build(int begin, int end, const Points& middles) {
  const int index = int(nodes_.size());
  Eigen::AlignedBox3d box, spread;
  for (int i = begin; i < end; ++i) {
    const int triangle = order_[std::size_t(i)];
    for (int k = 0; k < 3; ++k) box.extend(Eigen::Vector3d(mesh_.vertices.row(mesh_.triangles(triangle, k))));
    spread.extend(Eigen::Vector3d(middles.row(triangle)));
  }
  nodes_.push_back({box, begin, end, -1});
  if (end - begin <= 4) return index;
  Eigen::Index axis;
  spread.sizes().maxCoeff(&axis);
  const int middle = (begin + end) / 2;
  std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end, [&](int a, int b) {
    return std::pair(middles(a, axis), a) < std::pair(middles(b, axis), b);
  });
  build(begin, middle, middles);
  nodes_[std::size_t(index)].right = build(middle, end, middles);
  return index;
}

SurfacePoint TriangleTree::nearest(const Eigen::Vector3d& point) const {
  SurfacePoint best;
  double least = std::numeric_limits<double>::infinity();
  std::vector<std::pair<double, int>> waiting = {{0, 0}};
  while (!waiting.empty()) {
    const auto [distance, index] = waiting.back();
    waiting.pop_back();
    if (distance >= least) continue;
    const Node& node = nodes_[std::size_t(index)];
    if (node.right >= 0) {
      std::pair<double, int> first = {nodes_[std::size_t(index + 1)].box.squaredExteriorDistance(point),
                                      index + 1};
      std::pair<double, int> second = {nodes_[std::size_t(node.right)].box.squaredExteriorDistance(point),
                                       node.right};
      if (first < second) std::swap(first, second);
      waiting.push_back(first);  // the nearer one is looked at first
      waiting.push_back(second);
      continue;
    }
    for (int i = node.begin; i < node.end; ++i) {
      const Eigen::Vector3i t = mesh_.triangles.row(order_[std::size_t(i)]);
      const Eigen::Vector3d place = nearest_in_triangle(point, mesh_.vertices.row(t[0]),
                                                        mesh_.vertices.row(t[1]), mesh_.vertices.row(t[2]));
      if (const double squared = (place - point).squaredNorm(); squared < least) {
        least = squared;
        best = {place, order_[std::size_t(i)]};
      }
    }
  }
  return best;
}

}  // namespace flash::data
