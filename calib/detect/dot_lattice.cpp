#include "calib/detect/dot_lattice.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <map>

#include "calib/detect/opencv_image.h"

namespace flash::calib {
namespace {

using Dots = std::vector<Eigen::Vector2d>;
using Place = std::pair<int, int>;  ///< in the lattice
using Lattice = std::map<Place, std::size_t>;

constexpr double kLeastShare = 0.9;  // of the dots must be seen

/// The shortest steps from one dot to others in two directions.
std::optional<std::array<Eigen::Vector2d, 2>> shortest_steps(const Dots& dots, std::size_t from) {
  constexpr double kLeastSine = 0.3;
  Dots steps;
  for (std::size_t i = 0; i < dots.size(); ++i)
    if (i != from) steps.emplace_back(dots[i] - dots[from]);
  if (steps.size() < 2) return std::nullopt;
  std::sort(steps.begin(), steps.end(), [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return a.squaredNorm() < b.squaredNorm();
  });
  const Eigen::Vector2d& u = steps.front();
  for (const Eigen::Vector2d& v : steps)
    if (std::abs(u.x() * v.y() - u.y() * v.x()) > kLeastSine * u.norm() * v.norm()) return {{u, v}};
  return std::nullopt;
}

/// Grown from one dot along two steps.
Lattice grown(const Dots& dots, std::size_t from, const std::array<Eigen::Vector2d, 2>& first) {
  constexpr double kTolerance = 0.3;  // of the shorter step
  Lattice lattice{{{0, 0}, from}};
  std::vector<bool> taken(dots.size(), false);
  taken[from] = true;
  std::deque<std::pair<Place, std::array<Eigen::Vector2d, 2>>> open{{{0, 0}, first}};
  while (!open.empty()) {
    const Place place = open.front().first;
    std::array<Eigen::Vector2d, 2> steps = open.front().second;
    open.pop_front();
    const Eigen::Vector2d& here = dots[lattice.at(place)];
    const auto neighbour = [&](std::size_t axis, int sign) -> Place {
      return {place.first + (axis == 0 ? sign : 0), place.second + (axis == 1 ? sign : 0)};
    };
    // Perspective changes the steps: those last made beside this dot are the best guess.
    for (const std::size_t axis : {0, 1})
      for (const int sign : {-1, 1})
        if (const auto known = lattice.find(neighbour(axis, sign)); known != lattice.end())
          steps[axis] = sign * (dots[known->second] - here);
    const double reach = kTolerance * std::min(steps[0].norm(), steps[1].norm());
    for (const std::size_t axis : {0, 1})
      for (const int sign : {-1, 1}) {
        if (lattice.count(neighbour(axis, sign)) > 0) continue;
        const Eigen::Vector2d expected = here + sign * steps[axis];
        std::size_t nearest = dots.size();
        double least = reach;
        for (std::size_t i = 0; i < dots.size(); ++i)
          if (const double distance = (dots[i] - expected).norm(); !taken[i] && distance < least) {
            least = distance;
            nearest = i;
          }
        if (nearest == dots.size()) continue;
        taken[nearest] = true;
        lattice[neighbour(axis, sign)] = nearest;
        open.emplace_back(neighbour(axis, sign), steps);
      }
  }
  return lattice;
}

/// All changes of the lattice's basis by steps that are as short: a square seen aslant has diagonals that are
/// shorter than its sides.
std::vector<Eigen::Matrix2i> bases() {
  std::vector<Eigen::Matrix2i> list;
  for (int code = 0; code < 625; ++code) {
    Eigen::Matrix2i basis;
    basis << code % 5 - 2, code / 5 % 5 - 2, code / 25 % 5 - 2, code / 125 - 2;
    if (std::abs(basis.determinant()) == 1) list.push_back(basis);
  }
  return list;
}

/// The grid in the lattice, -1 where a dot is missing; empty where it is not there.
std::vector<int> grid_in(const Lattice& lattice, int columns, int rows) {
  const int least = static_cast<int>(std::ceil(kLeastShare * columns * rows));
  if (static_cast<int>(lattice.size()) < least) return {};
  std::vector<int> best;
  int most = 0;
  for (const Eigen::Matrix2i& basis : bases()) {
    std::map<Place, int> dots;
    Eigen::Array2i low = Eigen::Array2i::Constant(1 << 20), high = -low;
    for (const auto& [place, dot] : lattice) {
      const Eigen::Vector2i turned = basis * Eigen::Vector2i(place.first, place.second);
      low = low.min(turned.array());
      high = high.max(turned.array());
      dots[{turned.x(), turned.y()}] = static_cast<int>(dot);
    }
    // Other dots may have joined the grid at its sides, but not many.
    if (high.x() - low.x() > 2 * columns || high.y() - low.y() > 2 * rows) continue;
    for (int left = low.x(); left + columns <= high.x() + 1; ++left)
      for (int top = low.y(); top + rows <= high.y() + 1; ++top) {
        std::vector<int> grid;
        std::vector<int> in_column(static_cast<std::size_t>(columns), 0),
            in_row(static_cast<std::size_t>(rows), 0);
        int seen = 0;
        for (int r = 0; r < rows; ++r)
          for (int c = 0; c < columns; ++c) {
            const auto dot = dots.find({left + c, top + r});
            const bool there = dot != dots.end();
            grid.push_back(there ? dot->second : -1);
            seen += there;
            in_column[static_cast<std::size_t>(c)] += there;
            in_row[static_cast<std::size_t>(r)] += there;
          }
        const bool pinned = 2 * std::min(in_column.front(), in_column.back()) > rows &&
                            2 * std::min(in_row.front(), in_row.back()) > columns;
        if (seen < least || seen <= most || !pinned) continue;
        most = seen;
        best = std::move(grid);
      }
  }
  return best;
}

}  // namespace

bool is_lattice(const Dots& places, int columns, int rows) {
  constexpr double kMostChange = 0.4;  // of a step, to the next
  const auto even = [&](int a, int b, int c) {
    const Eigen::Vector2d first = places[static_cast<std::size_t>(b)] - places[static_cast<std::size_t>(a)],
                          second = places[static_cast<std::size_t>(c)] - places[static_cast<std::size_t>(b)];
    return (second - first).norm() < kMostChange * std::max(first.norm(), second.norm());
  };
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c) {
      const int i = r * columns + c;
      if (c > 1 && !even(i - 2, i - 1, i)) return false;
      if (r > 1 && !even(i - 2 * columns, i - columns, i)) return false;
    }
  return true;
}

