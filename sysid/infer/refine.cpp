#include "sysid/infer/refine.h"

#include <algorithm>
#include <cmath>

#include "sysid/infer/adaptive_design.h"

namespace flash::sysid {
namespace {

constexpr int kRounds = 4;                                // of motions about the answer
constexpr std::size_t kFew = 30;                          // of them in a round
constexpr double kOwn = 0, kFiner = 1, kLimit = 4.0 / 3;  // shares of a TwoMeshMotions

/// The cells of the grid around a candidate.
Extent cells_around(const CandidateResult& candidate, const std::vector<Axis>& axes) {
  Extent extent;
  for (std::size_t k = 0; k < axes.size(); ++k) {
    const std::vector<double>& values = axes[k].values;
    const auto at = static_cast<std::size_t>(std::find(values.begin(), values.end(), candidate.values[k]) -
                                             values.begin());
    extent.push_back({values[at > 0 ? at - 1 : 0], values[std::min(at + 1, values.size() - 1)]});
  }
  return extent;
}

using Models = std::vector<ModelledReplay>;

/// The motions at every point of `grid.axes`; with `finer` axes (none: empty) those of a finer mesh at
/// theirs. Empty where one diverged or there is no finer mesh.
std::optional<Models> models_of(const std::vector<Replay>& replays, const GridSettings& grid,
                                const std::vector<Axis>& finer, const MotionStore& store,
                                const std::function<void()>& told, const std::function<void()>& told_finer) {
  Models models;
  for (const Replay& replay : replays) {
    const std::optional<MotionInterpolant> motions = motion_interpolant(replay, grid, store, told);
    if (!motions) return std::nullopt;
    std::optional<ModelledReplay> model =
        finer.empty() ? ModelledReplay{replay, TwoMeshMotions(*motions)}
                      : with_finer_mesh(replay, *motions, finer, grid, store, told_finer);
    if (!model) return std::nullopt;
    models.push_back(std::move(*model));
  }
  return models;
}

std::vector<double> estimate_of(const Zoomed& found) {
  return {found.verdict.estimate.begin(), found.verdict.estimate.end()};
}

SolverShift shift_of(const SolverCheck& check, const std::vector<Axis>& axes) {
  SolverShift shift(static_cast<Eigen::Index>(axes.size()));
  for (std::size_t k = 0; k < axes.size(); ++k)
    shift[static_cast<Eigen::Index>(k)] = check.shift.at(axes[k].name);
  return shift;
}

/// The profile of every parameter at the two ends of its range: the rest searched anew with it held there.
std::vector<RangeEnd> profile_at_ends(const std::vector<ModelledReplay>& models, double share,
                                      const Zoomed& found, const GridSettings& grid,
                                      std::optional<double> repeatability, const TellWork& told) {
  std::vector<RangeEnd> ends;
  for (std::size_t k = 0; k < grid.axes.size(); ++k) {
    const std::vector<double>& values = grid.axes[k].values;
    if (values.size() < 2) continue;
    for (const double end : {values.front(), values.back()}) {
      GridSettings held = grid;
      held.axes[k].values = {end};
      Extent extent = extent_of(found.results.axes);
      extent[k] = {end, end};
      const GridVerdict verdict = zoom(models, share, extent, held, repeatability, told).verdict;
      if (verdict.best >= 0) ends.push_back({k, verdict.estimate_score, verdict.estimate});
    }
  }
  return ends;
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
    own *= std::max<std::size_t>(count, 3);
    finer *= std::max<std::size_t>(thin[k].values.size(), 2);
  }
  if (fewest > kFew) return {0, 0};
  return {std::min(own, kFew), std::min(finer, kFew)};
}

}  // namespace

AnswerWork most_work(const GridSettings& grid, std::size_t recordings, bool solver_check) {
  const auto [own, finer] = most_motions(grid.axes);
  std::size_t motions = 1 + kRounds * (own + (solver_check ? finer : 0));
  if (solver_check) motions += cartesian_product(thinned(grid.axes)).size();
  int scores = most_scores(grid.axes) * (own > 0 ? 1 + kRounds : 1);
  for (std::size_t k = 0; k < grid.axes.size(); ++k) {
    if (grid.axes[k].values.size() < 2) continue;
    std::vector<Axis> held = grid.axes;
    held[k].values.resize(1);
    scores += 2 * most_scores(held);
  }
  return {static_cast<int>(recordings * motions), scores};
}

