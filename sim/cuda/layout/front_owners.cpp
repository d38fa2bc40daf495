#include "sim/cuda/layout/front_owners.h"

#include <algorithm>

namespace flash::sim::cuda {
namespace {

/// Tiles of the factor that a front has, with all that it comes from.
std::vector<long> works_of(const FrontPlan& fronts) {
  std::vector<long> works;
  for (const FrontLayout& front : fronts.fronts) {
    long work = static_cast<long>(front.row_tiles) * front.column_tiles;
    for (const int child : front.children)
      if (child >= 0) work += works[static_cast<std::size_t>(child)];
    works.push_back(work);
  }
  return works;
}

/// The fronts that pass nothing up.
std::vector<int> roots_of(const FrontPlan& fronts) {
  std::vector<bool> passes(fronts.fronts.size(), false);
  for (const FrontLayout& front : fronts.fronts)
    for (const int child : front.children)
      if (child >= 0) passes[static_cast<std::size_t>(child)] = true;
  std::vector<int> roots;
  for (std::size_t f = 0; f < passes.size(); ++f)
    if (!passes[f]) roots.push_back(static_cast<int>(f));
  return roots;
}

}  // namespace

std::vector<int> front_owners(const FrontPlan& fronts, int team_blocks) {
  const std::vector<long> works = works_of(fronts);
  const auto work = [&](int front) { return works[static_cast<std::size_t>(front)]; };
  const auto by_work = [&](int a, int b) { return work(a) != work(b) ? work(a) > work(b) : a < b; };
  std::vector<int> trees = roots_of(fronts);
  while (static_cast<int>(trees.size()) < team_blocks) {
    std::sort(trees.begin(), trees.end(), by_work);
    const auto dearest = std::find_if(trees.begin(), trees.end(), [&](int tree) {
      const int* children = fronts.fronts[static_cast<std::size_t>(tree)].children;
      return children[0] >= 0 || children[1] >= 0;
    });
    if (dearest == trees.end()) break;
    const int shared = *dearest;
    trees.erase(dearest);
    for (const int child : fronts.fronts[static_cast<std::size_t>(shared)].children)
      if (child >= 0) trees.push_back(child);
  }
  std::sort(trees.begin(), trees.end(), by_work);
  std::vector<int> owners(fronts.fronts.size(), all_blocks);
  std::vector<long> loads(static_cast<std::size_t>(team_blocks), 0);
  for (const int tree : trees) {
    const auto least = std::min_element(loads.begin(), loads.end());
    *least += work(tree);
    owners[static_cast<std::size_t>(tree)] = static_cast<int>(least - loads.begin());
  }
  // A front stands behind what it comes from.
  for (std::size_t f = owners.size(); f-- > 0;)
    for (const int child : fronts.fronts[f].children)
      if (child >= 0 && owners[f] != all_blocks) owners[static_cast<std::size_t>(child)] = owners[f];
  return owners;
}

}  // namespace flash::sim::cuda
