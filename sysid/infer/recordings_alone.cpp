#include "sysid/infer/recordings_alone.h"

#include <algorithm>
#include <cmath>

namespace flash::sysid {
namespace {

Alone alone_by(const Task& task, const Emulator& own, const Extent& extent, const std::vector<double>& at,
               const std::vector<Axis>& axes, const std::vector<KnownError>& errors) {
  const Look look = narrow(own, extent, at, axes, task.grid, task.settings.repeatability, errors, task.told,
                           Points::dozens);
  Alone alone{look.posterior.values(), {}, {}, extent_of(look.posterior.axes)};
  for (const auto& draws : look.posterior.samples.colwise())
    alone.spreads.push_back(std::sqrt((draws.array() - draws.mean()).square().mean()));
  alone.rates = rates_at(own, alone.values, alone.extent, axes);
  return alone;
}

/// Of what the recordings ask for, each by what it knows.
std::vector<double> mean_of(const std::vector<Alone>& alone, const std::vector<Axis>& axes) {
  constexpr double kLeast = 1e-9;  // Of a spread. Work: rounding.
  std::vector<double> mean;
  for (std::size_t k = 0; k < axes.size(); ++k) {
    double sum = 0, weights = 0;
    for (const Alone& each : alone) {
      const double weight = 1 / std::pow(std::max(each.spreads[k], kLeast), 2);
      sum += weight * coordinate_of(axes[k], each.values[k]);
      weights += weight;
    }
    mean.push_back(axes[k].values.size() > 1 ? value_of(axes[k], sum / weights) : axes[k].values.front());
  }
  return mean;
}

}  // namespace

std::vector<std::vector<double>> best_alone(const GridResults& results, const std::vector<Axis>& axes,
                                            std::size_t recordings, const std::vector<double>& of_all) {
  std::vector<std::vector<double>> best(recordings, of_all);
  std::vector<double> least(recordings, INFINITY);
  for (const CandidateResult& candidate : results.candidates) {
    bool among = candidate.recordings.size() == recordings;
    for (std::size_t k = 0; among && k < axes.size(); ++k)
      among = std::find(axes[k].values.begin(), axes[k].values.end(), candidate.values[k]) !=
              axes[k].values.end();
    for (std::size_t r = 0; among && r < recordings; ++r)
      if (candidate.recordings[r].score < least[r]) {
        least[r] = candidate.recordings[r].score;
        best[r] = candidate.values;
      }
  }
  return best;
}

KnownError to_no_cells(Motions own, Motions there) {
  return {{{-1, std::make_shared<const Motions>(std::move(own))},
           {1, std::make_shared<const Motions>(std::move(there))}},
          true,
          true};
}

std::vector<Alone> likeliest_alone(const Task& task, const Emulator& emulator, const std::vector<Axis>& axes,
                                   const std::vector<std::vector<double>>& at,
                                   const std::vector<KnownError>& errors) {
  std::vector<Alone> all;
  for (std::size_t r = 0; r < emulator.models.size(); ++r)
    all.push_back(alone_by(task, {{{task.replays[r], emulator.models[r].model.on_own_mesh()}}, own_mesh, r},
                           cells_about(at[r], axes), at[r], axes, errors));
  return all;
}

void refine_alone(const Task& task, std::vector<Alone>& alone, const std::vector<KnownError>& errors,
                  std::size_t most) {
  const std::function<void()> told = [&] { task.tell_motion(); };
  for (std::size_t r = 0; r < alone.size(); ++r) {
    GridSettings grid = task.grid;
    grid.axes = lattice(alone[r].extent, task.ranges, 3, most);
    if (cartesian_product(grid.axes).size() > most) continue;
    auto motions = motion_interpolant(task.replays[r], grid, task.store, told);
    if (!motions) continue;
    const Emulator own{{{task.replays[r], TwoMeshMotions(std::move(*motions))}}, own_mesh, r};
    alone[r] = alone_by(task, own, alone[r].extent, alone[r].values, grid.axes, errors);
  }
}

Agreement agreement_of(const Task& task, const std::vector<Alone>& alone, const std::vector<double>& estimate,
                       const std::vector<KnownError>& errors) {
  Agreement agreement;
  std::vector<std::vector<double>> for_all = {estimate, mean_of(alone, task.ranges)};
  for (const Alone& each : alone) {
    for_all.push_back(each.values);
    agreement.alone.push_back(each.values);
    agreement.spreads.push_back(each.spreads);
  }
  std::vector<WantedMotion> wanted;
  for (const std::vector<double>& values : for_all)
    for (const Replay& replay : task.replays) wanted.push_back({&replay, candidate_at(values, task.grid)});
  task.store.prepare(wanted);

  Eigen::VectorXd of_all = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(for_all.size()));
  for (std::size_t r = 0; r < alone.size(); ++r) {
    std::vector<ReplayResult> motions;
    for (const std::vector<double>& values : for_all) {
      motions.push_back(task.store.run(task.replays[r], candidate_at(values, task.grid)));
      task.tell_motion();
    }
    const ReplayResult& own = motions[2 + r];
    if (!own.finite) continue;
    const MotionLikelihood likelihood({task.replays[r]}, {own}, task.grid.score, task.settings.repeatability,
                                      errors, alone[r].rates, r);
    Eigen::VectorXd deviances(of_all.size());
    for (std::size_t c = 0; c < motions.size(); ++c) {
      const double deviance = motions[c].finite ? likelihood.deviance({motions[c].motion}) : INFINITY;
      deviances[static_cast<Eigen::Index>(c)] = std::isfinite(deviance) ? deviance : INFINITY;
    }
    if (const double least = deviances.minCoeff(); std::isfinite(least))
      of_all.array() += deviances.array() - least;
  }
  Eigen::Index best = 0;
  agreement.excess = of_all.minCoeff(&best);
  agreement.likeliest = for_all[static_cast<std::size_t>(best)];
  agreement.estimate_excess = of_all[0] - agreement.excess;
  const auto searched = static_cast<int>(std::count_if(
      task.grid.axes.begin(), task.grid.axes.end(), [](const Axis& axis) { return axis.values.size() > 1; }));
  const int freedom = searched * static_cast<int>(alone.size() - 1);
  if (freedom > 0) agreement.chance = chance_beyond(agreement.excess, freedom);
  return agreement;
}

std::size_t most_motions_alone(std::size_t recordings, std::size_t most) {
  return recordings > 1 ? most + 2 + recordings : 0;
}

}  // namespace flash::sysid
