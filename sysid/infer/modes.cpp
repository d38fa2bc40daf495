#include "sysid/infer/modes.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "data/text.h"
#include "sysid/emulate/score_interpolant.h"

namespace flash::sysid {
namespace {

using Place = std::vector<int>;  // index along each axis

Place place_of(const GridResults& results, std::size_t id) {
  Place place(results.axes.size());
  for (std::size_t k = place.size(); k-- > 0;) {
    const std::size_t count = results.axes[k].values.size();
    place[k] = static_cast<int>(id % count);
    id /= count;
  }
  return place;
}

/// One candidate between them may be above the level only because the valley passes beside it.
bool adjacent(const Place& a, const Place& b) {
  for (std::size_t k = 0; k < a.size(); ++k)
    if (std::abs(a[k] - b[k]) > 2) return false;
  return true;
}

/// Whether one of the free coordinates after the other leads from x to `end` without leaving the level.
bool path_below(const ScoreInterpolant& surface, const Eigen::VectorXd& from, const Eigen::VectorXd& end,
                const std::vector<bool>& free, double level) {
  bool any = false;
  for (std::size_t k = 0; k < free.size(); ++k) {
    if (!free[k]) continue;
    any = true;
    const auto axis = static_cast<Eigen::Index>(k);
    std::vector<bool> left = free;
    left[k] = false;
    Eigen::VectorXd x = from;
    const auto cells = static_cast<int>(surface.knots(k).size());
    const int steps = 4 * cells;
    bool below = true;
    for (int i = 1; i <= steps && below; ++i) {
      x[axis] = from[axis] + (end[axis] - from[axis]) * i / steps;
      below = surface.minimize(left, x) < level;
    }
    if (below && path_below(surface, x, end, left, level)) return true;
  }
  return !any;
}

}  // namespace

std::vector<std::size_t> separate_modes(const GridResults& results, double level) {
  std::vector<std::size_t> inside;
  for (std::size_t i = 0; i < results.candidates.size(); ++i)
    if (results.candidates[i].score < level) inside.push_back(i);
  std::stable_sort(inside.begin(), inside.end(), [&](std::size_t i, std::size_t j) {
    return results.candidates[i].score < results.candidates[j].score;
  });
  std::vector<Place> places;
  for (const std::size_t i : inside) places.push_back(place_of(results, i));
  std::vector<bool> reached(inside.size(), false);
  std::vector<std::size_t> best;
  for (std::size_t first = 0; first < inside.size(); ++first) {
    if (reached[first]) continue;
    best.push_back(inside[first]);
    reached[first] = true;
    for (std::vector<std::size_t> open = {first}; !open.empty();) {
      const std::size_t here = open.back();
      open.pop_back();
      for (std::size_t i = first + 1; i < inside.size(); ++i)
        if (!reached[i] && adjacent(places[here], places[i])) {
          reached[i] = true;
          open.push_back(i);
        }
    }
  }
  if (best.size() < 2) return best;

  const ScoreInterpolant surface(results);
  const double least = results.candidates[best.front()].score;
  const double barrier = std::sqrt(least * least + 4 * (level * level - least * least));
  std::vector<bool> searched;
  for (const Axis& axis : results.axes) searched.push_back(axis.values.size() > 1);
  std::vector<std::size_t> separate;
  for (const std::size_t i : best) {
    const Eigen::VectorXd x = surface.coordinates(results.candidates[i].values);
    const bool joined = std::any_of(separate.begin(), separate.end(), [&](std::size_t other) {
      const Eigen::VectorXd y = surface.coordinates(results.candidates[other].values);
      return path_below(surface, y, x, searched, barrier) || path_below(surface, x, y, searched, barrier);
    });
    if (!joined) separate.push_back(i);
  }
  return separate;
}

std::string warning_of_modes(const GridResults& results, double level) {
  const std::vector<std::size_t> regions = separate_modes(results, level);
  if (regions.size() < 2) return "";
  const CandidateResult &best = results.candidates[regions[0]], &other = results.candidates[regions[1]];
  std::string values;
  for (std::size_t k = 0; k < results.axes.size(); ++k)
    values += (k > 0 ? ", " : "") + results.axes[k].name + " " + data::format_short(other.values[k]);
  return "the 95 % region is in " + std::to_string(regions.size()) + " separate parts: " + values +
         " scores " + data::format_short(1000 * other.score) + " mm against " +
         data::format_short(1000 * best.score) +
         " mm: intervals cannot say which; try `flash-sysid fit --global 12`, or a recording that tells them "
         "apart";
}

}  // namespace flash::sysid
