#include "sysid/memory_estimate.h"

#include <algorithm>
#include <cmath>

#include "data/error.h"
#include "data/text.h"
#include "sysid/motion_model.h"

namespace flash::sysid {
namespace {

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
    solver = std::max(solver, sim::solver_bytes_per_vertex * vertices);
    motion += (replay.steps + 1) * vertices * kBytesPerPosition;
    kept += kept_steps(replay) * vertices * kBytesPerPosition;
  }
  const double candidates = count_candidates(settings.axes);
  const double at_once = std::min<double>(
      {static_cast<double>(settings.threads), static_cast<double>(settings.envs), candidates});
  const bool keeps = !settings.rollouts.empty();
  estimate.simulation = at_once * (solver + motion);
  if (solver_check) estimate.simulation = std::max(estimate.simulation, kFiner * (solver + motion));
  if (solver_check && keeps) estimate.simulation = kFiner * at_once * (solver + motion);
  estimate.steps = estimate.simulation * motion / (solver + motion);
  if (!keeps) return estimate;
  const double finer = solver_check ? count_candidates(thinned(settings.axes)) : 0;
  // Twice while splines are made of what was simulated, first of the search's own mesh, then of the finer
  // one.
  const double own = candidates * kept, half_cell = finer * kFiner * kept;
  estimate.kept = own + std::max(own, 2 * half_cell);
  return estimate;
}

MemoryEstimate estimate_batch(const std::vector<Replay>& replays, std::size_t candidates) {
  MemoryEstimate estimate;
  const auto count = static_cast<double>(candidates);
  for (const Replay& replay : replays) {
    const double threads = std::min<double>(replay.settings.threads, count);
    estimate.simulation =
        std::max(estimate.simulation, threads * sim::solver_bytes_per_vertex * vertices_of(replay));
    estimate.steps += count * (replay.steps + 1) * vertices_of(replay) * kBytesPerPosition;
  }
  estimate.simulation += estimate.steps;
  return estimate;
}

void check_job(const std::vector<Replay>& replays, double candidates, const MemoryEstimate& memory,
               double limit) {
  double work = 0;  // steps of a vertex
  for (const Replay& replay : replays) work += candidates * replay.steps * vertices_of(replay);
  const Replay& first = replays.front();
  const bool many_threads = first.settings.threads > 1;
  if (limit > 0 && memory.total() > limit) {
    const auto megabytes = [](double bytes) {
      return data::format_count(static_cast<std::size_t>(std::min(std::ceil(bytes / 1e6), 1e15)));
    };
    std::string remedy = memory.kept > memory.simulation        ? "fewer values or a coarser --mesh"
                         : 2 * memory.steps > memory.simulation ? "a longer --time-step or a coarser --mesh"
                                                                : "a coarser --mesh";
    if (many_threads) remedy += " or fewer --threads";
    throw data::InputError("about " + megabytes(memory.total()) +
                           " MB of memory are needed, expected at most the " + megabytes(limit) +
                           " MB that there are: use " + remedy);
  }
  // Faster than any machine: the refusal must be certain.
  constexpr double kWorkPerSecond = 1e7, kLongest = 365 * 86400.0;
  const double seconds = work / (kWorkPerSecond * std::max(1, first.settings.threads));
  if (seconds <= kLongest) return;
  throw data::InputError(
      data::format_short(candidates) + " candidates of " +
      data::format_count(static_cast<std::size_t>(first.steps)) + " steps of " +
      data::format_count(static_cast<std::size_t>(vertices_of(first))) + " vertices take more than " +
      data::format_short(seconds / kLongest) + " years: use " +
      (candidates > first.steps ? "fewer values" : "a longer --time-step") + " or a coarser --mesh");
}

}  // namespace flash::sysid