std::optional<Dots> find_dot_lattice(const Dots& dots, int columns, int rows) {
  if (static_cast<double>(dots.size()) < kLeastShare * columns * rows) return std::nullopt;
  std::vector<bool> tried(dots.size(), false);
  for (std::size_t from = 0; from < dots.size(); ++from) {
    if (tried[from]) continue;
    const auto steps = shortest_steps(dots, from);
    if (!steps) continue;
    const Lattice lattice = grown(dots, from, *steps);
    // Another dot of a lattice that holds no grid would grow the same again.
    if (2 * lattice.size() > dots.size())
      for (const auto& [place, dot] : lattice) tried[dot] = true;
    const std::vector<int> grid = grid_in(lattice, columns, rows);
    if (grid.empty()) continue;
    Dots plane, seen, all;
    for (int i = 0; i < columns * rows; ++i) {
      if (grid[static_cast<std::size_t>(i)] < 0) continue;
      plane.emplace_back(i % columns, i / columns);  // NOLINT(bugprone-integer-division)
      seen.push_back(dots[static_cast<std::size_t>(grid[static_cast<std::size_t>(i)])]);
    }
    const Eigen::Matrix3d H = homography(plane, seen);
    for (int i = 0; i < columns * rows; ++i) {
      const int dot = grid[static_cast<std::size_t>(i)];
      all.push_back(dot >= 0 ? dots[static_cast<std::size_t>(dot)]
                             : apply(H, {i % columns, i / columns}));  // NOLINT(bugprone-integer-division)
    }
    if (is_lattice(all, columns, rows)) return all;
  }
  return std::nullopt;
}

}  // namespace flash::calib
