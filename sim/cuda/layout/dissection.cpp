#include "sim/cuda/layout/dissection.h"

#include <algorithm>
#include <tuple>

namespace flash::sim::cuda {
namespace {

enum Part : char { outside, left, right };

class Dissector {
 public:
  Dissector(const BlockPattern& pattern, const data::Points& places, int leaf_size)
      : places_(places), leaf_size_(leaf_size), neighbours_(pattern.size), part_(pattern.size, outside) {
    for (const auto& [a, b] : pattern.pairs) {
      neighbours_[a].push_back(b);
      neighbours_[b].push_back(a);
    }
  }

  /// Returns the node of the set, -1 for an empty one.
  int add(const std::vector<int>& set) {
    if (set.empty()) return -1;
    DissectionNode node;
    if (static_cast<int>(set.size()) <= leaf_size_) {
      node.vertices = set;
    } else {
      Split best = split(set, 0);
      for (int axis = 1; axis < 3; ++axis) {
        Split other = split(set, axis);
        if (other.separator.size() < best.separator.size()) best = std::move(other);
      }
      // Parts that are not joined need no separator. But a front without columns of its own would not pass up
      // what its children pass to it.
      if (best.separator.empty()) {
        std::vector<int>& half = best.halves[best.halves[0].empty() ? 1 : 0];
        best.separator.push_back(half.back());
        half.pop_back();
      }
      node.children = {add(best.halves[0]), add(best.halves[1])};
      node.vertices = std::move(best.separator);
    }
    std::sort(node.vertices.begin(), node.vertices.end());
    nodes.push_back(std::move(node));
    return static_cast<int>(nodes.size()) - 1;
  }

  std::vector<DissectionNode> nodes;

 private:
  struct Split {
    std::vector<int> separator;
    std::array<std::vector<int>, 2> halves;
  };

  /// In the middle of the set along an axis; the separator is the border of one of the halves.
  Split split(std::vector<int> set, int axis) {
    const auto key = [&](int vertex) {
      return std::tuple(places_(vertex, axis), places_(vertex, (axis + 1) % 3),
                        places_(vertex, (axis + 2) % 3), vertex);
    };
    std::sort(set.begin(), set.end(), [&](int a, int b) { return key(a) < key(b); });
    const std::size_t middle = set.size() / 2;
    for (std::size_t i = 0; i < set.size(); ++i) part_[set[i]] = i < middle ? left : right;
    std::array<std::vector<int>, 2> borders, interiors;
    for (const int vertex : set) {
      const Part own = static_cast<Part>(part_[vertex]), other = own == left ? right : left;
      const auto& near = neighbours_[vertex];
      const bool on_border = std::any_of(near.begin(), near.end(), [&](int n) { return part_[n] == other; });
      (on_border ? borders : interiors)[own == right].push_back(vertex);
    }
    for (const int vertex : set) part_[vertex] = outside;
    const int side = borders[1].size() < borders[0].size();
    Split result;
    result.separator = borders[side];
    result.halves[side] = interiors[side];
    result.halves[1 - side] = interiors[1 - side];
    result.halves[1 - side].insert(result.halves[1 - side].end(), borders[1 - side].begin(),
                                   borders[1 - side].end());
    return result;
  }

  const data::Points& places_;
  int leaf_size_;
  std::vector<std::vector<int>> neighbours_;
  std::vector<char> part_;
};

}  // namespace

std::vector<DissectionNode> dissect(const BlockPattern& pattern, const data::Points& places, int leaf_size) {
  Dissector dissector(pattern, places, leaf_size);
  std::vector<int> all(pattern.size);
  for (int i = 0; i < pattern.size; ++i) all[i] = i;
  dissector.add(all);
  return std::move(dissector.nodes);
}

}  // namespace flash::sim::cuda
