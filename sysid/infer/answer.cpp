#include "sysid/infer/answer.h"

#include <algorithm>
#include <cmath>

#include "data/files/text.h"
#include "sysid/emulate/focused_axes.h"
#include "sysid/infer/adaptive_design.h"
#include "sysid/infer/agreed_numbers.h"
#include "sysid/infer/estimate_errors.h"
#include "sysid/infer/held.h"
#include "sysid/infer/importance_sampling.h"
#include "sysid/infer/lattice_about.h"
#include "sysid/infer/nearby.h"
#include "sysid/infer/recentre.h"
#include "sysid/infer/recordings_alone.h"
#include "sysid/infer/settle.h"
#include "sysid/infer/solution_errors.h"
#include "sysid/infer/verdict.h"
#include "sysid/infer/weight_scale.h"
#include "sysid/replay/coarse_cells.h"
#include "sysid/replay/half_cell.h"

namespace flash::sysid {
namespace {

/// By which motions that can be predicted do not part [m]. Measured: of 42 searches of a strip that stands on
/// its clamp, 21 missed by 6 to 24 mm. It tells 20 of these. Smooth ones are as they were.
constexpr double kAbrupt = 1e-3;

std::string millimetres(double distance) { return data::format_short(1e3 * distance) + " mm"; }

/// The values at which no candidate diverged: values that diverge most go first, the best candidate's stay.
std::vector<Axis> axes_without_diverged(const GridResults& results, const std::vector<double>& best) {
  std::vector<Axis> axes = results.axes;
  const auto is_left = [&](const CandidateResult& candidate) {
    for (std::size_t k = 0; k < axes.size(); ++k)
      if (std::find(axes[k].values.begin(), axes[k].values.end(), candidate.values[k]) ==
          axes[k].values.end())
        return false;
    return true;
  };
  while (true) {
    std::size_t axis = 0, most = 0;
    double value = 0;
    for (std::size_t k = 0; k < axes.size(); ++k)
      for (const double each : axes[k].values) {
        if (each == best[k]) continue;
        const auto count = static_cast<std::size_t>(
            std::count_if(results.candidates.begin(), results.candidates.end(), [&](const auto& candidate) {
              return !std::isfinite(candidate.score) && candidate.values[k] == each && is_left(candidate);
            }));
        if (count <= most) continue;
        most = count;
        axis = k;
        value = each;
      }
    if (most == 0) return axes;
    std::erase(axes[axis].values, value);
  }
}

std::vector<Replay> finer_replays(const std::vector<Replay>& replays, const AnswerSettings& settings) {
  return settings.solver_check ? on_half_the_cell(replays) : std::vector<Replay>();
}

/// Values of a first emulator at which the finer mesh is simulated: those of the best candidate alone where
/// motions about the answer follow, which have their own; else every other one.
std::vector<Axis> first_on_finer_mesh(std::vector<Axis> axes, const std::vector<Axis>& ranges,
                                      const std::vector<double>& best) {
  if (most_motions(ranges).second == 0) return thinned(axes);
  for (std::size_t k = 0; k < axes.size(); ++k) axes[k].values = {best[k]};
  return axes;
}

/// Friction, weight, a stiffness, size and pads of a clamp or two angles of a pinch, start yaw and table
/// height, and what was stated with a deviation.
std::size_t most_held(const GridSettings& grid) { return 7 + grid.deviations.size(); }

/// To both sides.
std::size_t most_held_motions(const GridSettings& grid) { return 2 * most_held(grid); }

/// The best candidate, and one nearby for each parameter.
std::size_t most_horizon_motions(const GridSettings& grid) { return 1 + grid.axes.size() + most_held(grid); }

std::vector<std::size_t> stiffnesses_of(const std::vector<Axis>& axes) {
  std::vector<std::size_t> stiffnesses;
  for (std::size_t k = 0; k < axes.size(); ++k)
    if (axes[k].values.size() > 1 && is_stiffness(axes[k].name)) stiffnesses.push_back(k);
  return stiffnesses;
}

/// Areal density, or density of a solid, that a search holds.
double weight_of(const GridSettings& grid) {
  std::vector<double> first;
  for (const Axis& axis : grid.axes) first.push_back(axis.values.front());
  const ReplayCandidate candidate = candidate_at(first, grid);
  return candidate.solid ? candidate.solid->density : candidate.material.areal_density;
}

/// The estimate as it moves on the mesh that the answer is of.
Fit fit_of(const Task& task, const Found& found, const Answer& answer) {
  Fit fit{task.replays, answer.motions, answer.estimate};
  std::vector<ReplayResult> own;
  auto motions = found.emulator.share == own_mesh
                     ? std::nullopt
                     : simulate_at(task, found.emulator, answer.values, true, own);
  if (!motions) return fit;
  fit.replays = replays_of(found.emulator);
  fit.motions = std::move(*motions);
  fit.score = score_motions(fit.replays, fit.motions, task.grid.score);
  fit.score.values = answer.values;
  return fit;
}

/// What each recording makes likeliest by itself, over all that was ever searched; nothing of a single one.
std::vector<Alone> alone_over_all(const Task& task, const Found& found, const GridResults& results) {
  if (task.replays.size() < 2) return {};
  const std::vector<Axis>& axes = task.grid.axes;
  const std::vector<std::vector<double>> at =
      best_alone(results, axes, task.replays.size(), found.look.posterior.values());
  std::vector<KnownError> errors = found.errors;
  if (found.emulator.share != own_mesh)
    errors.push_back(to_no_cells(Motions{task.replays, found.estimate.motions},
                                 *found.estimate.errors.front().terms[1].motions));
  if (reaches_beyond(extent_of(task.ranges), axes) || reaches_beyond(extent_of(axes), found.axes)) {
    // A search that went on from another has its motions about one answer alone, and so has one whose answer
    // is of other cells or another grasp.
    const std::vector<Axis> wide = lattice(extent_of(task.ranges), task.ranges, 3, few_motions(task.ranges));
    if (cartesian_product(wide).size() <= many_motions(task.ranges))
      if (const std::optional<Emulator> emulator = emulator_over(task, wide, {}, true))
        return likeliest_alone(task, *emulator, wide, at, errors);
  }
  return likeliest_alone(task, found.emulator, axes, at, errors);
}

/// Whether recordings ask for the parameters of the answer. `alone`: what each asks for by itself.
Agreement agreement_about(const Task& task, const Found& found, const Answer& answer,
                          std::vector<Alone> alone, std::vector<KnownError> held) {
  std::vector<KnownError> errors = errors_about(found, std::move(held));
  if (found.emulator.share != own_mesh)
    errors.push_back(
        to_no_cells(Motions{task.replays, answer.motions}, Motions{answer.fit.replays, answer.fit.motions}));
  refine_alone(task, alone, errors, few_motions(task.ranges));
  return agreement_of(task, alone, answer.values, errors);
}

/// What a search says once motions were simulated about its answer.
struct Concluded {
  Found found;
  Answer answer;  ///< values, motions, estimate, fit, agreement, warnings
};

Concluded conclude(const Task& task, Found found, const std::vector<double>& best,
                   std::vector<KnownError>& held, const std::vector<Alone>& alone);

/// The answer of the search's own mesh, as if nothing finer were there. What `about`, an answer of cells of
/// no size, says of errors of the mesh and of the step is by how much it may be wrong, but corrects nothing.
/// Empty where the estimate diverges.
std::optional<Concluded> conclude_on_own_mesh(const Task& task, const Found& about,
                                              const std::vector<double>& best,
                                              const std::vector<KnownError>& held,
                                              const std::vector<Alone>& alone) {
  AnswerSettings settings = task.settings;
  settings.solver_check = false;
  const std::vector<Replay> nothing_finer;
  const Task own{task.replays, nothing_finer, task.grid, task.ranges, settings, task.store, task.told};
  const std::vector<Axis>& axes = task.grid.axes;
  std::optional<Emulator> emulator = emulator_over(own, axes, {}, false);
  if (!emulator) return std::nullopt;
  if (task.told) {  // few answers need it, so most_work leaves it out
    const AnswerWork more = most_work(task.grid, 1, false);
    task.told({}, {-more.motions * static_cast<int>(task.replays.size()), -more.scores});
  }
  std::vector<KnownError> of_solution = errors_about(about, {}), errors = held;
  for (KnownError& error : of_solution) error.corrects = false;
  errors.insert(errors.end(), of_solution.begin(), of_solution.end());
  std::optional<Found> found =
      look_with(own, std::move(*emulator), axes, cells_about(best, axes), best, errors, errors);
  if (!found) return std::nullopt;
  Concluded concluded = conclude(own, std::move(*found), best, errors, alone);
  concluded.found.estimate.errors.insert(concluded.found.estimate.errors.end(), of_solution.begin(),
                                         of_solution.end());
  concluded.answer.warnings.emplace_back(
      "the mesh that was simulated explains the recordings better than cells of no size: the answer is of "
      "that mesh");
  return concluded;
}

/// `best`: the candidate from which to go on; `alone`: what each recording asks for, if there are several.
Concluded conclude(const Task& task, Found found, const std::vector<double>& best,
                   std::vector<KnownError>& held, const std::vector<Alone>& alone) {
  Found about = simulate_about(task, found, held);
  const std::string unrefined = about.unrefined;
  const Settled settled = settle(task, about, best, held);
  if (settled == Settled::by_emulator || settled == Settled::by_points) {
    found = std::move(about);
  } else {
    // Of the search's own mesh and step: what they lack is by how much the answer may be wrong.
    for (KnownError& error : held) error.corrects = false;
    if (settled == Settled::on_own_mesh)
      if (std::optional<Concluded> own = conclude_on_own_mesh(task, about, best, held, alone))
        return std::move(*own);
    keep_to_simulated(task, found, best, held);
  }
  if (task.told) task.told({.ends = 1}, {});
  Concluded concluded{std::move(found), {}};
  Answer& answer = concluded.answer;
  if (!unrefined.empty()) answer.warnings.push_back(unrefined);
  // An emulator that misses, once its points are dense about the answer, interpolates what jumps.
  answer.by_points = settled != Settled::by_emulator || missed_by_emulator(concluded.found) > kAbrupt;
  if (answer.by_points)
    answer.warnings.emplace_back(
        "the motion changes too abruptly between the values searched: the answer is by these alone, and "
        "every interval reaches to those next to the likely ones; search more values about the estimate");
  answer.values = concluded.found.look.posterior.values();
  for (const Replay& replay : task.replays)
    answer.motions.push_back(task.store.run(replay, candidate_at(answer.values, task.grid)));
  answer.estimate = score_motions(task.replays, answer.motions, task.grid.score);
  answer.estimate.values = answer.values;
  answer.fit = fit_of(task, concluded.found, answer);
  answer.grasp_size = candidate_at(answer.values, task.grid).nuisance.grasp_size;
  if (!alone.empty()) answer.agreement = agreement_about(task, concluded.found, answer, alone, held);
  return concluded;
}

/// The look at the motions that a search kept; empty where they do not tell an estimate.
std::optional<Found> first_look(const Task& task, const std::vector<double>& best,
                                std::vector<KnownError>& held) {
  const std::vector<Axis>& axes = task.grid.axes;
  std::optional<Emulator> emulator;
  if (task.settings.solver_check)
    emulator = emulator_over(task, axes, first_on_finer_mesh(axes, task.ranges, best), false);
  if (!emulator) emulator = emulator_over(task, axes, {}, false);
  if (!emulator) return std::nullopt;
  return look_with(task, std::move(*emulator), axes, cells_about(best, axes), best, {}, held);
}

/// The same without a word of errors of the solution, of cells that the answer is not of. `grid`: that of the
/// task, of which the centres change.
std::optional<Found> rough_look(const Task& task, const std::vector<double>& best, GridSettings& grid,
                                std::vector<KnownError>& held) {
  AnswerSettings settings = task.settings;
  settings.solver_check = false;
  const std::vector<Replay> nothing_finer;
  const Task rough{task.replays, nothing_finer, grid, task.ranges, settings, task.store, task.told};
  std::optional<Found> found = first_look(rough, best, held);
  if (found) found = about_told_grasp(rough, std::move(*found), grid, held);
  return found;
}

/// What the estimate of a look leaves of each recording.
std::vector<LeftResiduals> left_by(const Task& task, const Found& found,
                                   const std::vector<KnownError>& held) {
  return left_residuals(likelihood_about(task, found, task.replays, found.look.posterior.values(),
                                         found.estimate.motions, held));
}

/// Where the cells of the search are coarse for the fold in which the sheet leaves the table: motions on
/// smaller ones about a `rough` look at these, whose errors are `held`. Replays and errors of the smaller
/// ones take their place. Empty, and all as it was, where cells are not coarse, a motion diverged, or the
/// recording is of the coarse cells themselves, as one that was simulated on them.
std::optional<Found> look_on_cells_for_fold(const Task& task, const Found& rough,
                                            std::vector<Replay>& replays, std::vector<Replay>& finer,
                                            std::vector<KnownError>& held, Answer& answer) {
  const std::vector<double> values = rough.look.posterior.values();
  std::vector<Replay> smaller = on_cells_for_fold(replays, candidate_at(values, task.grid));
  if (smaller.empty()) return std::nullopt;
  std::vector<Replay> finer_there = finer_replays(smaller, task.settings);
  const Task there{smaller, finer_there, task.grid, task.ranges, task.settings, task.store, task.told};
  std::vector<KnownError> held_there;
  std::optional<Found> found =
      look_about(there, extent_of(rough.look.posterior.axes), values, true, {}, held_there);
  if (!found || excess_deviance(left_by(task, rough, held), left_by(there, *found, held_there),
                                task.settings.repeatability) > three_deviations)
    return std::nullopt;
  answer.warnings.push_back(cells_for_fold_text(replays, smaller));
  replays = std::move(smaller);
  finer = std::move(finer_there);
  held = std::move(held_there);
  return found;
}

/// Keyframes beyond the time to which a candidate can be predicted lose their weight; warnings say how many.
void keep_predictable(const std::vector<double>& best, const GridSettings& grid, const MotionStore& store,
                      GridResults& results, std::vector<Replay>& replays, Answer& answer,
                      const TellWork& told) {
  const std::vector<NearbyCandidate> nearby = nearby_candidates(best, grid, replays);
  answer.horizons = predictability_horizons(replays, candidate_at(best, grid), nearby, store);
  if (told) {
    const std::size_t motions = 1 + nearby.size();
    told({static_cast<int>(replays.size() * motions), 0},
         {static_cast<int>(replays.size() * (most_horizon_motions(grid) - motions)), 0});
  }
  std::vector<std::optional<double>> times;
  for (const std::optional<Horizon>& horizon : answer.horizons)
    times.push_back(horizon ? std::optional<double>(horizon->t) : std::nullopt);
  drop_beyond_horizons(times, results);
  for (std::size_t r = 0; r < replays.size(); ++r)
    if (const int dropped = drop_beyond_horizon(times[r], replays[r]); dropped > 0)
      answer.warnings.push_back(
          (replays.size() > 1 ? "recording " + std::to_string(r + 1) + ": " : std::string()) +
          "the motion of the best candidate cannot be predicted from " +
          data::format_short(answer.horizons[r]->t) + " s on, where a thousandth of " +
          answer.horizons[r]->parameter + " parts it: " + std::to_string(dropped) + " of " +
          std::to_string(replays[r].observations.size()) +
          " keyframes carry no weight; --no-horizon keeps them");
}

const std::vector<double>& best_values(const GridResults& results, const Answer& answer) {
  return results.candidates[static_cast<std::size_t>(answer.best)].values;
}

/// Puts what was concluded into an answer whose best candidate and horizons are known, behind its warnings.
Found take(Concluded concluded, Answer& answer) {
  concluded.answer.best = answer.best;
  concluded.answer.horizons = std::move(answer.horizons);
  concluded.answer.warnings.insert(concluded.answer.warnings.begin(), answer.warnings.begin(),
                                   answer.warnings.end());
  answer = std::move(concluded.answer);
  return std::move(concluded.found);
}

/// The answer of a search whose estimate cannot be simulated.
Answer answer_by_best(const GridResults& results, const std::vector<Replay>& replays,
                      const GridSettings& grid, const MotionStore& store, const std::vector<double>& best,
                      Answer answer) {
  answer.values = best;
  answer.estimate = results.candidates[static_cast<std::size_t>(answer.best)];
  for (const Replay& replay : replays) answer.motions.push_back(store.run(replay, candidate_at(best, grid)));
  answer.fit = {replays, answer.motions, answer.estimate};
  answer.parameters = findings_without_posterior(results, best);
  answer.warnings.emplace_back("the estimate cannot be simulated: nothing is said of any parameter");
  return answer;
}

/// Doubts of an estimate beside the candidate that came nearest.
void warn_of_estimate(const Task& task, const Found& found, const CandidateResult& nearest, Answer& answer) {
  if (answer.estimate.score > much_farther * nearest.score)
    answer.warnings.push_back("the best candidate misses the cloth by " + millimetres(nearest.score) +
                              ", the estimate by " + millimetres(answer.estimate.score) +
                              ": errors of the cells, of the step and of what is held decide between them; "
                              "search on a finer mesh, with a shorter step, or what is held too");
  warn_of_held(task, answer.values, found.look.likelihood, found.errors, answer.warnings);
  if (found.look.draws && !found.look.draws->enough)
    answer.warnings.push_back(
        "the posterior stands on " + std::to_string(std::lround(found.look.draws->effective_size)) +
        " effective draws, expected " + std::to_string(std::lround(ImportanceSettings{}.enough)) +
        ": intervals are rough; search fewer parameters or a smaller range");
}

/// What the likelihood at the fit says of each recording, and of what is not searched.
void tell_recordings(const Task& task, const Found& found, const std::vector<KnownError>& held,
                     Answer& answer) {
  const MotionLikelihood at_fit =
      likelihood_about(task, found, answer.fit.replays, answer.values, answer.fit.motions, held);
  for (std::size_t r = 0; r < task.replays.size(); ++r) {
    answer.misfits.push_back(at_fit.of_recording(r).misfit());
    answer.clocks.push_back({at_fit.registration(r)[4], at_fit.registration_spread(r)[4]});
  }
  answer.contradicted = contradicted_stiffnesses(task, answer.values, at_fit, errors_about(found, held));
  answer.residuals = left_residuals(at_fit);
  answer.open_information =
      open_information(at_fit, spreads_over(task.ranges, extent_of(found.look.posterior.axes)));
}

/// Findings, covariance and draws. `grid`: as it was typed.
void tell_parameters(const Task& task, const Found& found, const GridResults& results,
                     const GridSettings& grid, Answer& answer) {
  Posterior posterior = found.look.posterior;
  if (answer.by_points) posterior = up_to_neighbours(std::move(posterior), task.ranges);
  if (const double spread = spread_of_scale(task.grid, task.replays); spread > 0)
    answer.weights = weight_of(grid) *
                     scale_together(posterior, stiffnesses_of(posterior.axes), spread, task.ranges).array();
  answer.parameters = findings_of(results, task.ranges, posterior, grid.base);
  answer.covariance_log = covariance_of_logarithms(posterior);
  answer.samples = samples_of(posterior);
}

}  // namespace

AnswerWork most_design_work(const GridSettings& grid, std::size_t recordings) {
  const std::size_t motions = lattice_rounds * (2 * few_motions(grid.axes) + motions_at_estimate) +
                              motions_of_solution + most_held_motions(grid);
  return {static_cast<int>(recordings * motions), 2 * lattice_rounds * most_scores(grid.axes)};
}

std::vector<Axis> design_about(const std::vector<Replay>& replays, const GridSettings& grid,
                               const std::vector<double>& start, const Extent& around,
                               const AnswerSettings& settings, const TellWork& told) {
  const MotionStore store(grid.rollouts, grid.shard);
  const std::vector<Replay> finer = finer_replays(replays, settings);
  const Task task{replays, finer, grid, grid.axes, settings, store, told};
  Extent extent = around;
  std::vector<double> at = start;
  std::vector<KnownError> held;
  for (int round = 0; round < lattice_rounds; ++round) {
    std::optional<Found> found;
    if (settings.solver_check) found = look_about(task, extent, at, true, {}, held);
    if (!found) found = look_about(task, extent, at, false, {}, held);
    if (!found) break;
    at = found->look.posterior.values();
    const Extent next = next_lattice(extent, found->look.posterior, grid.axes);
    if (next == extent) break;
    extent = next;
  }
  return lattice(extent, grid.axes, 3, few_motions(grid.axes));
}

AnswerWork most_work(const GridSettings& grid, std::size_t recordings, bool solver_check) {
  const auto [own, finer] = most_motions(grid.axes);
  std::size_t motions = motions_at_estimate + motions_of_solution + most_held_motions(grid) +
                        most_horizon_motions(grid) +
                        most_motions_alone(recordings, 2 * many_motions(grid.axes)) +
                        lattice_rounds * (own + motions_at_estimate + (solver_check ? finer : 0));
  if (solver_check) motions += own > 0 ? 1 : cartesian_product(thinned(most_focused(grid.axes))).size();
  const int alone = recordings > 1 ? 2 * static_cast<int>(recordings) : 0,
            looks = 2 * (own > 0 ? 1 + lattice_rounds : 1);
  return {static_cast<int>(recordings * motions),
          looks * most_scores(grid.axes) + alone * most_scores(grid.axes, Points::dozens)};
}

Answer find_answer(GridResults& results, std::vector<Replay>& replays, const GridSettings& grid,
                   const AnswerSettings& settings, const TellWork& told) {
  Answer answer;
  answer.horizons.resize(replays.size());
  answer.best = best_of(results);
  if (answer.best < 0) return answer;
  const MotionStore store(grid.rollouts, grid.shard);
  if (settings.horizon) {
    keep_predictable(best_values(results, answer), grid, store, results, replays, answer, told);
    answer.best = best_of(results);
  } else if (told) {
    told({}, {static_cast<int>(replays.size() * most_horizon_motions(grid)), 0});
  }
  const std::vector<double> best = best_values(results, answer);
  GridSettings usable = grid;
  usable.axes = in_own_coordinates(axes_without_diverged(results, best));
  if (cartesian_product(usable.axes).size() < results.candidates.size())
    answer.warnings.emplace_back(
        "some candidates diverged: the answer leaves out the values of a parameter at which they did");
  const std::vector<Axis> ranges =
      settings.ranges.empty() ? usable.axes : in_own_coordinates(settings.ranges);
  usable.axes = focused(usable.axes, best);
  std::vector<Replay> finer = finer_replays(replays, settings);
  const Task task{replays, finer, usable, ranges, settings, store, told};
  std::vector<KnownError> held;
  bool tried = !settings.solver_check;
  const auto look_on_smaller_cells = [&](const std::vector<double>& values) -> std::optional<Found> {
    if (tried || on_cells_for_fold(replays, candidate_at(values, usable)).empty()) return std::nullopt;
    tried = true;
    std::vector<KnownError> errors;
    const std::vector<Axis> centres = usable.centres;
    std::optional<Found> there;
    if (const std::optional<Found> rough = rough_look(task, best, usable, errors))
      there = look_on_cells_for_fold(task, *rough, replays, finer, errors, answer);
    if (there)
      held = std::move(errors);
    else
      usable.centres = centres;
    return there;
  };
  std::optional<Found> found = look_on_smaller_cells(best);
  if (!found) found = first_look(task, best, held);
  if (!found) return answer_by_best(results, replays, grid, store, best, std::move(answer));
  found = about_told_grasp(task, std::move(*found), usable, held);
  if (std::optional<Found> there = look_on_smaller_cells(found->look.posterior.values()))
    found = about_told_grasp(task, std::move(*there), usable, held);
  const std::vector<Alone> alone = alone_over_all(task, *found, results);
  const Found there = take(conclude(task, std::move(*found), best, held, alone), answer);
  warn_of_estimate(task, there, results.candidates[static_cast<std::size_t>(answer.best)], answer);
  tell_parameters(task, there, results, grid, answer);
  tell_recordings(task, there, held, answer);
  warn_of_cells(task, answer.values, held, answer.warnings);
  if (settings.solver_check) answer.checks = checks_of(task, there);
  if (answer.agreement)
    if (const std::string text = better_text(*answer.agreement, usable.axes); !text.empty())
      answer.warnings.push_back(text);
  return answer;
}

}  // namespace flash::sysid
