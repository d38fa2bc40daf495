#include "sysid/infer/lattice_about.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <string>

#include "data/machine/parallel.h"
#include "sysid/infer/sampled_look.h"
#include "sysid/infer/solution_errors.h"
#include "sysid/observe/motion_distance.h"

namespace flash::sysid {

namespace {

std::size_t searched_of(const std::vector<Axis>& axes) {
  return static_cast<std::size_t>(
      std::count_if(axes.begin(), axes.end(), [](const Axis& axis) { return axis.values.size() > 1; }));
}

/// Parameters about whose estimate a lattice is simulated. Chosen: by the cost, 81 motions of four and 243 of
/// five. Of five a warning says so.
constexpr std::size_t kMostRefined = 4;
/// Parameters whose posterior is by grids. Measured: on ridges of two or three, quantiles by grids are off by
/// 0.2 to 2.6 standard deviations (`make ridge-study`, docs/theory.md).
constexpr std::size_t kMostOnGrids = 2;

bool is_sampled(PosteriorMethod method, const std::vector<Axis>& axes) {
  return method == PosteriorMethod::by_count ? searched_of(axes) > kMostOnGrids
                                             : method == PosteriorMethod::sampling;
}

}  // namespace

std::size_t few_motions(const std::vector<Axis>& axes) { return searched_of(axes) == kMostRefined ? 81 : 30; }

std::size_t many_motions(const std::vector<Axis>& axes) {
  return searched_of(axes) == kMostRefined ? 256 : 100;
}

std::optional<Emulator> emulator_over(const Task& task, const std::vector<Axis>& axes,
                                      const std::vector<Axis>& finer, bool told_own) {
  Emulator emulator{{}, finer.empty() ? own_mesh : no_cells, 0, finer};
  GridSettings grid = task.grid;
  grid.axes = axes;
  const std::function<void()> motion = [&] { task.tell_motion(); };
  if (!finer.empty() && task.finer.empty()) return std::nullopt;
  for (std::size_t r = 0; r < task.replays.size(); ++r) {
    const Replay& replay = task.replays[r];
    const auto motions =
        motion_interpolant(replay, grid, task.store, told_own ? motion : std::function<void()>());
    if (!motions) return std::nullopt;
    auto model = finer.empty()
                     ? ModelledReplay{replay, TwoMeshMotions(*motions)}
                     : with_finer_mesh(replay, task.finer[r], *motions, finer, grid, task.store, motion);
    if (!model) return std::nullopt;
    emulator.models.push_back(std::move(*model));
  }
  return emulator;
}

std::optional<Found> look_with(const Task& task, Emulator emulator, const std::vector<Axis>& axes,
                               const Extent& extent, const std::vector<double>& at,
                               std::vector<KnownError> errors, std::vector<KnownError>& held,
                               const std::optional<WeightedDraws>& before) {
  const auto look = [&](const Extent& start, const std::vector<double>& values,
                        const std::optional<WeightedDraws>& draws) {
    if (is_sampled(task.settings.posterior, task.ranges))
      return sampled_look(emulator, start, values, axes, task.grid, task.settings.repeatability, errors,
                          task.told, draws ? &*draws : nullptr);
    return narrow(emulator, start, values, axes, task.grid, task.settings.repeatability, errors, task.told);
  };
  const Look first = look(extent, at, before);
  std::vector<FinerSettings> finer;
  if (task.settings.solver_check) finer = finer_settings(task.replays);
  const bool knows_solution = std::any_of(held.begin(), held.end(), is_of_solution),
             knows_held = !std::all_of(held.begin(), held.end(), is_of_solution);
  simulate_ahead(task, emulator, first.posterior, finer, !knows_held, !knows_solution);
  std::optional<Estimate> estimate = solve_at(task, emulator, first.posterior.values(), std::move(finer));
  if (!estimate) return std::nullopt;
  const auto add_to_held = [&](std::vector<KnownError> more) {
    std::move(more.begin(), more.end(), std::back_inserter(held));
  };
  if (!knows_held) add_to_held(errors_of_held(task, first.posterior.values(), estimate->motions));
  if (!knows_solution) {
    add_to_held(errors_of_step(task, first.posterior.values()));
    add_to_held(errors_of_cells(task, emulator, first.posterior.values(), estimate->motions));
  }
  const std::vector<KnownError> at_draws = errors_at_draws(task, emulator, *estimate, first.posterior);
  const auto take_all = [&] {
    errors = estimate->errors;
    for (const std::vector<KnownError>* more : {&std::as_const(held), &at_draws})
      errors.insert(errors.end(), more->begin(), more->end());
  };
  take_all();
  Look second = look(extent_of(first.posterior.axes), first.posterior.values(), first.draws);
  if (const std::vector<double> values = second.posterior.values();
      has_left_cells(second.posterior, held) && follow_with_cells(task, values, held)) {
    take_all();
    second = look(extent_of(second.posterior.axes), values, second.draws);
  }
  return Found{std::move(emulator), axes, std::move(second), std::move(*estimate), std::move(errors)};
}

std::pair<std::size_t, std::size_t> most_motions(const std::vector<Axis>& axes) {
  std::size_t fewest = 1, own = 1, finer = 1;
  const std::vector<Axis> thin = thinned(axes);
  for (std::size_t k = 0; k < axes.size(); ++k) {
    const std::size_t count = axes[k].values.size();
    if (count < 2) continue;
    fewest *= std::min<std::size_t>(count, 3);
    own *= std::max<std::size_t>(count, 4);
    finer *= std::max<std::size_t>(thin[k].values.size(), 2);
  }
  if (fewest > few_motions(axes)) return {0, 0};
  return {std::min(own, many_motions(axes)), std::min(finer, many_motions(axes))};
}

std::optional<Found> look_about(const Task& task, const Extent& extent, const std::vector<double>& at,
                                bool finer, const std::vector<KnownError>& errors,
                                std::vector<KnownError>& held, bool many,
                                const std::optional<WeightedDraws>& before) {
  const std::size_t most = many ? many_motions(task.ranges) : few_motions(task.ranges);
  const std::vector<Axis> axes = lattice(extent, task.ranges, many ? 4 : 3, most);
  if (cartesian_product(axes).size() > most) return std::nullopt;
  if (task.told) task.told({.lattices = 1}, {});
  std::optional<Emulator> emulator = emulator_over(
      task, axes, finer ? thinned(lattice(extent, task.ranges, 2, most / 3)) : std::vector<Axis>{}, true);
  if (!emulator) return std::nullopt;
  return look_with(task, std::move(*emulator), axes, extent, at, errors, held, before);
}

std::vector<KnownError> errors_about(const Found& found, std::vector<KnownError> more) {
  more.insert(more.end(), found.estimate.errors.begin() + 1, found.estimate.errors.end());
  return more;
}

MotionLikelihood likelihood_about(const Task& task, const Found& found, const std::vector<Replay>& replays,
                                  const std::vector<double>& values,
                                  const std::vector<ReplayResult>& reference, std::vector<KnownError> more) {
  return {replays,
          reference,
          task.grid.score,
          task.settings.repeatability,
          errors_about(found, std::move(more)),
          rates_at(found.emulator, values, extent_of(found.look.posterior.axes), found.axes)};
}

namespace {

/// How far an error of the estimate moves the surface, and the parameters if they had to explain it.
SolverCheck check_of(const KnownError& error, const Sensitivity& sensitivity, const std::vector<Axis>& axes) {
  const Motions &from = *error.terms[0].motions, &to = *error.terms[1].motions;
  return compare_solutions(error.name, sensitivity, from.replays, from.results, to.replays, to.results, axes);
}

/// How motions change with the parameters at the estimate, by the emulator.
Sensitivity sensitivity_of(const Task& task, const Found& found) {
  GridSettings grid = task.grid;
  grid.axes = found.look.posterior.axes;
  return measure_sensitivity(replays_of(found.emulator), grid, found.look.posterior.values(), true,
                             motions_of(found.emulator.models, found.emulator.share));
}

/// Whether what the emulator misses, at the estimate or at the draws at which it was tried, would move a
/// parameter by much of what it is known to.
bool misses_much(const Task& task, const Found& found) {
  // Of a standard deviation: where what the emulator misses moves a parameter by more, a lattice has more
  // motions. Chosen: not varied by itself. With the lattices that follow, interval scores of strips fell from
  // 0.248, 1.98 and 1.25 to 0.236, 1.94 and 1.18 (docs/validation/known_truth.md).
  constexpr double kMuch = 0.5;
  const Posterior& posterior = found.look.posterior;
  const Sensitivity sensitivity = sensitivity_of(task, found);
  std::vector<const KnownError*> errors = {&found.estimate.errors.front()};
  for (const KnownError& error : found.errors)
    if (error.name.empty()) errors.push_back(&error);
  const std::size_t of_emulator = errors.size();
  for (const KnownError& error : found.estimate.errors)
    if (error.name == "half_step") errors.push_back(&error);
  std::vector<std::map<std::string, double>> shifts(errors.size());
  data::for_each_in_parallel(errors.size(), task.grid.threads, [&](std::size_t e) {
    const Motions &from = *errors[e]->terms[0].motions, &to = *errors[e]->terms[1].motions;
    shifts[e] =
        shift_between(sensitivity, from.replays, from.results, to.replays, to.results, posterior.axes);
  });
  for (std::size_t k = 0; k < posterior.axes.size(); ++k) {
    if (posterior.axes[k].values.size() < 2) continue;
    const std::string& name = posterior.axes[k].name;
    const Eigen::VectorXd draws = posterior.samples.col(static_cast<Eigen::Index>(k));
    const double much = kMuch * std::sqrt((draws.array() - draws.mean()).square().mean());
    double sum = 0;
    // Draws take half the step, where that is an error of its own.
    const double half_step = shifts.size() > of_emulator ? shifts.back().at(name) : 0;
    for (std::size_t e = 1; e < of_emulator; ++e) sum += std::pow(shifts[e].at(name) - half_step, 2);
    if (std::abs(shifts.front().at(name)) > much || sum > much * much * static_cast<double>(of_emulator - 1))
      return true;
  }
  return false;
}

Extent both(Extent a, const Extent& b) {
  for (std::size_t k = 0; k < a.size(); ++k) a[k] = {std::min(a[k][0], b[k][0]), std::max(a[k][1], b[k][1])};
  return a;
}

}  // namespace

Found simulate_about(const Task& task, Found found, std::vector<KnownError>& held) {
  const bool finer = found.emulator.share != own_mesh;
  Extent extent = next_lattice(extent_of(found.axes), found.look.posterior, task.ranges);
  if (!reaches_beyond(extent, found.axes) && !reaches_beyond(extent, found.emulator.finer) &&
      !is_finer(lattice(extent, task.ranges, 3, few_motions(task.ranges)), found.axes) &&
      !misses_much(task, found))
    return found;
  if (const std::size_t searched = searched_of(task.ranges); searched > kMostRefined) {
    found.unrefined = std::to_string(searched) +
                      " parameters are searched together: none is simulated about the answer, which is "
                      "interpolated between the values searched, and may be off by more than its intervals "
                      "say. Search at most " +
                      std::to_string(kMostRefined) + " (--hold the others), or more values of each";
    return found;
  }
  constexpr int kDense = 3;          // Lattices of many motions. Chosen: by what they cost; not varied.
  constexpr double kNarrower = 0.8;  // Cells over cells, for a lattice more. Chosen: not varied.
  // Rounds; later a lattice does not narrow again, or two might follow each other. Chosen: after strips on
  // which two did; not varied.
  constexpr int kSettling = 3;
  bool many = false, likely_alone = false;
  int dense = 0;
  for (int round = 0; round < lattice_rounds && dense < kDense; ++round) {
    if (many) ++dense;
    std::optional<Found> there = look_about(task, extent, found.look.posterior.values(), finer, found.errors,
                                            held, many, found.look.draws);
    if (!there) {
      found.unrefined =
          "a motion nearer to the answer diverged: the answer is interpolated between those farther away";
      break;
    }
    found = std::move(*there);
    Extent next = next_lattice(extent, found.look.posterior, task.ranges);
    if (next == extent) {
      if (likely_alone || !misses_much(task, found)) break;
      likely_alone = many;
      many = true;
      if (likely_alone) {
        next = extent_of(found.look.posterior.axes);
        if (!is_finer(lattice(next, task.ranges, 4, many_motions(task.ranges)), found.axes, kNarrower)) break;
      }
    } else if (round >= kSettling) {
      many = true;
      next = both(extent, next);
    }
    extent = std::move(next);
  }
  return found;
}

double missed_by_emulator(const Found& found) {
  const auto apart = [](const KnownError& error) {
    const Motions &from = *error.terms[0].motions, &to = *error.terms[1].motions;
    return mean_motion_distance(from.replays, from.results, to.results);
  };
  double half_step = 0, most = 0;
  for (const KnownError& error : found.estimate.errors) {
    if (error.name == "half_step") half_step = apart(error);
    if (error.name == "estimate_itself") most = apart(error);
  }
  for (const KnownError& error : found.errors)
    if (error.name.empty()) most = std::max(most, apart(error) - half_step);
  return most;
}

std::vector<SolverCheck> checks_of(const Task& task, const Found& found) {
  const Sensitivity sensitivity = sensitivity_of(task, found);
  std::vector<SolverCheck> checks;
  for (const KnownError& error : found.estimate.errors)
    checks.push_back(check_of(error, sensitivity, found.look.posterior.axes));
  for (const KnownError& error : found.errors)
    if (error.name == half_sheet_cells || error.name == quarter_sheet_cells || error.name == quarter_step)
      checks.push_back(check_of(error, sensitivity, found.look.posterior.axes));
  return checks;
}

}  // namespace flash::sysid
