#include "sysid/infer/adaptive_design.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>

#include "data/files/error.h"
#include "data/machine/parallel.h"
#include "sysid/emulate/motion_slice.h"
#include "sysid/infer/agreed_numbers.h"

namespace flash::sysid {
namespace {

std::array<double, 2> range_of(const Axis& axis) {
  return {coordinate_of(axis, axis.values.front()), coordinate_of(axis, axis.values.back())};
}

/// Points an axis by how many are searched: some hundreds in all, or some dozens.
int points_per_axis(const std::vector<Axis>& axes, Points points) {
  const auto searched =
      std::count_if(axes.begin(), axes.end(), [](const Axis& axis) { return axis.values.size() > 1; });
  // Points an axis of a look, by how many parameters are searched, four or more alike. Chosen: some hundreds
  // of likelihoods, or some dozens, a look. What hundreds miss on ridges is measured by `make ridge-study`.
  constexpr std::array<int, 5> kHundreds = {1, 17, 9, 7, 5}, kDozens = {1, 9, 7, 4, 3};
  return (points == Points::hundreds
              ? kHundreds
              : kDozens)[static_cast<std::size_t>(std::min<std::ptrdiff_t>(searched, 4))];
}

constexpr double kSame = 1e-9;  // Of a width. Work: rounding.
constexpr int kRounds = 12;     // Of a look. Work: a cap where the extent does not settle.
constexpr int kFewRounds = 4;   // Of a look by some dozens of points. Work: likewise.

double distance(const Axis& axis, double from, double to) {
  return axis.logarithmic ? std::log(to / from) : to - from;
}

double moved(const Axis& axis, double value, double by) {
  return axis.logarithmic ? value * std::exp(by) : value + by;
}

double cell_of(const Axis& axis) {
  return distance(axis, axis.values.front(), axis.values.back()) /
         static_cast<double>(axis.values.size() - 1);
}

}  // namespace

Extent extent_of(const std::vector<Axis>& axes) {
  Extent extent;
  for (const Axis& axis : axes) extent.push_back({axis.values.front(), axis.values.back()});
  return extent;
}

std::vector<Axis> axes_over(const Extent& extent, const std::vector<Axis>& searched, Points of_look) {
  const int points = points_per_axis(searched, of_look);
  std::vector<Axis> axes = searched;
  for (std::size_t k = 0; k < axes.size(); ++k) {
    Axis& axis = axes[k];
    if (axis.values.size() < 2) continue;
    const double first = axis.values.front(), last = axis.values.back();
    axis.values.clear();
    for (int i = 0; i < points; ++i) {
      const double from = coordinate_of(axis, extent[k][0]), to = coordinate_of(axis, extent[k][1]);
      const double x = from + (to - from) * i / (points - 1);
      axis.values.push_back(std::clamp(axis.logarithmic ? std::exp(x) : x, first, last));
    }
  }
  return axes;
}

Extent cells_about(const std::vector<double>& values, const std::vector<Axis>& axes) {
  Extent extent;
  for (std::size_t k = 0; k < axes.size(); ++k) {
    const std::vector<double>& of_axis = axes[k].values;
    const auto above = std::upper_bound(of_axis.begin(), of_axis.end(), values[k]);
    const auto below = std::lower_bound(of_axis.begin(), of_axis.end(), values[k]);
    extent.push_back({below == of_axis.begin() ? of_axis.front() : *(below - 1),
                      above == of_axis.end() ? of_axis.back() : *above});
  }
  return extent;
}

Extent next_extent(const Extent& extent, const Posterior& posterior, const std::vector<Axis>& axes,
                   Points points) {
  // Of an extent over the interval: aimed at, and at most. Chosen: the posterior fills half of what is looked
  // at; not varied.
  constexpr double kRoom = 2, kMost = 3;
  // Half an extent over the range. Work: what is told better than by this is not looked at closer.
  constexpr double kSmallest = 1e-4;
  Extent next = extent;
  bool fits = true;
  for (std::size_t k = 0; k < axes.size(); ++k) {
    if (axes[k].values.size() < 2) continue;
    const auto at = [&](double value) { return coordinate_of(axes[k], value); };
    const std::array<double, 2> range = range_of(axes[k]), now = {at(extent[k][0]), at(extent[k][1])};
    const double width = now[1] - now[0], spacing = width / (points_per_axis(axes, points) - 1);
    const double best = posterior.estimate[static_cast<Eigen::Index>(k)];
    double reach = 0;  // the larger half of the interval
    for (const std::size_t side : {0, 1}) {
      const bool open =
          posterior.ends(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(side)) < three_deviations;
      const bool more = std::abs(now[side] - range[side]) > 1e-9 * width;
      // Past an open end by a quarter of the width or more; a longer way would lose what the last extents
      // told.
      const double past = std::max(0.75 * width, std::abs(now[side] - best) + 0.25 * width);
      const double quantile = posterior.quantile(k, side == 0 ? 0.025 : 0.975);
      reach = std::max(reach, open && more ? past / kRoom : std::abs(quantile - best));
      fits = fits && !(open && more);
    }
    const double half = std::max({kRoom * reach, spacing, kSmallest * (range[1] - range[0])});
    const double low = std::max(range[0], best - half), high = std::min(range[1], best + half);
    next[k] = {axes[k].logarithmic ? std::exp(low) : low, axes[k].logarithmic ? std::exp(high) : high};
    fits = fits && width < 1.001 * kMost / kRoom * (high - low);
  }
  return fits ? extent : next;
}

std::vector<ReplayResult> motions_at(const Emulator& emulator, const std::vector<double>& values,
                                     double share) {
  std::vector<ReplayResult> motions;
  for (std::size_t r = 0; r < emulator.models.size(); ++r)
    motions.push_back(std::move(motions_of(emulator.models, share)(r, {values}).front()));
  return motions;
}

namespace {

/// The motions of all recordings at one point of a grid, worked out at the steps that are read.
class ReadMotions {
 public:
  explicit ReadMotions(const Emulator& emulator) : emulator_(&emulator) {}

