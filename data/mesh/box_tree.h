#pragma once
#include <span>
#include <utility>
#include <vector>

#include "data/mesh/mesh.h"

namespace flash::data {

/// An axis-aligned box.
struct Bounds {
  Eigen::Array3d low = Eigen::Array3d::Constant(1e300), high = Eigen::Array3d::Constant(-1e300);

  void take(const Bounds& other) {
    low = low.min(other.low);
    high = high.max(other.high);
  }
};

/// Whether two boxes are nearer than `reach` in each axis.
inline bool near(const Bounds& a, const Bounds& b, double reach) {
  return ((a.low - b.high) < reach).all() && ((b.low - a.high) < reach).all();
}

/// A binary tree over triangles, laid out once; its boxes follow those of the vertices.
class BoxTree {
 public:
  /// Splits at the median along the longest side. Triangles of different `group` part first; those of one
  /// stand side by side.
  BoxTree(const Triangles& triangles, const Points& places, std::span<const int> group);

  /// Sets the boxes of triangles and nodes.
  void refit(std::span<const Bounds> vertices);

  const Bounds& triangle(int t) const { return triangles_[static_cast<std::size_t>(t)]; }

  /// Calls visit(s, t) for each two different triangles whose boxes are nearer than `reach`, once, in an
  /// order that depends on the boxes alone.
  template <typename Visit>
  void for_each_near(double reach, const Visit& visit) const {
    if (nodes_.empty()) return;
    std::vector<std::pair<int, int>> waiting = {{0, 0}};
    while (!waiting.empty()) {
      const auto [a, b] = waiting.back();
      waiting.pop_back();
      const Node &first = nodes_[a], &second = nodes_[b];
      if (a != b && !near(first.box, second.box, reach)) continue;
      if (first.left < 0 && second.left < 0) {
        for (int i = first.first; i < first.end; ++i)
          for (int j = a == b ? i + 1 : second.first; j < second.end; ++j)
            if (near(triangles_[order_[i]], triangles_[order_[j]], reach)) visit(order_[i], order_[j]);
      } else if (a == b) {
        waiting.insert(waiting.end(),
                       {{first.left, first.left}, {first.right, first.right}, {first.left, first.right}});
      } else if (second.left < 0 ||
                 (first.left >= 0 && first.end - first.first >= second.end - second.first)) {
        waiting.insert(waiting.end(), {{first.left, b}, {first.right, b}});
      } else {
        waiting.insert(waiting.end(), {{a, second.left}, {a, second.right}});
      }
    }
  }

 private:
  struct Node {
    Bounds box;
    int left = -1, right = -1;  ///< below zero: a leaf
    int first = 0, end = 0;     ///< in order_
  };

  int split(int first, int end, const Points& centres, std::span<const int> group);

  std::vector<Node> nodes_;  ///< each before those below it
  std::vector<int> order_;   ///< triangles
  std::vector<Bounds> triangles_;
  Triangles corners_;
};

}  // namespace flash::data
