#include "sysid/emulate/search_memory.h"

#include <algorithm>

#include "sysid/emulate/focused_axes.h"
#include "sysid/emulate/search_warnings.h"
#include "sysid/emulate/two_mesh_motions.h"
#include "sysid/replay/coarse_cells.h"
#include "sysid/replay/half_cell.h"

namespace flash::sysid {

namespace {

/// A keyframe: fields of the likelihoods at hand [bytes]. Work: for the memory that is told.
constexpr double kLikelihood = 1e6;
/// Motions about the estimate that are kept, of the search's own mesh. Work: likewise.
constexpr double kAtEstimate = 14;
/// And of the answer's mesh: what errors are of, and how each moves the sheet. Work: likewise.
constexpr double kOfErrors = 48;
/// Vertices of the mesh of half the cell, over those of the search's; what a solver of it takes, over that.
/// Work: likewise.
constexpr double kFiner = 4, kFinerSolid = 8, kFinerSolver = 4, kFinerSolidSolver = 16;

double kept_steps(const Replay& replay) {
  const std::vector<bool> read = steps_read(replay, replay.start, replay.settings.solver.time_step,
                                            static_cast<std::size_t>(replay.steps) + 1);
  return static_cast<double>(std::count(read.begin(), read.end(), true));
}

/// Of the estimate on other cells of the sheet, which are in work side by side: those with half and, where
/// cells may be coarse, a quarter of the cells [bytes].
double other_cells_bytes(const std::vector<Replay>& replays, const GridSettings& settings) {
  std::vector<double> factors = {kFiner, 1};  // vertices of each, over those of the search's mesh
  if (coarse_cells(replays, limpest_candidate(settings))) factors = {kFiner * kFiner, kFiner, kFiner, 1};
  double bytes = 0;
  int threads = settings.threads;
  for (const double factor : factors)
    for (const Replay& replay : replays) {
      bytes += factor * motion_bytes(replay);
      if (threads-- > 0) bytes += factor * solver_bytes(replay);
    }
  return bytes;
}

}  // namespace

MemoryEstimate estimate_memory(const std::vector<Replay>& replays, const GridSettings& settings,
                               bool solver_check) {
  MemoryEstimate estimate;
  double motion = 0, solver = 0, kept = 0, keyframes = 0;
  for (const Replay& replay : replays) {
    const double vertices = vertices_of(replay);
    solver = std::max(solver, solver_bytes(replay));
    motion += 2 * motion_bytes(replay);  // in its batch, and until all recordings are scored
    keyframes += static_cast<double>(
        std::count_if(replay.observations.begin(), replay.observations.end(),
                      [](const Observation& observation) { return observation.weight > 0; }));
    kept += kept_steps(replay) * vertices * bytes_per_position;
  }
  const double candidates = count_candidates(settings.axes);
  const bool solid = replays.front().recording.is_solid();
  const double vertices_finer = solid ? kFinerSolid : kFiner,
               solver_finer = solid ? kFinerSolidSolver : kFinerSolver;
  const double at_once = std::min<double>(settings.envs, candidates);
  const double threads = std::min<double>(settings.threads, at_once);
  estimate.steps = at_once * motion;
  estimate.simulation = threads * solver + estimate.steps;
  if (solver_check) {
    estimate.steps = std::max(estimate.steps, vertices_finer * at_once * motion);
    estimate.simulation =
        std::max(estimate.simulation, solver_finer * threads * solver + vertices_finer * at_once * motion);
    if (are_graded(replays))
      estimate.simulation = std::max(estimate.simulation, other_cells_bytes(replays, settings));
  }
  const std::vector<Axis> emulated = most_focused(settings.axes);
  const double finer = solver_check ? count_candidates(thinned(emulated)) : 0;
  // Twice while splines are made of what was simulated, first of the search's own mesh, then of the finer
  // one.
  const double own = count_candidates(emulated) * kept, half_cell = finer * vertices_finer * kept;
  const double about_estimate = (kAtEstimate + kOfErrors * (solver_check ? vertices_finer : 1)) * kept;
  estimate.keyframes = kLikelihood * keyframes;
  estimate.kept = own + std::max(own, 2 * half_cell) + about_estimate + estimate.keyframes;
  return estimate;
}

}  // namespace flash::sysid