std::optional<Refined> refine(const GridResults& results, const GridVerdict& whole,
                              const std::vector<Replay>& replays, const GridSettings& grid,
                              std::optional<double> repeatability, bool solver_check, const TellWork& told) {
  const std::function<void()> motion = [&] {
    if (told) told({1, 0}, {});
  };
  const MotionStore store(grid.rollouts);
  const CandidateResult& best = results.candidates[static_cast<std::size_t>(whole.best)];
  std::optional<Models> models;
  if (solver_check) models = models_of(replays, grid, thinned(grid.axes), store, {}, motion);
  const bool finer = models.has_value();
  const double share = finer ? kLimit : kOwn;
  if (!models) models = models_of(replays, grid, {}, store, {}, {});
  if (!models) return std::nullopt;
  Zoomed found = zoom(*models, share, cells_around(best, grid.axes), grid, repeatability, told);
  if (found.verdict.best < 0) return std::nullopt;
  const std::vector<RangeEnd> ends = profile_at_ends(*models, share, found, grid, repeatability, told);
  std::vector<Replay> on_model;
  for (const ModelledReplay& model : *models) on_model.push_back(model.replay);

  // Simulated anew about the answer where few simulations do, and again where its intervals end outside.
  GridSettings local = grid;
  Extent extent = extent_of(found.results.axes);
  for (int round = 0; round < kRounds; ++round) {
    GridSettings nearer = grid;
    nearer.axes = lattice(extent, grid.axes, 3);
    if (cartesian_product(nearer.axes).size() > kFew) break;
    std::optional<Models> there =
        models_of(replays, nearer, finer ? thinned(lattice(extent, grid.axes, 2)) : std::vector<Axis>{},
                  store, motion, motion);
    if (!there) return std::nullopt;
    Zoomed answer = zoom(*there, share, extent, nearer, repeatability, told);
    if (answer.verdict.best < 0) return std::nullopt;
    const Extent next = next_lattice(extent, extent_of(answer.results.axes), answer.verdict, grid.axes);
    if (next == extent || round + 1 == kRounds) {
      found = std::move(answer);
      models = std::move(there);
      local = nearer;
      break;
    }
    extent = next;
  }
  const std::vector<double> estimate = estimate_of(found);

  // What is left of the interpolation, at the estimate.
  const Sensitivity sensitivity =
      measure_sensitivity(on_model, local, estimate, true, motions_of(*models, share));
  const MotionsAt own_model = motions_of(*models, kOwn), finer_model = motions_of(*models, kFiner);
  std::vector<ReplayResult> own, own_finer, simulated = sensitivity.motions;
  for (std::size_t r = 0; r < replays.size(); ++r) {
    const ReplayResult result = store.run(replays[r], candidate_at(estimate, grid));
    motion();
    if (!result.finite) return std::nullopt;
    own.push_back(std::move(own_model(r, {estimate}).front()));
    own_finer.push_back(std::move(finer_model(r, {estimate}).front()));
    add(simulated[r].motion, 1, (*models)[r].model.on_its_mesh(result.motion));
    add(simulated[r].motion, -1, own.back().motion);
  }
  Refined refined;
  SolverError error;
  const auto compare = [&](const char* what, const std::vector<ReplayResult>& a,
                           const std::vector<ReplayResult>& b) {
    return compare_solutions(what, sensitivity, on_model, a, on_model, b, grid);
  };
  const SolverCheck itself = compare("estimate_itself", sensitivity.motions, simulated);
  if (itself.score > whole.score) return std::nullopt;
  refined.interpolation = std::abs(itself.score - found.verdict.estimate_score);
  refined.checks = {itself};
  error.remainders.push_back(shift_of(itself, grid.axes));
  if (solver_check)
    for (SolverCheck& check : check_steps(replays, sensitivity, grid, estimate, store)) {
      error.shifts.push_back(shift_of(check, grid.axes));
      refined.checks.push_back(std::move(check));
    }
  if (finer) {
    error.remainders.push_back(shift_of(compare("", own_finer, sensitivity.motions), grid.axes));
    refined.checks.push_back(compare("double_mesh", own, own_finer));
  }

  for (const SolverCheck& check : refined.checks)
    error.score = std::max(error.score, std::hypot(whole.score, check.surface_change_m) - whole.score);
  const GridVerdict verdict = profile_grid(found.results, {repeatability, error, found.information, ends});
  refined.verdict = whole;
  refined.verdict.parameters = verdict.parameters;
  refined.verdict.estimate = verdict.estimate;
  refined.verdict.estimate_score = verdict.estimate_score;
  refined.verdict.covariance_log = verdict.covariance_log;
  return refined;
}

}  // namespace flash::sysid
