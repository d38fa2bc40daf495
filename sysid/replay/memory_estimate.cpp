#include "sysid/replay/memory_estimate.h"

#include <algorithm>
#include <cmath>

#include "data/files/error.h"
#include "data/files/text.h"
#include "sim/newton/solver_memory.h"

namespace flash::sysid {
double vertices_of(const Replay& replay) { return static_cast<double>(replay.sheet().rest.vertices.rows()); }

double solver_bytes(const Replay& replay) { return sim::solver_bytes(replay.sheet()); }

double motion_bytes(const Replay& replay, bool all_steps) {
  const double positions = all_steps ? replay.steps + 1 : static_cast<double>(scored_steps(replay).size());
  const double a_step = sizeof(sim::StepStats) +
                        2 * bytes_per_position * static_cast<double>(1 + replay.recording.grasps.size());
  return positions * vertices_of(replay) * bytes_per_position + replay.steps * a_step;
}

MemoryEstimate estimate_batch(const std::vector<Replay>& replays, std::size_t candidates, bool all_steps) {
  MemoryEstimate estimate;
  const auto count = static_cast<double>(candidates);
  for (const Replay& replay : replays) {
    const double threads = std::min<double>(replay.settings.threads, count);
    const double at_once = std::min<double>(replay.settings.envs, count);
    estimate.simulation = std::max(estimate.simulation, threads * solver_bytes(replay));
    estimate.steps += (count + at_once) * motion_bytes(replay, all_steps);
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
    std::string remedy = 2 * memory.keyframes > memory.total()
                             ? "fewer keyframes: a shorter --from to --until, or fewer times of the tracks"
                         : memory.kept > memory.simulation      ? "fewer values or a coarser --mesh"
                         : 2 * memory.steps > memory.simulation ? "a longer --time-step or a coarser --mesh"
                                                                : "a coarser --mesh";
    if (many_threads) remedy += " or fewer --threads";
    throw data::InputError("about " + megabytes(memory.total()) +
                           " MB of memory are needed, expected at most the " + megabytes(limit) +
                           " MB that there are: use " + remedy);
  }
  // Vertices times steps a second, faster than any machine, and the longest search [s]. Work: the refusal
  // must be certain.
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
