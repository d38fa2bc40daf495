#include "sim/cuda/replay_kernel.h"

#include <algorithm>

#include "sim/cuda/environment_steps.cuh"
#include "sim/cuda/launch.h"
#include "sim/cuda/waiting_environments.cuh"

namespace flash::sim::cuda {
namespace {

static_assert(sizeof(CommonState) <= common_memory);

/// A team takes an environment through some steps and then takes the one with the most work left. So none
/// waits for another, and all end at nearly the same time.
__global__ void __launch_bounds__(block_threads, resident_blocks_each)
    replay_kernel(const __grid_constant__ ReplayNumbers given) {
  __shared__ CommonState common;
  const ReplayNumbers& replay = common.replay.write([&](ReplayNumbers& own) { own = given; });
  const TeamMemory& memory = common.memory.write([&](TeamMemory& own) { own = given.teams[team_index()]; });
  while (true) {
    synchronize_team();
    int first = 0;
    const int e = take(replay.waiting, &first);
    if (e < 0) return;
    const int last = replay.waiting.ends[e], interval = replay.restart_interval;
    int end = min(last, (first / turn_steps + 1) * turn_steps);
    if (interval > 0) end = min(end, (first / interval + 1) * interval);
    const int work = advance(common, e, first, end);
    count_phase(memory, ReplayPhase::rest);
    synchronize_team();
    if (team_rank() == 0) give_back(replay.waiting, e, work < 0 ? last : end, work);
  }
}

int linear_bytes_of(int solve_depth) { return linear_partial_bytes + solve_memory<half_parts>(solve_depth); }

/// What a team needs in any case, and as much as leaves room for as many teams as there are registers for.
int bytes_of(const FrontTables& fronts) {
  constexpr int number = sizeof(float);
  // What the device and the kernel have on chip besides, for each team.
  constexpr int reserved = 1024 + (static_cast<int>(sizeof(CommonState)) + 127) / 128 * 128;
  return std::max({gradient_memory(fronts.size, false), hessian_memory * number,
                   number * factor_memory(fronts.shared_panel), linear_bytes_of(fronts.solve_depth),
                   most_memory() / resident_blocks_each - reserved});
}

/// Of a StepRing with so many bytes.
int step_depth_in(int bytes) {
  const int depth = std::min(bytes / step_ring_bytes, most_step_depth);
  return depth < least_step_depth ? 0 : depth;
}

}  // namespace

void place_on_chip(ReplayNumbers& numbers, int blocks) {
  FrontTables& fronts = numbers.fronts;
  const int room = bytes_of(fronts);
  constexpr long number = sizeof(float);
  const long vector = number * fronts.vector_size + 16;
  // What has no room at all leaves it to the chunks.
  const bool solved_fits = linear_bytes_of(1) + vector <= room;
  for (const int depth : {1, 2, chunks_ahead})
    if (linear_bytes_of(depth) + (solved_fits ? vector : 0) <= room) fronts.solve_depth = depth;
  const int near = gradient_memory(fronts.size, true), triangles = numbers.sheet.triangle_count;
  numbers.places_on_chip = near <= room;
  // What triangles give is read by other threads, of other blocks too.
  numbers.gradient_shares_at = blocks == 1 && near + gradient_share_memory(triangles) <= room ? near : -1;
  numbers.matrix_shares_on_chip =
      blocks == 1 && static_cast<int>(sizeof(float)) * hessian_memory_with_shares(triangles) <= room;
  // At the end; products have what is before it to themselves.
  numbers.solved_at = solved_fits ? (room - static_cast<int>(number * fronts.vector_size)) / 16 * 16 : -1;
  int used = linear_partial_bytes;
  const int end = solved_fits ? numbers.solved_at : room, search = 4 * static_cast<int>(number) * fronts.size;
  numbers.search_at = used + search <= end ? used : -1;
  if (numbers.search_at >= 0) used += search;
  numbers.step_ring_at = used;
  numbers.step_depth = step_depth_in(end - used);
  numbers.gradient_ring_at = rounded_up(gradient_memory(fronts.size, numbers.places_on_chip), 16);
  numbers.gradient_depth = step_depth_in(room - numbers.gradient_ring_at);
}

int resident_replay_teams(const FrontTables& fronts, int blocks) {
  return resident_teams(replay_kernel, bytes_of(fronts), blocks);
}

void run_replay(const ReplayNumbers& numbers, int teams, int blocks, cudaStream_t stream) {
  launch(replay_kernel, TeamLaunch(teams, blocks, bytes_of(numbers.fronts), stream), numbers);
}

}  // namespace flash::sim::cuda
