#include "data/mesh/box_tree.h"

#include <algorithm>
#include <numeric>

namespace flash::data {

namespace {

constexpr int leaf_size = 2;  ///< triangles

}  // namespace

BoxTree::BoxTree(const Triangles& triangles, const Points& places, std::span<const int> group)
    : order_(static_cast<std::size_t>(triangles.rows())),
      triangles_(static_cast<std::size_t>(triangles.rows())),
      corners_(triangles) {
  std::iota(order_.begin(), order_.end(), 0);
  Points centres(triangles.rows(), 3);
  for (Eigen::Index t = 0; t < triangles.rows(); ++t)
    centres.row(t) =
        (places.row(triangles(t, 0)) + places.row(triangles(t, 1)) + places.row(triangles(t, 2))) / 3;
  if (!order_.empty()) split(0, static_cast<int>(order_.size()), centres, group);
}

int BoxTree::split(int first, int end, const Points& centres, std::span<const int> group) {
  const int own = static_cast<int>(nodes_.size());
  nodes_.push_back({{}, -1, -1, first, end});
  const bool several = group[order_[first]] != group[order_[end - 1]];
  if (!several && end - first <= leaf_size) return own;
  int middle = (first + end) / 2;
  if (several) {
    middle = first + 1;
    while (group[order_[middle]] == group[order_[first]]) ++middle;
  } else {
    Bounds box;
    for (int i = first; i < end; ++i) {
      const Eigen::Array3d centre = centres.row(order_[i]).transpose().array();
      box.take({centre, centre});
    }
    Eigen::Index axis;
    (box.high - box.low).maxCoeff(&axis);
    std::nth_element(
        order_.begin() + first, order_.begin() + middle, order_.begin() + end,
        [&](int a, int b) { return std::pair(centres(a, axis), a) < std::pair(centres(b, axis), b); });
  }
  const int left = split(first, middle, centres, group), right = split(middle, end, centres, group);
  nodes_[own].left = left;
  nodes_[own].right = right;
  return own;
}

void BoxTree::refit(std::span<const Bounds> vertices) {
  for (Eigen::Index t = 0; t < corners_.rows(); ++t) {
    Bounds box;
    for (int k = 0; k < 3; ++k) box.take(vertices[corners_(t, k)]);
    triangles_[t] = box;
  }
  for (std::size_t n = nodes_.size(); n-- > 0;) {
    Node& node = nodes_[n];
    node.box = {};
    if (node.left < 0)
      for (int i = node.first; i < node.end; ++i) node.box.take(triangles_[order_[i]]);
    else {
      node.box.take(nodes_[node.left].box);
      node.box.take(nodes_[node.right].box);
    }
  }
}

}  // namespace flash::data
