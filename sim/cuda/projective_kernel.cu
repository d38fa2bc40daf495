#include "sim/cuda/projective_kernel.h"

#include <algorithm>
#include <new>

#include "sim/cuda/chip_memory.cuh"
#include "sim/cuda/common_value.cuh"
#include "sim/cuda/launch.h"
#include "sim/cuda/projective_step.cuh"
#include "sim/cuda/waiting_environments.cuh"

namespace flash::sim::cuda {
namespace {

/// Positions of an environment in the order of the mesh.
__device__ void keep(const ReplayNumbers& replay, const Point* positions, double* kept) {
  for (int i = team_rank(); i < replay.sheet.size; i += team_size()) {
    double* to = kept + 3L * replay.order[i];
    const Point from = positions[i];
    to[0] = from.x;
    to[1] = from.y;
    to[2] = from.z;
  }
}

/// What the threads of a block have in common.
template <Keeping keeping>
struct CommonState {
  CommonValue<ProjectiveNumbers> numbers;
  CommonValue<ProjectiveMemory> memory;
  CommonValue<ProjectiveWork<keeping>> work;
  CommonValue<ReplayMaterial> material;
  CommonValue<StepProblem> step;
};

/// Copies words of 16 bytes; for all threads of the block.
__device__ inline void fetch(const uint4* from, int words, uint4* to) {
  for (int k = static_cast<int>(threadIdx.x); k < words; k += block_threads) to[k] = from[k];
}

/// What an environment is worked on with; its first tiles go to the chip.
template <int parts, Keeping keeping>
__device__ const ProjectiveWork<keeping>& begin_environment(CommonState<keeping>& common, int e) {
  const ProjectiveNumbers& numbers = common.numbers.get();
  const ProjectiveMemory& memory = common.memory.get();
  const int size = numbers.replay.sheet.size;
  const long factor = numbers.factor_of[e];
  const uint4* tiles = numbers.tiles + factor * numbers.solve.tiles * 32 * parts;
  fetch(tiles, 32 * parts * numbers.near_tiles,
        reinterpret_cast<uint4*>(shared_memory<char>() + numbers.tiles_at));
  return common.work.write([&](ProjectiveWork<keeping>& work) {
    new (&work) ProjectiveWork<keeping>{
        numbers,
        memory,
        {numbers.solve, numbers.solve_at, memory.solve, tiles, numbers.tiles_at, numbers.near_tiles},
        {numbers.places_at, memory.places, size},
        numbers.vertices + factor * size,
        shared_memory<double>()};
  });
}

/// Takes an environment from its step `first` up to `end`.
template <int parts, Keeping keeping>
__device__ void advance(CommonState<keeping>& common, int e, int first, int end) {
  const ReplayNumbers& replay = common.numbers.get().replay;
  const ProjectiveWork<keeping>& w = begin_environment<parts>(common, e);
  const ProjectiveMemory& memory = w.memory;
  const int size = replay.sheet.size;
  const SheetState state = replay.states.of(e, size, replay.most_obstacles_each);
  const ReplayMaterial& material =
      common.material.write([&](ReplayMaterial& own) { own = replay.materials[e]; });
  StepProblem& step = common.step.write([&](StepProblem& own) {
    own = {&material,
           replay.time_step,
           {},
           state.positions,
           state.velocities,
           state.bristles,
           size,
           replay.loads == nullptr ? nullptr : replay.loads + static_cast<long>(size) * e,
           {},
           memory.held_axes,
           0,
           {},
           {},
           {}};
  });
  PhaseClock{memory.clocks}.start();
  for (int at = first; at < end; ++at) {
    const long place = at - replay.waiting.begins[e];
    const long row = static_cast<long>(replay.motions[e]) * replay.motion_steps + place;
    const int* starts = replay.hold_starts + row;
    const ProjectiveMotion motion = {
        replay.holds + starts[0],
        starts[1] - starts[0],
        replay.hold_forces + 3L * replay.hold_count * (static_cast<long>(replay.stats_each) * e + place),
        replay.obstacles + static_cast<long>(replay.most_obstacles_each) * e,
        material.obstacle_count,
        material.several,
        replay.poses + row * replay.frames};
    const ReplayStats stats = advance_step<parts>(w, step, motion, state);
    if (team_rank() == 0) replay.stats[static_cast<long>(replay.stats_each) * e + place] = stats;
    const int kept = replay.kept_count > 0 ? replay.kept_index[at - replay.kept_begin] : -1;
    if (kept >= 0)
      keep(replay, state.positions,
           replay.kept + 3L * size * (static_cast<long>(replay.kept_count) * e + kept));
  }
  count_phase(w, ProjectivePhase::rest);
}

/// A team takes an environment through some steps, and then the one that is furthest behind.
template <int parts, Keeping keeping>
__global__ void __launch_bounds__(block_threads, 1)
    projective_kernel(const __grid_constant__ ProjectiveNumbers given) {
  __shared__ CommonState<keeping> common;
  const ProjectiveNumbers& numbers = common.numbers.write([&](ProjectiveNumbers& own) { own = given; });
  const ProjectiveMemory& memory =
      common.memory.write([&](ProjectiveMemory& own) { own = given.teams[team_index()]; });
  // What is padding in vectors stays zero.
  int* chip = shared_memory<int>();
  const int words = given.tiles_at / static_cast<int>(sizeof(int));
  for (int k = static_cast<int>(threadIdx.x); k < words; k += block_threads) chip[k] = 0;
  __syncthreads();
  constexpr bool on_chip = keeping != Keeping::memory;
  if (on_chip || block_of_team() == 0)
    fetch(given.solve_tables, given.solve.right / static_cast<int>(sizeof(uint4)),
          reinterpret_cast<uint4*>(on_chip ? shared_memory<char>() + given.solve_at : memory.solve));
  const ReplayNumbers& replay = numbers.replay;
  while (true) {
    synchronize_team();
    int first = 0;
    const int e = take(replay.waiting, &first);
    if (e < 0) return;
    const int interval = replay.restart_interval,
              end = min(replay.waiting.ends[e], (first / interval + 1) * interval);
    advance<parts>(common, e, first, end);
    synchronize_team();
    if (team_rank() == 0) give_back(replay.waiting, e, end, end - first);
  }
}

constexpr int sum_bytes = static_cast<int>(sizeof(double)) * (most_sums * seats);

int bytes_of(const ProjectiveNumbers& numbers, int parts) {
  return numbers.tiles_at + numbers.near_tiles * parts * solve_tile_bytes<half_parts>;
}

using Kernel = void(ProjectiveNumbers);

template <int parts>
Kernel* kernel_for(Keeping keeping) {
  if (keeping == Keeping::one_block) return projective_kernel<parts, Keeping::one_block>;
  if (keeping == Keeping::each_block) return projective_kernel<parts, Keeping::each_block>;
  return projective_kernel<parts, Keeping::memory>;
}

Kernel* kernel_for(const ProjectiveNumbers& numbers, InversePrecision precision, int blocks) {
  const Keeping keeping = !numbers.on_chip ? Keeping::memory
                          : blocks == 1    ? Keeping::one_block
                                           : Keeping::each_block;
  return precision == InversePrecision::half ? kernel_for<1>(keeping) : kernel_for<2>(keeping);
}

}  // namespace

void place_on_chip(ProjectiveNumbers& numbers, InversePrecision precision, int blocks) {
  constexpr int alignment = 128;
  const int parts = parts_of(precision);
  // What the kernel and the device have on chip besides.
  const int reserved = 1024 + rounded_up(static_cast<int>(sizeof(CommonState<Keeping::memory>)), alignment);
  const int room = most_memory() - reserved;
  const int places = 2 * static_cast<int>(sizeof(Four<float>)) * numbers.replay.sheet.size;
  numbers.places_at = rounded_up(sum_bytes, alignment);
  numbers.solve_at = numbers.places_at + rounded_up(places, alignment);
  numbers.tiles_at = numbers.solve_at + rounded_up(numbers.solve.bytes, alignment);
  numbers.on_chip = numbers.tiles_at <= room;
  if (!numbers.on_chip) numbers.tiles_at = numbers.places_at;
  // The first-level cache has vectors in memory to hold, and is left half.
  const int room_for_tiles = (room - numbers.tiles_at) / (numbers.on_chip ? 1 : 2),
            tiles = room_for_tiles / (parts * solve_tile_bytes<half_parts>);
  numbers.near_tiles = blocks == 1 ? std::clamp(tiles, 0, numbers.solve.tiles) : 0;
}

int projective_team_blocks(ProjectiveNumbers numbers, InversePrecision precision, int environments) {
  // With fewer vertices a block the barriers of a team take longer than what it saves.
  if (!launches_clusters()) return 1;
  for (int blocks = most_team_blocks; blocks > 1; blocks /= 2) {
    const int least_vertices = blocks == 2 ? 1000 : 500;
    if (numbers.replay.sheet.size < least_vertices * blocks) continue;
    place_on_chip(numbers, precision, blocks);
    if (resident_projective_teams(numbers, precision, blocks) >= environments) return blocks;
  }
  return 1;
}

int resident_projective_teams(const ProjectiveNumbers& numbers, InversePrecision precision, int blocks) {
  return resident_teams(kernel_for(numbers, precision, blocks), bytes_of(numbers, parts_of(precision)),
                        blocks);
}

void run_projective(const ProjectiveNumbers& numbers, InversePrecision precision, int teams, int blocks,
                    cudaStream_t stream) {
  launch(kernel_for(numbers, precision, blocks),
         TeamLaunch(teams, blocks, bytes_of(numbers, parts_of(precision)), stream), numbers);
}

}  // namespace flash::sim::cuda