  /// `slices`: with every axis held, one a recording.
  void take(const std::vector<TwoMeshSlice>& slices) {
    motions_.resize(slices.size());
    slices_ = &slices;
    for (std::size_t r = 0; r < slices.size(); ++r) {
      if (motions_[r].positions.empty()) motions_[r] = slices[r].empty();
      slices[r].forces(emulator_->share, motions_[r].forces);
    }
    made_.assign(slices.size(), {});
    for (std::size_t r = 0; r < slices.size(); ++r) made_[r].assign(motions_[r].positions.size(), false);
  }

  const Motion& at(std::size_t r, double time_offset) {
    Motion& motion = motions_[r];
    for (const Observation& observation : emulator_->models[r].replay.observations) {
      if (observation.weight <= 0) continue;
      const auto [first, last] = steps_at(motion, observation.t + time_offset);
      for (const std::size_t step : {first, last}) {
        if (made_[r][step]) continue;
        (*slices_)[r].positions(step, emulator_->share, motion.positions[step]);
        made_[r][step] = true;
      }
    }
    return motion;
  }

 private:
  const Emulator* emulator_;
  const std::vector<TwoMeshSlice>* slices_ = nullptr;
  std::vector<Motion> motions_;
  std::vector<std::vector<bool>> made_;
};

/// What is fitted at the points of a part of a grid, one after another, and what that makes likely at the
/// next: along an axis it goes on as from the last two points to the last.
class FittedNearby {
 public:
  using Fitted = std::vector<MotionLikelihood::Nuisance>;

  /// `counts`: values of each axis of the part, the last fastest.
  explicit FittedNearby(std::vector<std::size_t> counts) : counts_(std::move(counts)) {}

  /// At the next point; empty where nothing is known.
  Fitted guess() const {
    std::size_t stride = 1;
    for (std::size_t k = counts_.size(); k-- > 0; stride *= counts_[k]) {
      const std::size_t at = known_.size() / stride % counts_[k];
      if (at == 0) continue;
      const Fitted& last = known_[known_.size() - stride];
      if (at == 1) return last;
      const Fitted& before = known_[known_.size() - 2 * stride];
      Fitted next = last;
      for (std::size_t r = 0; r < next.size(); ++r) {
        next[r].registration += last[r].registration - before[r].registration;
        next[r].errors += last[r].errors - before[r].errors;
      }
      return next;
    }
    return {};
  }
  void add(Fitted fitted) { known_.push_back(std::move(fitted)); }

