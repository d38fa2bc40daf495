#include "sysid/refine.h"

#include <algorithm>
#include <cmath>

#include "sysid/solver_check.h"
#include "sysid/zoom.h"

namespace flash::sysid {
namespace {

constexpr double kOwn = 0, kFiner = 1, kLimit = 4.0 / 3;  // shares of a MotionModel

using Extent = std::vector<std::array<double, 2>>;

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

Extent extent_of(const GridResults& results) {
  Extent extent;
  for (const Axis& axis : results.axes) extent.push_back({axis.values.front(), axis.values.back()});
  return extent;
}

std::vector<double> nearest_thinned(const std::vector<double>& values, const std::vector<Axis>& axes) {
  std::vector<double> nearest;
  for (std::size_t k = 0; k < axes.size(); ++k) {
    const auto distance = [&](double value) {
      return axes[k].logarithmic ? std::abs(std::log(value / values[k])) : std::abs(value - values[k]);
    };
    nearest.push_back(*std::min_element(axes[k].values.begin(), axes[k].values.end(),
                                        [&](double a, double b) { return distance(a) < distance(b); }));
  }
  return nearest;
}

std::optional<std::vector<ModelledReplay>> models_of(const std::vector<Replay>& replays,
                                                     const GridSettings& grid, const RolloutStore& store,
                                                     bool finer) {
  std::vector<ModelledReplay> models;
  for (const Replay& replay : replays) {
    std::optional<ModelledReplay> model = model_motions(replay, grid, store, finer);
    if (!model) return std::nullopt;
    models.push_back(std::move(*model));
  }
  return models;
}

std::vector<ReplayResult> modelled(const std::vector<ModelledReplay>& models,
                                   const std::vector<double>& values, double share) {
  const MotionsAt motions = motions_of(models, share);
  std::vector<ReplayResult> results;
  for (std::size_t r = 0; r < models.size(); ++r) results.push_back(std::move(motions(r, {values}).front()));
  return results;
}

SolverShift shift_of(const SolverCheck& check, const std::vector<Axis>& axes) {
  SolverShift shift(static_cast<Eigen::Index>(axes.size()));
  for (std::size_t k = 0; k < axes.size(); ++k)
    shift[static_cast<Eigen::Index>(k)] = check.shift.at(axes[k].name);
  return shift;
}

/// The largest shift over the width of the parameter's interval.
double share_of_interval(const SolverShift& shift, const GridVerdict& verdict,
                         const std::vector<Axis>& axes) {
  double share = 0;
  for (std::size_t k = 0; k < axes.size(); ++k) {
    const auto [low, high] = *verdict.parameters[k].interval95;
    const double width = axes[k].logarithmic ? std::log(high / low) : high - low;
    if (width > 0) share = std::max(share, std::abs(shift[static_cast<Eigen::Index>(k)]) / width);
  }
  return share;
}

/// How far the intervals reach into the cells of the grid around the estimate: 1 where one of them fills half
/// its cell, over which an error of interpolation can be another.
double share_of_cell(const GridVerdict& verdict, const std::vector<Axis>& axes) {
  double share = 0;
  for (std::size_t k = 0; k < axes.size(); ++k) {
    const std::vector<double>& values = axes[k].values;
    if (values.size() < 2) continue;
    const auto above =
        std::upper_bound(values.begin() + 1, values.end() - 1, *verdict.parameters[k].estimate);
    const auto [low, high] = *verdict.parameters[k].interval95;
    const auto width = [&](double from, double to) {
      return axes[k].logarithmic ? std::log(to / from) : to - from;
    };
    share = std::max(share, width(low, high) / width(*(above - 1), *above));
  }
  return std::min(1.0, share);
}

/// The profile of every parameter at the two ends of its range: the rest searched anew with it held there.
GridVerdict verdict_at_ends(const std::vector<ModelledReplay>& models, double share, const Zoomed& found,
                            const GridSettings& grid, std::optional<double> repeatability) {
  GridVerdict verdict = found.verdict;
  for (std::size_t k = 0; k < grid.axes.size(); ++k) {
    ParameterFinding& finding = verdict.parameters[k];
    finding.values = grid.axes[k].values;
    finding.scores.assign(finding.values.size(), found.verdict.estimate_score);
    if (finding.values.size() < 2) continue;
    finding.values = {grid.axes[k].values.front(), grid.axes[k].values.back()};
    finding.scores.clear();
    for (const double end : finding.values) {
      GridSettings held = grid;
      held.axes[k].values = {end};
      Extent extent = extent_of(found.results);
      extent[k] = {end, end};
      finding.scores.push_back(zoom(models, share, extent, held, repeatability).verdict.estimate_score);
    }
  }
  return verdict;
}

}  // namespace

std::optional<Refined> refine(const GridResults& results, const GridVerdict& whole,
                              const std::vector<Replay>& replays, const GridSettings& grid,
                              std::optional<double> repeatability, bool solver_check) {
  const RolloutStore store(grid.rollouts);
  std::optional<std::vector<ModelledReplay>> models;
  if (solver_check) models = models_of(replays, grid, store, true);
  const bool finer = models.has_value();
  if (!models) models = models_of(replays, grid, store, false);
  if (!models) return std::nullopt;

  const CandidateResult& best = results.candidates[static_cast<std::size_t>(whole.best)];
  Zoomed found = zoom(*models, kOwn, cells_around(best, grid.axes), grid, repeatability);
  const double share = finer ? kLimit : kOwn;
  std::vector<Replay> on_model;
  for (const ModelledReplay& model : *models) on_model.push_back(model.replay);

  // The estimate is simulated on the search's mesh; what its motion has beyond the interpolated one corrects
  // the models, and the search goes on, until that no longer matters to the interval.
  constexpr int kRounds = 4;
  constexpr double kEnough = 0.1;  // of the interval
  Refined refined;
  SolverError error;
  std::vector<double> estimate;
  Sensitivity sensitivity;
  for (int round = 0; round < kRounds; ++round) {
    if (finer || round > 0) found = zoom(*models, share, extent_of(found.results), grid, repeatability);
    if (found.verdict.best < 0) return std::nullopt;
    estimate.assign(found.verdict.estimate.begin(), found.verdict.estimate.end());
    sensitivity = measure_sensitivity(on_model, grid, estimate, true, motions_of(*models, share));
    const std::vector<ReplayResult> own_motions = modelled(*models, estimate, kOwn);
    std::vector<ReplayResult> simulated = sensitivity.motions;
    std::vector<Motion> differences;
    for (std::size_t r = 0; r < replays.size(); ++r) {
      const ReplayResult result = std::move(run(replays[r], {candidate_at(estimate, grid)}).front());
      if (!result.finite) return std::nullopt;
      Motion difference = own_motions[r].motion;
      add(difference, -2, own_motions[r].motion);
      add(difference, 1, (*models)[r].model.on_its_mesh(result.motion));
      add(simulated[r].motion, 1, difference);
      differences.push_back(std::move(difference));
    }
    const SolverCheck itself = compare_solutions("estimate_itself", sensitivity, on_model,
                                                 sensitivity.motions, on_model, simulated, grid);
    refined.interpolation = std::abs(itself.score - found.verdict.estimate_score);
    error.remainders.resize(round == 0 ? 1 : 2);
    error.remainders.back() = shift_of(itself, grid.axes);
    refined.checks = {itself};
    if (share_of_interval(error.remainders.front(), found.verdict, grid.axes) < kEnough) break;
    if (round + 1 < kRounds)
      for (std::size_t r = 0; r < replays.size(); ++r) (*models)[r].model.correct(differences[r]);
  }
  if (refined.checks.front().score > whole.score) return std::nullopt;
  // Away from the estimate the correction wears off.
  if (error.remainders.size() > 1) error.remainders.front() *= share_of_cell(found.verdict, grid.axes);

  if (solver_check) {
    std::vector<SolverCheck> steps =
        check_steps(replays, sensitivity, grid, nearest_thinned(estimate, thinned(grid.axes)), store);
    for (SolverCheck& check : steps) {
      error.shifts.push_back(shift_of(check, grid.axes));
      refined.checks.push_back(std::move(check));
    }
  }
  if (finer) {
    const std::vector<ReplayResult> own_motions = modelled(*models, estimate, kOwn),
                                    finer_motions = modelled(*models, estimate, kFiner);
    const SolverCheck left =
        compare_solutions("", sensitivity, on_model, finer_motions, on_model, sensitivity.motions, grid);
    error.remainders.push_back(shift_of(left, grid.axes));
    refined.checks.push_back(
        compare_solutions("double_mesh", sensitivity, on_model, own_motions, on_model, finer_motions, grid));
  }

  for (const SolverCheck& check : refined.checks)
    error.score = std::max(error.score, std::hypot(whole.score, check.surface_change_m) - whole.score);
  const GridVerdict ends = verdict_at_ends(*models, share, found, grid, repeatability);
  const GridVerdict verdict = profile_grid(found.results, {repeatability, error, found.information, &ends});
  refined.verdict = whole;
  refined.verdict.parameters = verdict.parameters;
  refined.verdict.estimate = verdict.estimate;
  refined.verdict.estimate_score = verdict.estimate_score;
  refined.verdict.covariance_log = verdict.covariance_log;
  return refined;
}

}  // namespace flash::sysid
