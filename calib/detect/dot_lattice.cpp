#include "calib/detect/dot_lattice.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <map>
#include <numeric>
#include <set>

namespace flash::calib {
namespace {

using Cell = std::pair<int, int>;  // column, row

constexpr double kTolerance = 0.35;  // of a step, by which the next one may be off
constexpr std::size_t kMostSeeds = 40;

/// A dot with the steps to the next ones that it has learnt.
struct Node {
  std::size_t dot;
  std::array<Eigen::Vector2d, 2> steps;
};

/// The nearest place that fulfils a condition; places.size() where none does.
template <class Condition>
std::size_t nearest(const std::vector<Eigen::Vector2d>& places, const Eigen::Vector2d& to,
                    const Condition& condition) {
  std::size_t best = places.size();
  for (std::size_t k = 0; k < places.size(); ++k)
    if (condition(k) && (best == places.size() || (places[k] - to).norm() < (places[best] - to).norm()))
      best = k;
  return best;
}

std::map<Cell, Node> grown_from(const std::vector<Eigen::Vector2d>& places, const Node& seed) {
  std::map<Cell, Node> cells{{{0, 0}, seed}};
  std::set<std::size_t> taken{seed.dot};
  for (std::deque<Cell> open{{0, 0}}; !open.empty(); open.pop_front()) {
    const Cell cell = open.front();
    const Node node = cells.at(cell);
    for (const std::size_t axis : {0U, 1U})
      for (const int sign : {1, -1}) {
        const Cell next{cell.first + (axis == 0 ? sign : 0), cell.second + (axis == 1 ? sign : 0)};
        if (cells.count(next) > 0) continue;
        const Eigen::Vector2d step = sign * node.steps[axis], expected = places[node.dot] + step;
        const std::size_t dot = nearest(places, expected, [&](std::size_t k) { return taken.count(k) == 0; });
        if (dot == places.size() || (places[dot] - expected).norm() > kTolerance * step.norm()) continue;
        Node& found = cells.emplace(next, Node{dot, node.steps}).first->second;
        found.steps[axis] = sign * (places[dot] - places[node.dot]);
        taken.insert(dot);
        open.push_back(next);
      }
  }
  return cells;
}

/// The one window of cells that is full; empty where there is none, or several.
std::vector<std::size_t> full_window(const std::map<Cell, Node>& cells, int columns, int rows) {
  std::vector<std::size_t> dots;
  for (const auto& start : cells) {
    std::vector<std::size_t> window;
    for (int r = 0; r < rows; ++r)
      for (int c = 0; c < columns; ++c) {
        const auto cell = cells.find({start.first.first + c, start.first.second + r});
        if (cell != cells.end()) window.push_back(cell->second.dot);
      }
    if (window.size() < static_cast<std::size_t>(columns * rows)) continue;
    if (!dots.empty()) return {};
    dots = std::move(window);
  }
  return dots;
}

}  // namespace

std::vector<std::size_t> dot_lattice(const std::vector<Eigen::Vector2d>& places, int columns, int rows) {
  if (places.size() < static_cast<std::size_t>(columns * rows)) return {};
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& place : places) middle += place / static_cast<double>(places.size());
  std::vector<std::size_t> seeds(places.size());
  std::iota(seeds.begin(), seeds.end(), 0);
  std::sort(seeds.begin(), seeds.end(), [&](std::size_t a, std::size_t b) {
    return (places[a] - middle).norm() < (places[b] - middle).norm();
  });
  seeds.resize(std::min(seeds.size(), kMostSeeds));
  for (const std::size_t seed : seeds) {
    const Eigen::Vector2d& place = places[seed];
    const std::size_t first = nearest(places, place, [&](std::size_t k) { return k != seed; });
    if (first == places.size()) continue;
    const Eigen::Vector2d along = places[first] - place;
    const std::size_t second = nearest(places, place, [&](std::size_t k) {
      const Eigen::Vector2d other = places[k] - place;
      return k != seed &&
             std::abs(along.x() * other.y() - along.y() * other.x()) > 0.5 * along.norm() * other.norm();
    });
    if (second == places.size()) continue;
    const Eigen::Vector2d across = places[second] - place;
    for (const bool exchanged : {false, true}) {
      const Node node{seed, {exchanged ? across : along, exchanged ? along : across}};
      std::vector<std::size_t> dots = full_window(grown_from(places, node), columns, rows);
      if (!dots.empty()) return dots;
    }
  }
  return {};
}

bool is_lattice(const std::vector<Eigen::Vector2d>& places, int columns, int rows) {
  const auto at = [&](int c, int r) { return places[static_cast<std::size_t>(r * columns + c)]; };
  const auto goes_on = [](const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
    return (c - 2 * b + a).norm() < kTolerance * (b - a).norm();
  };
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c) {
      if (c >= 2 && !goes_on(at(c - 2, r), at(c - 1, r), at(c, r))) return false;
      if (r >= 2 && !goes_on(at(c, r - 2), at(c, r - 1), at(c, r))) return false;
    }
  return true;
}

}  // namespace flash::calib
