#include "sysid/infer/expected_work.h"

#include <algorithm>
#include <cmath>

#include "sysid/infer/adaptive_design.h"
#include "sysid/infer/estimate_errors.h"
#include "sysid/infer/held.h"
#include "sysid/infer/lattice_about.h"
#include "sysid/replay/coarse_cells.h"
#include "sysid/replay/grasp_mesh.h"
#include "sysid/replay/half_cell.h"

namespace flash::sysid {
namespace {

/// Of a candidate: a likelihood. Work: as motions of a towel are scored; for the time left alone.
constexpr double kScore = 1.0 / 40;
/// Of the points that two looks may take. Work: for the time left alone.
constexpr double kLookShare = 0.2;
/// Of looks after which the cells of the sheet are halved anew. Work: for the time left alone.
constexpr double kFollow = 0.6;
constexpr double kSheetHalved = 4;  // Vertices, of half the cells. Work: for the time left alone.
/// Vertices, of half the cells at grasps alone. Work: for the time left alone.
constexpr double kGraspsHalved = 1.3;

double vertices_of(const std::vector<Replay>& replays) {
  double sum = 0;
  for (const Replay& replay : replays) sum += static_cast<double>(replay.recording.mesh.vertices.rows());
  return sum;
}

/// Vertices of the finer mesh over those of the search's.
double finer_vertices(const std::vector<Replay>& replays) {
  double finer = 0;
  for (const Replay& replay : replays) {
    const auto vertices = static_cast<double>(replay.recording.mesh.vertices.rows());
    if (!are_graded(replay.recording, replay.settings)) {
      finer += (replay.recording.is_solid() ? 8 : 4) * vertices;
      continue;
    }
    data::Recording smaller = replay.recording;
    refine_grasps(replay.settings, 0.25, smaller);
    finer += static_cast<double>(smaller.mesh.vertices.rows());
  }
  return finer / vertices_of(replays);
}

}  // namespace

double motion_cost(double vertices, double steps) { return std::pow(vertices, 1.5) * std::sqrt(steps); }

double time_together(const std::vector<SimulatedTogether>& simulations, int threads) {
  double sum = 0, longest = 0;
  for (const SimulatedTogether& each : simulations) {
    sum += each.count * each.each;
    if (each.count > 0) longest = std::max(longest, each.each);
  }
  return std::max(sum, threads * longest);
}

namespace {

/// In candidates on the cells of the replays.
ExpectedWork work_on(const std::vector<Replay>& replays, const GridSettings& grid, bool solver_check) {
  const auto searched = static_cast<double>(std::count_if(
      grid.axes.begin(), grid.axes.end(), [](const Axis& axis) { return axis.values.size() > 1; }));
  const double finer = solver_check ? motion_cost(finer_vertices(replays), 1) : 0;
  const bool other_cells = solver_check && are_graded(replays);
  const double held = 2.0 * static_cast<double>(held_parameters(grid, replays).size());
  const double looks = kLookShare * kScore * most_scores(grid.axes);
  const int threads = grid.threads;

  std::vector<SimulatedTogether> at_estimate = {{1 + held, 1}, {emulator_draws, 1}};
  if (solver_check) at_estimate = {{2 + held, 1}, {1 + emulator_draws, motion_cost(1, 2)}, {1, finer}};
  std::vector<SimulatedTogether> at_first = at_estimate;
  const std::vector<SimulatedTogether> cells = {{1, motion_cost(kGraspsHalved, 1)},
                                                {1, motion_cost(kSheetHalved, 1)}};
  if (solver_check) at_first.push_back({1, motion_cost(1, 4)});
  if (other_cells) at_first.insert(at_first.end(), cells.begin(), cells.end());
  const double follow = other_cells ? kFollow * time_together(cells, threads) : 0;

  ExpectedWork work;
  // First what is predictable, and how finer cells move the best candidate.
  work.first_look = time_together({{2 + searched, 1}}, threads) + time_together({{1, finer}}, threads) +
                    time_together(at_first, threads) + looks + follow;
  work.end = time_together({{1, 1}}, threads) + time_together({{1, finer}}, threads);
  if (most_motions(grid.axes).first == 0) return work;
  const double own_motions = std::min(std::pow(3, searched), static_cast<double>(few_motions(grid.axes))),
               finer_motions = std::min(std::pow(2, searched), own_motions);
  work.lattice = time_together({{own_motions, 1}}, threads) +
                 (solver_check ? time_together({{finer_motions, finer}}, threads) : 0) +
                 time_together(at_estimate, threads) + looks + follow;
  work.lattices = 0.5 + searched;
  return work;
}

}  // namespace

ExpectedWork expected_work(const std::vector<Replay>& replays, const GridSettings& grid, bool solver_check,
                           const std::vector<double>& values) {
  const std::vector<Replay> smaller =
      solver_check ? on_cells_for_fold(replays, candidate_at(values, grid)) : std::vector<Replay>();
  if (smaller.empty()) return work_on(replays, grid, solver_check);
  const double each = motion_cost(vertices_of(smaller) / vertices_of(replays), 1);
  const ExpectedWork there = work_on(smaller, grid, true);
  ExpectedWork work = work_on(replays, grid, false);  // the first look, at the motions of the search
  // One lattice more, which has all errors of the solution.
  work.lattices = there.lattices + 1;
  work.lattice = each * (there.lattice + there.first_look / work.lattices);
  work.end = each * there.end;
  return work;
}

std::vector<double> middle_of(const std::vector<Axis>& axes) {
  std::vector<double> values;
  for (const Axis& axis : axes) {
    const auto [least, most] = std::minmax_element(axis.values.begin(), axis.values.end());
    values.push_back(axis.logarithmic ? std::sqrt(*least * *most) : (*least + *most) / 2);
  }
  return values;
}

}  // namespace flash::sysid
