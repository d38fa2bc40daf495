#include "sysid/memory_estimate.h"

#include <unistd.h>

#include <algorithm>

#include "sysid/motion_model.h"

namespace flash::sysid {
namespace {

// Measured on sheets of 250 to 4,000 vertices: matrix, factor, contact and their work space.
constexpr double kSolverBytesPerVertex = 14e3;
constexpr double kBytesPerPosition = 3 * sizeof(double);
constexpr double kFiner = 4;  // vertices of the mesh of half the cell, over those of the search's

double vertices_of(const Replay& replay) { return static_cast<double>(replay.sheet.rest.vertices.rows()); }

double kept_steps(const Replay& replay) {
  const std::vector<bool> read = steps_read(replay, replay.start, replay.settings.solver.time_step,
                                            static_cast<std::size_t>(replay.steps) + 1);
  return static_cast<double>(std::count(read.begin(), read.end(), true));
}

}  // namespace

MemoryEstimate estimate_memory(const std::vector<Replay>& replays, const GridSettings& settings,
                               bool solver_check) {
  MemoryEstimate estimate;
  double motion = 0, solver = 0, kept = 0;
  for (const Replay& replay : replays) {
    const double vertices = vertices_of(replay);
    solver = std::max(solver, kSolverBytesPerVertex * vertices);
    motion += (replay.steps + 1) * vertices * kBytesPerPosition;
    kept += kept_steps(replay) * vertices * kBytesPerPosition;
  }
  const auto candidates = static_cast<double>(cartesian_product(settings.axes).size());
  const double at_once = std::min<double>(
      {static_cast<double>(settings.threads), static_cast<double>(settings.envs), candidates});
  const bool keeps = !settings.rollouts.empty();
  estimate.simulation = at_once * (solver + motion);
  if (solver_check) estimate.simulation = std::max(estimate.simulation, kFiner * (solver + motion));
  if (solver_check && keeps) estimate.simulation = kFiner * at_once * (solver + motion);
  if (!keeps) return estimate;
  const double finer =
      solver_check ? static_cast<double>(cartesian_product(thinned(settings.axes)).size()) : 0;
  // Twice while splines are made of what was simulated, first of the search's own mesh, then of the finer
  // one.
  const double own = candidates * kept, half_cell = finer * kFiner * kept;
  estimate.kept = own + std::max(own, 2 * half_cell);
  return estimate;
}

double physical_memory() {
  const long pages = sysconf(_SC_PHYS_PAGES), size = sysconf(_SC_PAGE_SIZE);
  return pages > 0 && size > 0 ? static_cast<double>(pages) * static_cast<double>(size) : 0;
}

}  // namespace flash::sysid
