#include "sysid/infer/recordings_alone.h"

#include <algorithm>
#include <cmath>

namespace flash::sysid {
namespace {

/// A value and the next ones of its axis.
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

}  // namespace

std::vector<Alone> likeliest_alone(const Task& task, const Emulator& emulator, const std::vector<Axis>& axes,
                                   const std::vector<std::vector<double>>& at,
                                   const std::vector<KnownError>& errors) {
  std::vector<Alone> all;
  for (std::size_t r = 0; r < emulator.models.size(); ++r) {
    const Emulator own{{emulator.models[r]}, emulator.share, emulator.first + r};
    const Look look = narrow(own, cells_about(at[r], axes), at[r], axes, task.grid,
                             task.settings.repeatability, errors, task.told);
    Alone alone{look.posterior.values(), {}, {}};
    for (const auto& draws : look.posterior.samples.colwise())
      alone.spreads.push_back(std::sqrt((draws.array() - draws.mean()).square().mean()));
    alone.rates = rates_at(own, alone.values, extent_of(look.posterior.axes), axes);
    all.push_back(std::move(alone));
  }
  return all;
}

Agreement agreement_of(const Task& task, const std::vector<Alone>& alone,
                       const std::vector<ReplayResult>& together, const std::vector<KnownError>& errors) {
  Agreement agreement;
  std::vector<WantedMotion> wanted;
  for (std::size_t r = 0; r < alone.size(); ++r) {
    agreement.alone.push_back(alone[r].values);
    agreement.spreads.push_back(alone[r].spreads);
    wanted.push_back({&task.replays[r], candidate_at(alone[r].values, task.grid)});
  }
  task.store.prepare(wanted);
  for (std::size_t r = 0; r < alone.size(); ++r) {
    const ReplayResult own = task.store.run(*wanted[r].replay, wanted[r].candidate);
    task.tell_motion();
    if (!own.finite || !together[r].finite) continue;
    const MotionLikelihood likelihood({task.replays[r]}, {own}, task.grid.score, task.settings.repeatability,
                                      errors, alone[r].rates, r);
    const double less = likelihood.deviance({together[r].motion}) - likelihood.deviance({own.motion});
    if (less > 0) agreement.excess += less;
  }
  const auto searched = static_cast<int>(std::count_if(
      task.grid.axes.begin(), task.grid.axes.end(), [](const Axis& axis) { return axis.values.size() > 1; }));
  const int freedom = searched * static_cast<int>(alone.size() - 1);
  if (freedom > 0) agreement.chance = chance_beyond(agreement.excess, freedom);
  return agreement;
}

}  // namespace flash::sysid