 private:
  std::vector<std::size_t> counts_;
  std::vector<Fitted> known_;
};

/// Slices of all recordings with one axis more held.
void hold(const std::vector<TwoMeshSlice>& from, double value, std::vector<TwoMeshSlice>& to) {
  if (to.empty()) to = std::vector<TwoMeshSlice>(from.size());
  for (std::size_t r = 0; r < from.size(); ++r) to[r].hold(from[r], value);
}

/// Values of the first two axes of the place-th piece of work, of which each first value has `seconds`: those
/// of `together` first values take turns.
std::pair<std::size_t, std::size_t> first_two(std::size_t place, std::size_t firsts, std::size_t seconds,
                                              std::size_t together) {
  const std::size_t begun = place / (together * seconds) * together,
                    under_way = std::min(together, firsts - begun), within = place - begun * seconds;
  return {begun + within % under_way, within / under_way};
}

}  // namespace

Eigen::VectorXd deviance_over(const Emulator& emulator, const std::vector<Axis>& axes,
                              const MotionLikelihood& likelihood, const GridSettings& grid,
                              const TellWork& told) {
  using Slices = std::vector<TwoMeshSlice>;
  Slices all(emulator.models.size());
  for (std::size_t r = 0; r < all.size(); ++r) all[r].take(emulator.models[r].model);
  const std::size_t points = cartesian_product(axes).size(), firsts = axes[0].values.size(),
                    others = points / firsts;
  Eigen::VectorXd deviance(static_cast<Eigen::Index>(points));
  const std::atomic<bool>* const stop = emulator.models.front().replay.settings.solver.stop;
  // Points that share their first values share the slices there. A thread takes all points of one value of
  // the first two axes; of the first, the slices are shared. Who needs a slice waits while another works it
  // out: as many first values are under way as there are threads.
  struct Shared {
    std::once_flag made;
    Slices slices;
    std::atomic<std::size_t> left = 0;  // of the second axis
  };
  const std::size_t seconds = axes.size() > 1 ? axes[1].values.size() : 1, part = others / seconds;
  const std::size_t together = std::clamp<std::size_t>(firsts, 1, std::max(grid.threads, 1));
  std::vector<Shared> shared(firsts);
  for (Shared& each : shared) each.left = seconds;
  data::for_each_in_parallel(firsts * seconds, grid.threads, [&](std::size_t place) {
    const auto [first_value, second_value] = first_two(place, firsts, seconds, together);
    Shared& each = shared[first_value];
    const double value = axes[0].values[first_value];
    std::call_once(each.made, [&] { hold(all, value, each.slices); });
    std::vector<Slices> held(axes.size());  // one an axis
    ReadMotions motions(emulator);
    std::vector<std::size_t> counts;
    for (std::size_t k = 2; k < axes.size(); ++k) counts.push_back(axes[k].values.size());
    FittedNearby nearby(counts);
    const auto visit = [&](const auto& self, const Slices& slices, std::size_t k, std::size_t first,
                           std::size_t count) -> void {
      if (k == axes.size()) {
        if (stop != nullptr && *stop) throw data::Stopped();
        motions.take(slices);
        FittedNearby::Fitted fitted = nearby.guess();
        const double here = likelihood.deviance(
            [&](std::size_t r, double time_offset) -> const Motion& { return motions.at(r, time_offset); },
            fitted);
        deviance[static_cast<Eigen::Index>(first)] = std::isnan(here) ? INFINITY : here;
        nearby.add(std::move(fitted));
        if (told) told({0, 1}, {});
        return;
      }
      const std::size_t values = axes[k].values.size(), under = count / values;
      for (std::size_t i = 0; i < values; ++i) {
        hold(slices, axes[k].values[i], held[k]);
        self(self, held[k], k + 1, first + i * under, under);
      }
    };
    if (axes.size() == 1) {
      visit(visit, each.slices, 1, first_value, 1);
    } else {
      hold(each.slices, axes[1].values[second_value], held[1]);
      visit(visit, held[1], 2, (first_value * seconds + second_value) * part, part);
    }
    if (--each.left == 0) each.slices.clear();
  });
  return deviance;
}

Eigen::VectorXd deviance_at(const Emulator& emulator, const std::vector<std::vector<double>>& points,
                            const MotionLikelihood& likelihood, const GridSettings& grid,
                            const TellWork& told) {
  constexpr std::size_t kTogether = 8;  // Points that a thread takes, in the same memory. Work.
  using Slices = std::vector<TwoMeshSlice>;
  Slices all(emulator.models.size());
  for (std::size_t r = 0; r < all.size(); ++r) all[r].take(emulator.models[r].model);
  Eigen::VectorXd deviance(static_cast<Eigen::Index>(points.size()));
  const std::atomic<bool>* const stop = emulator.models.front().replay.settings.solver.stop;
  const std::size_t parts = (points.size() + kTogether - 1) / kTogether;
  data::for_each_in_parallel(parts, grid.threads, [&](std::size_t part) {
    std::vector<Slices> held(points.front().size());  // one an axis
    ReadMotions motions(emulator);
    for (std::size_t i = part * kTogether; i < std::min((part + 1) * kTogether, points.size()); ++i) {
      if (stop != nullptr && *stop) throw data::Stopped();
      for (std::size_t k = 0; k < held.size(); ++k) hold(k == 0 ? all : held[k - 1], points[i][k], held[k]);
      motions.take(held.back());
      const double here = likelihood.deviance(
          [&](std::size_t r, double time_offset) -> const Motion& { return motions.at(r, time_offset); });
      deviance[static_cast<Eigen::Index>(i)] = std::isnan(here) ? INFINITY : here;
      if (told) told({0, 1}, {});
    }
  });
  return deviance;
}

std::vector<MotionChange> rates_at(const Emulator& emulator, const std::vector<double>& values,
                                   const Extent& extent, const std::vector<Axis>& axes) {
  // Of the extent, to both sides, for the rates of motions. Chosen: not varied.
  constexpr double kStep = 0.1;
  std::vector<Replay> replays;
  for (const ModelledReplay& model : emulator.models) replays.push_back(model.replay);
  std::vector<std::vector<double>> points;  // to both sides along each axis
  std::vector<double> factors;
  for (std::size_t k = 0; k < axes.size(); ++k) {
    if (axes[k].values.size() < 2) continue;
    const double at = coordinate_of(axes[k], values[k]), low = coordinate_of(axes[k], extent[k][0]),
                 high = coordinate_of(axes[k], extent[k][1]);
    const std::array<double, 2> range = range_of(axes[k]);
    const std::array<double, 2> ends = {std::max(range[0], at - kStep * (high - low)),
                                        std::min(range[1], at + kStep * (high - low))};
    factors.push_back((high - low) / (ends[1] - ends[0]));
    for (const double end : ends) {
      points.push_back(values);
      points.back()[k] = value_of(axes[k], end);
    }
  }
  std::vector<std::vector<ReplayResult>> at_points(points.size());  // one a recording
  for (std::size_t r = 0; r < replays.size(); ++r) {
    std::vector<ReplayResult> results = motions_of(emulator.models, emulator.share)(r, points);
    for (std::size_t i = 0; i < points.size(); ++i) at_points[i].push_back(std::move(results[i]));
  }
  std::vector<MotionChange> rates;
  for (std::size_t k = 0; k < factors.size(); ++k) {
    MotionChange& rate = rates.emplace_back();
    for (const std::size_t side : {0, 1})
      rate.push_back({side == 0 ? -factors[k] : factors[k],
                      std::make_shared<const Motions>(Motions{replays, std::move(at_points[2 * k + side])})});
  }
  return rates;
}

Look narrow(const Emulator& emulator, const Extent& start, const std::vector<double>& at,
            const std::vector<Axis>& axes, const GridSettings& grid, std::optional<double> repeatability,
            const std::vector<KnownError>& errors, const TellWork& told, Points points) {
  std::vector<Replay> replays;
  for (const ModelledReplay& model : emulator.models) replays.push_back(model.replay);
  Extent extent = start;
  std::vector<double> values = at;
  std::optional<Look> look;
  int looked = 0;
  const int rounds = points == Points::hundreds ? kRounds : kFewRounds;
  for (int round = 0; round < rounds; ++round) {
    MotionLikelihood likelihood(replays, motions_at(emulator, values, emulator.share), grid.score,
                                repeatability, errors, rates_at(emulator, values, extent, axes),
                                emulator.first);
    const std::vector<Axis> here = axes_over(extent, axes, points);
    const Eigen::VectorXd deviance = deviance_over(emulator, here, likelihood, grid, told);
    looked += static_cast<int>(deviance.size());
    look.emplace(Look{std::move(likelihood), explore_posterior(here, deviance)});
    values = look->posterior.values();
    const Extent next = next_extent(extent, look->posterior, axes, points);
    if (next == extent) break;
    extent = next;
  }
  if (told) told({}, {0, most_scores(axes, points) - looked});
  return std::move(*look);
}

int most_scores(const std::vector<Axis>& axes, Points points) {
  return (points == Points::hundreds ? kRounds : kFewRounds) *
         static_cast<int>(cartesian_product(axes_over(extent_of(axes), axes, points)).size());
}

std::vector<Axis> lattice(const Extent& extent, const std::vector<Axis>& searched, int count,
                          std::size_t at_most) {
  constexpr int kMost = 9;  // Values of a wide axis. Chosen: not varied.
  std::vector<Axis> axes = searched;
  std::size_t narrow = 1, wide = 0;
  const auto is_wide = [&](std::size_t k) {
    return distance(searched[k], extent[k][0], extent[k][1]) > cell_of(searched[k]);
  };
  for (std::size_t k = 0; k < axes.size(); ++k) {
    if (axes[k].values.size() < 2) continue;
    if (is_wide(k))
      ++wide;
    else
      narrow *= static_cast<std::size_t>(count);
  }
  int more = count;  // values of a wide axis: as many as there may be
  while (more < kMost &&
         static_cast<double>(narrow) * std::pow(more + 1, wide) <= static_cast<double>(at_most))
    ++more;
  for (std::size_t k = 0; k < axes.size(); ++k) {
    Axis& axis = axes[k];
    if (axis.values.size() < 2) continue;
    const double first = axis.values.front(), last = axis.values.back();
    const int points = is_wide(k) ? more : count;
    const auto [low, high] = extent[k];
    axis.values.clear();
    for (int i = 0; i < points; ++i) {
      const double share = static_cast<double>(i) / (points - 1);
      const double value = axis.logarithmic ? low * std::pow(high / low, share) : low + share * (high - low);
      axis.values.push_back(std::clamp(value, first, last));
    }
  }
  return axes;
}

bool is_finer(const std::vector<Axis>& lattice, const std::vector<Axis>& axes, double share) {
  for (std::size_t k = 0; k < axes.size(); ++k)
    if (axes[k].values.size() > 1 && cell_of(lattice[k]) <= share * cell_of(axes[k])) return true;
  return false;
}

bool reaches_beyond(const Extent& extent, const std::vector<Axis>& axes) {
  for (std::size_t k = 0; k < axes.size(); ++k) {
    const double first = axes[k].values.front(), last = axes[k].values.back();
    const double slack = kSame * std::abs(distance(axes[k], first, last));
    if (distance(axes[k], first, extent[k][0]) < -slack || distance(axes[k], last, extent[k][1]) > slack)
      return true;
  }
  return false;
}

Extent next_lattice(const Extent& extent, const Posterior& posterior, const std::vector<Axis>& searched) {
  // Of a lattice: a posterior that takes less of it has another. Chosen: half, as a look has it; not varied.
  constexpr double kPart = 0.5 - kSame;
  const Extent looked = extent_of(posterior.axes);
  Extent next = next_extent(looked, posterior, searched);
  bool holds = true;
  for (std::size_t k = 0; k < searched.size(); ++k) {
    const Axis& axis = searched[k];
    if (axis.values.size() < 2) continue;
    const auto [low, high] = extent[k];
    const double width = distance(axis, low, high), first = axis.values.front(), last = axis.values.back();
    const auto leaves = [&](bool upper, double looked_to, double side, double range) {
      return posterior.ends(static_cast<Eigen::Index>(k), upper ? 1 : 0) < three_deviations &&
             std::abs(distance(axis, looked_to, side)) <= kSame * width &&
             std::abs(distance(axis, side, range)) > kSame * width;
    };
    const bool below = leaves(false, looked[k][0], low, first),
               above = leaves(true, looked[k][1], high, last);
    if (below) next[k][0] = std::max(first, moved(axis, low, -width));
    if (above) next[k][1] = std::min(last, moved(axis, high, width));
    holds = holds && !below && !above && distance(axis, looked[k][0], looked[k][1]) >= kPart * width;
  }
  return holds ? extent : next;
}

}  // namespace flash::sysid
