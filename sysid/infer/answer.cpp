#include "sysid/infer/answer.h"

#include <algorithm>
#include <cmath>

#include "data/text.h"
#include "sysid/emulate/focused_axes.h"
#include "sysid/infer/adaptive_design.h"
#include "sysid/infer/estimate_errors.h"
#include "sysid/infer/held.h"
#include "sysid/infer/recordings_alone.h"
#include "sysid/infer/verdict.h"
#include "sysid/infer/weight_scale.h"
#include "sysid/observe/horizon.h"
#include "sysid/replay/half_cell.h"

namespace flash::sysid {
namespace {

constexpr int kRounds = 8;          // of motions about an answer
constexpr std::size_t kFew = 30;    // of them in a round
constexpr std::size_t kMany = 100;  // where the emulator by few misses too much

int best_of(const GridResults& results) {
  int best = -1;
  for (std::size_t i = 0; i < results.candidates.size(); ++i)
    if (std::isfinite(results.candidates[i].score) &&
        (best < 0 || results.candidates[i].score < results.candidates[static_cast<std::size_t>(best)].score))
      best = static_cast<int>(i);
  return best;
}

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

/// The motions at every point of `axes`; with `finer` axes (none: empty) those of a finer mesh at theirs.
/// Empty where one diverged or there is no finer mesh.
std::optional<Emulator> emulator_over(const Task& task, const std::vector<Axis>& axes,
                                      const std::vector<Axis>& finer, bool told_own) {
  Emulator emulator{{}, finer.empty() ? own_mesh : no_cells};
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

/// An emulator, and the posterior by it.
struct Found {
  Emulator emulator;
  std::vector<Axis> axes;  ///< of it: at their values it is exact
  Look look;
  Estimate estimate;
  std::vector<KnownError> errors;  ///< all that the look knows
};

/// Looks twice: for the estimate, and again with what solving it says of errors. `held`: errors by what is
/// held, found at the first estimate.
std::optional<Found> look_with(const Task& task, Emulator emulator, const std::vector<Axis>& axes,
                               const Extent& extent, const std::vector<double>& at,
                               std::vector<KnownError> errors, std::vector<KnownError>& held) {
  const auto look = [&](const Extent& start, const std::vector<double>& values) {
    return narrow(emulator, start, values, axes, task.grid, task.settings.repeatability, errors, task.told);
  };
  const Look first = look(extent, at);
  std::optional<Estimate> estimate = solve_at(task, emulator, first.posterior.values());
  if (!estimate) return std::nullopt;
  if (held.empty()) held = errors_of_held(task, first.posterior.values(), estimate->motions);
  errors = estimate->errors;
  errors.insert(errors.end(), held.begin(), held.end());
  for (KnownError& error : errors_at_draws(task, emulator, *estimate, first.posterior))
    errors.push_back(std::move(error));
  Look second = look(extent_of(first.posterior.axes), first.posterior.values());
  return Found{std::move(emulator), axes, std::move(second), std::move(*estimate), std::move(errors)};
}

/// Simulations of one recording in a round about the answer, on the own mesh and on the finer one, at most;
/// none where they would be too many.
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
  if (fewest > kFew) return {0, 0};
  return {std::min(own, kMany), std::min(finer, kMany)};
}

/// One lattice over an extent, of few values or of many, and what its motions say; empty where too many would
/// be needed, or one diverged.
std::optional<Found> look_about(const Task& task, const Extent& extent, const std::vector<double>& at,
                                bool finer, const std::vector<KnownError>& errors,
                                std::vector<KnownError>& held, bool many = false) {
  const std::size_t most = many ? kMany : kFew;
  const std::vector<Axis> axes = lattice(extent, task.ranges, many ? 4 : 3, most);
  if (cartesian_product(axes).size() > most) return std::nullopt;
  std::optional<Emulator> emulator = emulator_over(
      task, axes, finer ? thinned(lattice(extent, task.ranges, 2, most / 3)) : std::vector<Axis>{}, true);
  if (!emulator) return std::nullopt;
  return look_with(task, std::move(*emulator), axes, extent, at, errors, held);
}

/// All errors that are known but those of the emulator, and `more`.
std::vector<KnownError> errors_about(const Found& found, std::vector<KnownError> more) {
  more.insert(more.end(), found.estimate.errors.begin() + 1, found.estimate.errors.end());
  return more;
}

/// The likelihood of motions on the mesh of `replays`, with all errors that are known but those of the
/// emulator and `more`.
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

void set_estimate(Posterior& posterior, const std::vector<Axis>& axes, const std::vector<double>& values) {
  for (std::size_t k = 0; k < values.size(); ++k)
    posterior.estimate[static_cast<Eigen::Index>(k)] = coordinate_of(axes[k], values[k]);
}

std::vector<Motion> motions_in(const std::vector<ReplayResult>& results) {
  std::vector<Motion> motions;
  for (const ReplayResult& result : results) motions.push_back(result.motion);
  return motions;
}

/// Friction, weight, two angles of a pinch, start yaw and table height, and what was stated with a deviation,
/// to both sides.
std::size_t most_held_motions(const GridSettings& grid) { return 2 * (6 + grid.deviations.size()); }

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

enum class Settled { by_emulator, by_points, elsewhere };

/// The estimate becomes the likeliest of what was simulated: the mode of the posterior, or a point of the
/// emulator's grid. Where folds fall another way between two simulations such a point is likelier than the
/// mode. The posterior is a mixture: what the mode turned out to be likely, over the likeliest, is the share
/// of the emulator, and each point speaks for the rest (explore_at_points). A share, since a likelihood of
/// motions that change abruptly differs by chance from point to point: whatever were chosen by it would be as
/// much by chance. Elsewhere: the `best` of the search, beyond the emulator's grid, is likelier than all.
Settled settle(const Task& task, Found& found, const std::vector<double>& best,
               const std::vector<KnownError>& held) {
  constexpr double kMatters = 1;  // of a deviance
  const std::vector<Replay> on_model = replays_of(found.emulator);
  const std::vector<double> mode = found.look.posterior.values();
  std::vector<ReplayResult> own;
  auto simulated = simulate_at(task, found.emulator, mode, false, own);
  if (!simulated) return Settled::elsewhere;
  MotionLikelihood likelihood = likelihood_about(
      task, found, on_model, mode, motions_at(found.emulator, mode, found.emulator.share), held);
  const Eigen::VectorXd of_points = deviance_over(found.emulator, found.axes, likelihood, task.grid);
  const double fall = std::max(0.0, likelihood.deviance(motions_in(*simulated)) - of_points.minCoeff());

  // Where the search's best is beyond the emulator's grid, both are moved alike to cells of no size.
  std::vector<KnownError> errors = held;
  errors.push_back({{{-1, std::make_shared<const Motions>(Motions{task.replays, own})},
                     {1, std::make_shared<const Motions>(Motions{on_model, std::move(*simulated)})}},
                    true,
                    true});
  const MotionLikelihood on_own = likelihood_about(task, found, task.replays, mode, own, std::move(errors));
  std::vector<Motion> of_best;
  for (const Replay& replay : task.replays)
    of_best.push_back(task.store.run(replay, candidate_at(best, task.grid)).motion);
  const double fall_to_best = on_own.deviance(motions_in(own)) - on_own.deviance(of_best);
  Extent at_best;
  for (const double value : best) at_best.push_back({value, value});
  if (fall_to_best > fall + kMatters && reaches_beyond(at_best, found.axes)) return Settled::elsewhere;
  const double share_of_points = 1 - std::exp(-0.5 * std::max(fall, fall_to_best));
  if (!(share_of_points > 0)) return Settled::by_emulator;
  Posterior by_points = explore_at_points(found.axes, of_points);
  if (!(fall > 0)) set_estimate(by_points, found.axes, mode);
  found.look.posterior = mixture(found.look.posterior, std::move(by_points), share_of_points);
  if (share_of_points < 0.5) return Settled::by_emulator;
  found.look.likelihood = std::move(likelihood);
  found.errors = errors_about(found, held);
  return Settled::by_points;
}

/// The posterior by what was simulated alone, on the search's own mesh (explore_at_points). No motion is
/// corrected by what was seen at another.
void keep_to_simulated(const Task& task, Found& found, const std::vector<double>& best,
                       const std::vector<KnownError>& held) {
  found.emulator.share = own_mesh;
  for (KnownError& error : found.estimate.errors) error.corrects = false;
  found.errors = errors_about(found, held);
  found.look.likelihood = likelihood_about(task, found, replays_of(found.emulator), best,
                                           motions_at(found.emulator, best, own_mesh), held);
  found.look.posterior = explore_at_points(
      found.axes, deviance_over(found.emulator, found.axes, found.look.likelihood, task.grid));
}

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

/// Whether what the emulator misses at the estimate would move a parameter by much of what it is known to.
bool misses_much(const Task& task, const Found& found) {
  constexpr double kMuch = 0.5;  // of a standard deviation
  const Posterior& posterior = found.look.posterior;
  const SolverCheck check =
      check_of(found.estimate.errors.front(), sensitivity_of(task, found), posterior.axes);
  for (std::size_t k = 0; k < posterior.axes.size(); ++k) {
    const Eigen::VectorXd draws = posterior.samples.col(static_cast<Eigen::Index>(k));
    const double spread = std::sqrt((draws.array() - draws.mean()).square().mean());
    if (posterior.axes[k].values.size() > 1 &&
        std::abs(check.shift.at(posterior.axes[k].name)) > kMuch * spread)
      return true;
  }
  return false;
}

/// Motions simulated anew about the answer, where few simulations do: again while it leaves them or takes too
/// little of them, and with more of them where the emulator misses much.
Found simulate_about(const Task& task, Found found, std::vector<KnownError>& held) {
  const bool finer = found.emulator.share != own_mesh;
  Extent extent = next_lattice(extent_of(found.axes), found.look.posterior, task.ranges);
  if (!reaches_beyond(extent, found.axes) && !is_finer(lattice(extent, task.ranges, 3, kFew), found.axes))
    return found;
  bool many = false;
  for (int round = 0; round < kRounds; ++round) {
    std::optional<Found> there =
        look_about(task, extent, found.look.posterior.values(), finer, found.errors, held, many);
    if (!there) break;
    found = std::move(*there);
    const Extent next = next_lattice(extent, found.look.posterior, task.ranges);
    if (next == extent && (many || !misses_much(task, found))) break;
    many = many || next == extent;
    extent = next;
  }
  return found;
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
  if (reaches_beyond(extent_of(task.ranges), axes)) {
    // A search that went on from another has its motions about one answer alone.
    const std::vector<Axis> wide = lattice(extent_of(task.ranges), task.ranges, 3, kFew);
    if (cartesian_product(wide).size() <= kMany)
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
  refine_alone(task, alone, errors, kFew);
  return agreement_of(task, alone, answer.values, errors);
}

/// What a search says once motions were simulated about its answer.
struct Concluded {
  Found found;
  Answer answer;  ///< values, motions, estimate, fit, agreement, warnings
};

/// `best`: the candidate from which to go on; `alone`: what each recording asks for, if there are several.
Concluded conclude(const Task& task, Found found, const std::vector<double>& best,
                   std::vector<KnownError>& held, const std::vector<Alone>& alone) {
  Found about = simulate_about(task, found, held);
  const Settled settled = settle(task, about, best, held);
  if (settled == Settled::elsewhere)
    keep_to_simulated(task, found, best, held);
  else
    found = std::move(about);
  Concluded concluded{std::move(found), {}};
  Answer& answer = concluded.answer;
  if (settled != Settled::by_emulator)
    answer.warnings.emplace_back(
        "the motion changes too abruptly between the values searched: the answer is by these alone; search "
        "more values");
  answer.values = concluded.found.look.posterior.values();
  for (const Replay& replay : task.replays)
    answer.motions.push_back(task.store.run(replay, candidate_at(answer.values, task.grid)));
  answer.estimate = score_motions(task.replays, answer.motions, task.grid.score);
  answer.estimate.values = answer.values;
  answer.fit = fit_of(task, concluded.found, answer);
  if (!alone.empty()) answer.agreement = agreement_about(task, concluded.found, answer, alone, held);
  return concluded;
}

std::vector<SolverCheck> checks_of(const Task& task, const Found& found) {
  const Sensitivity sensitivity = sensitivity_of(task, found);
  std::vector<SolverCheck> checks;
  for (const KnownError& error : found.estimate.errors)
    checks.push_back(check_of(error, sensitivity, found.look.posterior.axes));
  return checks;
}

}  // namespace

AnswerWork most_design_work(const GridSettings& grid, std::size_t recordings) {
  const std::size_t motions = kRounds * (2 * kFew + motions_at_estimate) + most_held_motions(grid);
  return {static_cast<int>(recordings * motions), 2 * kRounds * most_scores(grid.axes)};
}

std::vector<Axis> design_about(const std::vector<Replay>& replays, const GridSettings& grid,
                               const std::vector<double>& start, const Extent& around,
                               const AnswerSettings& settings, const TellWork& told) {
  const MotionStore store(grid.rollouts);
  const std::vector<Replay> finer = finer_replays(replays, settings);
  const Task task{replays, finer, grid, grid.axes, settings, store, told};
  Extent extent = around;
  std::vector<double> at = start;
  std::vector<KnownError> held;
  for (int round = 0; round < kRounds; ++round) {
    std::optional<Found> found;
    if (settings.solver_check) found = look_about(task, extent, at, true, {}, held);
    if (!found) found = look_about(task, extent, at, false, {}, held);
    if (!found) break;
    at = found->look.posterior.values();
    const Extent next = next_lattice(extent, found->look.posterior, grid.axes);
    if (next == extent) break;
    extent = next;
  }
  return lattice(extent, grid.axes, 3, kFew);
}

AnswerWork most_work(const GridSettings& grid, std::size_t recordings, bool solver_check) {
  const auto [own, finer] = most_motions(grid.axes);
  std::size_t motions = motions_at_estimate + 4 + most_held_motions(grid) +
                        most_motions_alone(recordings, 2 * kMany) +
                        kRounds * (own + motions_at_estimate + (solver_check ? finer : 0));
  if (solver_check) motions += cartesian_product(thinned(most_focused(grid.axes))).size();
  const int alone = recordings > 1 ? 2 * static_cast<int>(recordings) : 0,
            looks = 2 * (own > 0 ? 1 + kRounds : 1);
  return {static_cast<int>(recordings * motions),
          looks * most_scores(grid.axes) + alone * most_scores(grid.axes, Points::dozens)};
}

Answer find_answer(GridResults& results, std::vector<Replay>& replays, const GridSettings& grid,
                   const AnswerSettings& settings, const TellWork& told) {
  Answer answer;
  answer.horizons.resize(replays.size());
  answer.best = best_of(results);
  if (answer.best < 0) return answer;
  const MotionStore store(grid.rollouts);
  std::vector<double> best = results.candidates[static_cast<std::size_t>(answer.best)].values;
  if (settings.horizon) {
    const ReplayCandidate candidate = candidate_at(best, grid);
    for (std::size_t r = 0; r < replays.size(); ++r)
      answer.horizons[r] = predictability_horizon(replays[r], candidate, store);
    drop_beyond_horizons(answer.horizons, results);
    for (std::size_t r = 0; r < replays.size(); ++r) drop_beyond_horizon(answer.horizons[r], replays[r]);
    answer.best = best_of(results);
    best = results.candidates[static_cast<std::size_t>(answer.best)].values;
  }

  GridSettings usable = grid;
  usable.axes = in_own_coordinates(axes_without_diverged(results, best));
  if (cartesian_product(usable.axes).size() < results.candidates.size())
    answer.warnings.emplace_back(
        "some candidates diverged: the answer leaves out the values of a parameter at which they did");
  const std::vector<Axis> ranges =
      settings.ranges.empty() ? usable.axes : in_own_coordinates(settings.ranges);
  usable.axes = focused(usable.axes, best);
  const std::vector<Replay> finer = finer_replays(replays, settings);
  const Task task{replays, finer, usable, ranges, settings, store, told};
  std::optional<Emulator> emulator;
  if (settings.solver_check) emulator = emulator_over(task, usable.axes, thinned(usable.axes), false);
  if (!emulator) emulator = emulator_over(task, usable.axes, {}, false);
  std::optional<Found> found;
  std::vector<KnownError> held;
  if (emulator) {
    found =
        look_with(task, std::move(*emulator), usable.axes, cells_about(best, usable.axes), best, {}, held);
  }
  if (!found) {
    answer.values = best;
    answer.estimate = results.candidates[static_cast<std::size_t>(answer.best)];
    for (const Replay& replay : replays)
      answer.motions.push_back(store.run(replay, candidate_at(best, grid)));
    answer.fit = {replays, answer.motions, answer.estimate};
    answer.parameters = findings_without_posterior(results, best);
    answer.warnings.emplace_back("the estimate cannot be simulated: nothing is said of any parameter");
    return answer;
  }
  const std::vector<Alone> alone = alone_over_all(task, *found, results);
  Concluded concluded = conclude(task, std::move(*found), best, held, alone);
  const Found& there = concluded.found;
  concluded.answer.best = answer.best;
  concluded.answer.horizons = std::move(answer.horizons);
  concluded.answer.warnings.insert(concluded.answer.warnings.begin(), answer.warnings.begin(),
                                   answer.warnings.end());
  answer = std::move(concluded.answer);
  warn_of_held(task, there.look.likelihood, there.errors, answer.warnings);

  Posterior posterior = there.look.posterior;
  if (const double spread = spread_of_scale(usable, replays); spread > 0)
    answer.weights =
        weight_of(grid) * scale_together(posterior, stiffnesses_of(posterior.axes), spread, ranges).array();
  for (std::size_t r = 0; r < replays.size(); ++r)
    answer.misfits.push_back(there.look.likelihood.of_recording(r).misfit());
  const MotionLikelihood at_fit =
      likelihood_about(task, there, answer.fit.replays, answer.values, answer.fit.motions, held);
  answer.residuals = left_residuals(at_fit);
  answer.open_information =
      open_information(at_fit, spreads_over(ranges, extent_of(there.look.posterior.axes)));
  answer.parameters = findings_of(results, ranges, posterior);
  answer.covariance_log = covariance_of_logarithms(posterior);
  answer.samples = samples_of(posterior);
  if (settings.solver_check) answer.checks = checks_of(task, there);
  if (answer.agreement)
    if (const std::string text = better_text(*answer.agreement, usable.axes); !text.empty())
      answer.warnings.push_back(text);
  return answer;
}

}  // namespace flash::sysid
