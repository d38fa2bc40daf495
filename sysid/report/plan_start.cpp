#include "sysid/report/plan_start.h"

#include "sysid/design/rank_experiments.h"
#include "sysid/infer/posterior.h"

namespace flash::sysid {

void start_plan(const SearchFolder& search, PlanSettings& settings) {
  const Summary& summary = search.summary;
  settings.grid.axes = in_own_coordinates(search.results.axes);
  settings.at.clear();
  std::vector<Axis> searched;
  for (const Axis& axis : settings.grid.axes) {
    settings.at.push_back(axis.values.size() > 1 ? summary.best.at(axis.name) : axis.values.front());
    if (axis.values.size() > 1) searched.push_back(axis);
  }
  for (const auto& [name, fixed] : summary.fixed)
    if (fixed.source == "measured") settings.grid.fixed.push_back({name, {fixed.value}, false});
  for (const auto& [name, fixed] : summary.fixed)
    if (fixed.deviation) settings.grid.deviations[name] = *fixed.deviation;
  std::vector<Misfit> misfits;
  double duration = 0;
  for (const SummaryRecording& recording : summary.recordings) {
    misfits.push_back(recording.misfit);
    duration += duration_of(recording) / static_cast<double>(summary.recordings.size());
  }
  settings.known = {covariance_of_draws(searched, summary.samples), expected_misfit(misfits), duration};
}

}  // namespace flash::sysid
