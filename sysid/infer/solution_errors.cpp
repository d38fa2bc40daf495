#include "sysid/infer/solution_errors.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

namespace flash::sysid {
namespace {

/// The estimate on other cells; empty where one motion diverged.
std::vector<ReplayResult> motions_on(const Task& task, const std::vector<Replay>& replays,
                                     const std::vector<double>& values) {
  std::vector<ReplayResult> results;
  for (const Replay& replay : replays) {
    results.push_back(task.store.run(replay, candidate_at(values, task.grid)));
    task.tell_motion();
    if (!results.back().finite) return {};
  }
  return results;
}

/// Sum of the squares of b - a over the first vertices of both, at the steps that both keep.
double squared_difference(const Motion& a, const Motion& b, Eigen::Index vertices) {
  double sum = 0;
  for (std::size_t i = 0; i < std::min(a.positions.size(), b.positions.size()); ++i)
    if (a.positions[i].rows() > 0 && b.positions[i].rows() > 0)
      sum += (b.positions[i].topRows(vertices) - a.positions[i].topRows(vertices)).squaredNorm();
  return sum;
}

KnownError error_of(const char* name, std::shared_ptr<const Motions> from, Motions to, bool corrects,
                    double times = 1) {
  return {{{-times, std::move(from)}, {times, std::make_shared<const Motions>(std::move(to))}},
          true,
          corrects,
          {},
          name};
}

// The way to no step, or cells of no size, over that to half of it.
constexpr double kFirstOrder = 2, kSecondOrder = 4.0 / 3;

}  // namespace

bool is_found_once(const KnownError& error) {
  return error.name == half_sheet_cells || error.name == unsettled_cells || error.name == quarter_step;
}

std::vector<KnownError> errors_of_step(const Task& task, const std::vector<double>& values) {
  if (!task.settings.solver_check) return {};
  const auto at = [&](double share) {
    std::vector<Replay> replays = with_step(task.replays, share);
    std::vector<ReplayResult> motions = motions_on(task, replays, values);
    return Motions{std::move(replays), std::move(motions)};
  };
  Motions half = at(0.5), quarter = at(0.25);
  if (half.results.empty() || quarter.results.empty()) return {};
  return {error_of(quarter_step, std::make_shared<const Motions>(std::move(half)), std::move(quarter), true,
                   kFirstOrder)};
}

double observed_ratio(const std::vector<ReplayResult>& cells, const std::vector<ReplayResult>& halves,
                      const std::vector<ReplayResult>& quarters) {
  double first = 0, second = 0;
  for (std::size_t r = 0; r < cells.size(); ++r) {
    const Eigen::Index vertices = cells[r].motion.positions.front().rows();
    first += squared_difference(cells[r].motion, halves[r].motion, vertices);
    second += squared_difference(halves[r].motion, quarters[r].motion, vertices);
  }
  return first > 0 ? std::sqrt(second / first) : 0;
}

std::vector<KnownError> errors_of_cells(const Task& task, const Emulator& emulator,
                                        const std::vector<double>& values,
                                        const std::vector<ReplayResult>& here) {
  if (task.cells == nullptr || task.cells->of_sheet.empty()) return {};
  std::vector<KnownError> errors;
  const auto between = std::make_shared<const Motions>(
      Motions{task.cells->between, motions_on(task, task.cells->between, values)});
  if (between->results.empty()) return {};
  // Both have the same cells at the grasp, whose error is that of the finer mesh.
  if (auto halved = motions_on(task, task.cells->of_sheet, values); !halved.empty())
    errors.push_back(
        error_of(half_sheet_cells, between, {task.cells->of_sheet, std::move(halved)}, true, kSecondOrder));
  if (emulator.share == own_mesh) return errors;
  const std::vector<Replay> on_finer = replays_of(emulator);
  std::vector<ReplayResult> finer = motions_on(task, on_finer, values);
  if (!finer.empty() && observed_ratio(here, between->results, finer) > most_ratio)
    errors.push_back(error_of(unsettled_cells, std::make_shared<const Motions>(Motions{task.replays, here}),
                              {on_finer, std::move(finer)}, false));
  return errors;
}

}  // namespace flash::sysid
