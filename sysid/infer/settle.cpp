#include "sysid/infer/settle.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "sysid/infer/agreed_numbers.h"

namespace flash::sysid {
namespace {

void set_estimate(Posterior& posterior, const std::vector<Axis>& axes, const std::vector<double>& values) {
  for (std::size_t k = 0; k < values.size(); ++k)
    posterior.estimate[static_cast<Eigen::Index>(k)] = coordinate_of(axes[k], values[k]);
}

std::vector<Motion> motions_in(const std::vector<ReplayResult>& results) {
  std::vector<Motion> motions;
  for (const ReplayResult& result : results) motions.push_back(result.motion);
  return motions;
}

/// Whether all recordings tell that cells of the search's own size explain them better than cells of no size
/// do: how far they are from these along the error of the mesh, of which the own mesh is two deviations
/// (kUnsure of solve_at) to the low side.
bool ask_for_own_mesh(const Found& found, const std::vector<KnownError>& held,
                      const MotionLikelihood& likelihood,
                      const std::vector<MotionLikelihood::Nuisance>& fitted) {
  // Standard deviations of the error of the mesh, from cells of no size towards the own mesh, which is at -2.
  // Theory: past the middle.
  constexpr double kNearer = -1;
  // Standard deviations of what the recordings tell of it. Theory: once in twenty.
  constexpr double kSure = 2;
  const std::vector<KnownError> errors = errors_about(found, held);
  const auto of_mesh = std::find_if(errors.begin(), errors.end(),
                                    [](const KnownError& error) { return error.name == "double_mesh"; });
  if (of_mesh == errors.end()) return false;
  const auto e = static_cast<std::size_t>(of_mesh - errors.begin());
  const double size = std::sqrt(static_cast<double>(fitted.size()));  // of a shared error, in each recording
  return std::all_of(fitted.begin(), fitted.end(), [&](const MotionLikelihood::Nuisance& nuisance) {
    return size * (nuisance.errors[static_cast<Eigen::Index>(e)] + kSure * likelihood.spread_of(e)) < kNearer;
  });
}

double score_of(const Task& task, const std::vector<Replay>& replays,
                const std::vector<ReplayResult>& motions) {
  return score_motions(replays, motions, task.grid.score).score;
}

/// How much likelier a motion of the search's own mesh is than all of cells of no size, as a deviance, where
/// it is nearer than their mode to what was observed; nothing where it is not. As where searches are compared
/// (excess_deviance), the nearer of two models says how much a row counts along what tells both apart: by the
/// measure of a model that misses by far more than noise, hardly anything is likelier than another. `own`, of
/// the own mesh, and `mode` are on the mesh of the emulator.
double likelier_by_own_measure(const Task& task, const Found& found, const std::vector<KnownError>& held,
                               const std::vector<ReplayResult>& own, const std::vector<ReplayResult>& mode) {
  const std::vector<Replay> replays = replays_of(found.emulator);
  if (!(score_of(task, replays, own) < score_of(task, replays, mode))) return 0;
  const MotionChange apart = {{-1, std::make_shared<const Motions>(Motions{replays, own})},
                              {1, std::make_shared<const Motions>(Motions{replays, mode})}};
  const MotionLikelihood likelihood(replays, own, task.grid.score, task.settings.repeatability,
                                    errors_about(found, held), {apart});
  const double of_mode = likelihood.deviance(motions_in(mode), task.grid.threads);
  double least = std::isnan(of_mode) ? INFINITY : of_mode;
  // By this measure they may be likeliest far from their mode.
  for (const std::vector<Axis>& axes : {found.axes, found.look.posterior.axes})
    least = std::min(least, deviance_over(found.emulator, axes, likelihood, task.grid).minCoeff());
  return least - likelihood.deviance(motions_in(own), task.grid.threads);
}

/// What the answer may be of: the mode of the posterior, and the best candidate of the search.
struct Rivals {
  std::vector<double> mode, best;
  std::vector<ReplayResult> mode_on_own, mode_there;  ///< on the search's mesh, and on that of the emulator
  std::vector<ReplayResult> best_on_own;
};

/// Empty where the mode diverges.
std::optional<Rivals> simulate_rivals(const Task& task, const Found& found, const std::vector<double>& best) {
  Rivals rivals;
  rivals.mode = found.look.posterior.values();
  rivals.best = best;
  auto there = simulate_at(task, found.emulator, rivals.mode, false, rivals.mode_on_own);
  if (!there) return std::nullopt;
  rivals.mode_there = std::move(*there);
  for (const Replay& replay : task.replays)
    rivals.best_on_own.push_back(task.store.run(replay, candidate_at(best, task.grid)));
  return rivals;
}

Extent at(const std::vector<double>& values) {
  Extent extent;
  for (const double value : values) extent.push_back({value, value});
  return extent;
}

/// How much likelier the search's best is than the mode, as a deviance. Where the best is beyond the
/// emulator's grid, both are moved alike to cells of no size.
double fall_to_best(const Task& task, const Found& found, const Rivals& rivals,
                    std::vector<KnownError> errors) {
  const std::vector<Replay> there = replays_of(found.emulator);
  errors.push_back({{{-1, std::make_shared<const Motions>(Motions{task.replays, rivals.mode_on_own})},
                     {1, std::make_shared<const Motions>(Motions{there, rivals.mode_there})}},
                    true,
                    true});
  const MotionLikelihood likelihood =
      likelihood_about(task, found, task.replays, rivals.mode, rivals.mode_on_own, std::move(errors));
  return likelihood.deviance(motions_in(rivals.mode_on_own), task.grid.threads) -
         likelihood.deviance(motions_in(rivals.best_on_own), task.grid.threads);
}

/// How the likelihood of an answer on cells of no size takes its mode, and the least over its points.
struct AtLimit {
  const MotionLikelihood& likelihood;
  std::vector<MotionLikelihood::Nuisance> fitted;  ///< at the mode
  double mode = 0, points = 0;                     ///< deviances; of a mode that diverges NaN
};

/// Whether motions of the search's own mesh explain the recordings better than those of cells of no size.
bool own_mesh_explains(const Task& task, Found& found, const Rivals& rivals, const AtLimit& limit,
                       const std::vector<KnownError>& held) {
  // Of a deviance, from which the own mesh explains better. Measured: strips on either mesh differ by 2 at
  // most.
  constexpr double kFails = 3;
  const std::vector<Replay> replays = replays_of(found.emulator);
  const MotionLikelihood& likelihood = limit.likelihood;
  const double share = std::exchange(found.emulator.share, own_mesh);
  Eigen::Index likeliest;
  const double of_own = deviance_over(found.emulator, found.axes, likelihood, task.grid).minCoeff(&likeliest),
               better = std::min(limit.points, std::isnan(limit.mode) ? INFINITY : limit.mode) - of_own;
  found.emulator.share = share;
  // Of the own mesh: the likeliest about the mode, and the search's best, which may be far from there.
  std::vector<ReplayResult> nearest =
      motions_at(found.emulator, values_of(found.axes, static_cast<int>(likeliest)), own_mesh);
  std::vector<ReplayResult> best_there = rivals.best_on_own;
  std::vector<Motion> mode_on_own;
  for (std::size_t r = 0; r < best_there.size(); ++r) {
    const auto& model = found.emulator.models[r].model;
    best_there[r].motion = model.on_its_mesh(rivals.best_on_own[r].motion);
    mode_on_own.push_back(model.on_its_mesh(rivals.mode_on_own[r].motion));
  }
  if (score_of(task, replays, best_there) < score_of(task, replays, nearest)) nearest = std::move(best_there);
  const bool by_extrapolation_alone =
      better > -kFails && !(likelihood.deviance(mode_on_own, task.grid.threads) - of_own < three_deviations);
  return better > kFails || by_extrapolation_alone ||
         ask_for_own_mesh(found, held, likelihood, limit.fitted) ||
         likelier_by_own_measure(task, found, held, nearest, rivals.mode_there) > kFails;
}

/// Whether the search's best comes nearer to what was observed than the mode, on its mesh and on the
/// answer's.
bool best_is_nearer(const Task& task, const Found& found, const Rivals& rivals) {
  if (!(much_farther * score_of(task, task.replays, rivals.best_on_own) <
        score_of(task, task.replays, rivals.mode_on_own)))
    return false;
  const std::vector<Replay> replays = replays_of(found.emulator);
  std::vector<ReplayResult> on_own_mesh;
  const auto best_there = simulate_at(task, found.emulator, rivals.best, false, on_own_mesh);
  return best_there &&
         much_farther * score_of(task, replays, *best_there) < score_of(task, replays, rivals.mode_there);
}

}  // namespace

Settled settle(const Task& task, Found& found, const std::vector<double>& best,
               const std::vector<KnownError>& held) {
  // Of a deviance, by which the best candidate has to be likelier than what is emulated. Chosen: not varied.
  constexpr double kMatters = 1;
  // Of a deviance, as verdicts have it. Theory: chi-square of one degree of freedom, once in twenty.
  constexpr double kLikely = 3.84;
  const std::optional<Rivals> rivals = simulate_rivals(task, found, best);
  if (!rivals) return Settled::elsewhere;
  const std::vector<double>& mode = rivals->mode;
  MotionLikelihood likelihood =
      likelihood_about(task, found, replays_of(found.emulator), mode,
                       motions_at(found.emulator, mode, found.emulator.share), held);
  const Eigen::VectorXd of_points = deviance_over(found.emulator, found.axes, likelihood, task.grid);
  const std::vector<Motion> at_mode = motions_in(rivals->mode_there);
  AtLimit limit{.likelihood = likelihood, .fitted = {}, .points = of_points.minCoeff()};
  limit.mode = likelihood.deviance([&](std::size_t r, double) -> const Motion& { return at_mode[r]; },
                                   limit.fitted, task.grid.threads);
  const double fall = std::isnan(limit.mode) ? INFINITY : std::max(0.0, limit.mode - limit.points),
               to_best = fall_to_best(task, found, *rivals, held);
  const bool best_beyond = reaches_beyond(at(best), found.axes);
  if (to_best > fall + kMatters && best_beyond) return Settled::elsewhere;
  if (found.emulator.share != own_mesh && own_mesh_explains(task, found, *rivals, limit, held))
    return Settled::on_own_mesh;
  // Of values that are as good as equally likely, those whose motion is nearest.
  if (to_best > -kLikely && !best_beyond && best_is_nearer(task, found, *rivals)) {
    set_estimate(found.look.posterior, found.axes, best);
    return Settled::by_emulator;
  }
  const double share_of_points = 1 - std::exp(-0.5 * std::max(fall, to_best));
  if (!(share_of_points > 0)) return Settled::by_emulator;
  Posterior by_points = explore_at_points(found.axes, of_points);
  if (share_of_points < 0.5 || !(fall > 0)) set_estimate(by_points, found.axes, mode);
  found.look.posterior = mixture(found.look.posterior, std::move(by_points), share_of_points);
  if (share_of_points < 0.5) return Settled::by_emulator;
  found.look.likelihood = std::move(likelihood);
  found.errors = errors_about(found, held);
  return Settled::by_points;
}

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

}  // namespace flash::sysid
