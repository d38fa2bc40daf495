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

/// Copies the first tiles of an environment to the chip.
template <int parts>
__device__ void fetch_tiles(const ProjectiveNumbers& numbers, const uint4* tiles, uint4* on_chip) {
  constexpr int words = 32 * parts;
  for (int k = static_cast<int>(threadIdx.x); k < words * numbers.tiles_on_chip; k += block_threads)
    copy_to_chip<16>(chip_address(on_chip + k), tiles + k);
  end_copies();
  wait_for_copies<0>();
  __syncthreads();
}

/// The tables of the inverse, on chip where there is room: what follows the pointers one after the other.
struct ChipTables {
  char* to;

  /// Copies an array; for all threads of the block.
  template <typename Number>
  __device__ void fetch(const Number*& numbers, int count) {
    const int words = count * static_cast<int>(sizeof(Number) / sizeof(int));
    const int* from = reinterpret_cast<const int*>(numbers);
    int* own = reinterpret_cast<int*>(to);
    for (int k = static_cast<int>(threadIdx.x); k < words; k += block_threads) own[k] = from[k];
    numbers = reinterpret_cast<const Number*>(to);
    to += rounded_up(4 * words, 16);
  }
};

/// Bytes of the arrays below.
__host__ __device__ inline int table_bytes(const InverseTables& tables) {
  const int sizes[] = {static_cast<int>(sizeof(InverseNode)) * tables.node_count,
                       static_cast<int>(sizeof(InverseLevel)) * tables.level_count,
                       static_cast<int>(sizeof(InverseTask)) * tables.task_count,
                       4 * tables.below_count,
                       4 * (tables.slots + 1),
                       4 * tables.gathered_count,
                       4 * tables.size,
                       4 * tables.slots};
  int bytes = 0;
  for (const int size : sizes) bytes += rounded_up(size, 16);
  return bytes;
}

__device__ InverseTables tables_on_chip(const ProjectiveNumbers& numbers) {
  InverseTables tables = numbers.inverse;
  if (numbers.tables_at < 0) return tables;
  ChipTables chip = {shared_memory<char>() + numbers.tables_at};
  chip.fetch(tables.nodes, tables.node_count);
  chip.fetch(tables.levels, tables.level_count);
  chip.fetch(tables.tasks, tables.task_count);
  chip.fetch(tables.below, tables.below_count);
  chip.fetch(tables.gather_starts, tables.slots + 1);
  chip.fetch(tables.gathered, tables.gathered_count);
  chip.fetch(tables.slot_of, tables.size);
  chip.fetch(tables.place_at, tables.slots);
  return tables;
}

/// What the threads of a block have in common.
struct CommonState {
  CommonValue<ProjectiveNumbers> numbers;
  CommonValue<ProjectiveMemory> memory;
  CommonValue<InverseTables> tables;
  CommonValue<ProjectiveWork> work;
  CommonValue<ReplayMaterial> material;
  CommonValue<StepProblem> step;
};

/// What an environment is worked on with; its tiles and scale go to the chip.
template <int parts>
__device__ const ProjectiveWork& begin_environment(CommonState& common, int e) {
  const ProjectiveNumbers& numbers = common.numbers.get();
  const ProjectiveMemory& memory = common.memory.get();
  const InverseTables& tables = common.tables.get();
  char* chip = shared_memory<char>();
  const long factor = numbers.factor_of[e];
  const uint4* tiles = numbers.tiles + factor * tables.tiles * 32 * parts;
  uint4* on_chip = reinterpret_cast<uint4*>(chip + numbers.tiles_at);
  const float* scale = numbers.scale + factor * tables.slots;
  if (numbers.scale_at >= 0) ChipTables{chip + numbers.scale_at}.fetch(scale, tables.slots);
  if (numbers.tiles_on_chip > 0) fetch_tiles<parts>(numbers, tiles, on_chip);
  return common.work.write([&](ProjectiveWork& work) {
    const auto split = [&](int at, __half* otherwise) {
      return SplitVector{at >= 0 ? reinterpret_cast<__half*>(chip + at) : otherwise};
    };
    float* passed =
        numbers.passed_at >= 0 ? reinterpret_cast<float*>(chip + numbers.passed_at) : memory.passed;
    new (&work) ProjectiveWork{
        numbers,
        memory,
        {tables, tiles, on_chip, numbers.tiles_on_chip, scale, split(numbers.right_at, memory.right),
         split(numbers.solved_at, memory.solved), passed},
        shared_memory<double>(),
        e};
  });
}

/// Takes an environment from its step `first` up to `end`.
template <int parts>
__device__ void advance(CommonState& common, int e, int first, int end) {
  const ReplayNumbers& replay = common.numbers.get().replay;
  const ProjectiveWork& w = begin_environment<parts>(common, e);
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
    const long place = at - replay.stats_begin;
    const long row = static_cast<long>(material.motion) * replay.motion_steps + place;
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
    const int kept = replay.kept_index[place];
    if (kept >= 0)
      keep(replay, state.positions,
           replay.kept + 3L * size * (static_cast<long>(replay.kept_count) * e + kept));
  }
  count_phase(w, ProjectivePhase::rest);
}

/// A team takes an environment through some steps, and then the one that is furthest behind.
template <int parts>
__global__ void __launch_bounds__(block_threads, 1)
    projective_kernel(const __grid_constant__ ProjectiveNumbers given) {
  __shared__ CommonState common;
  const ProjectiveNumbers& numbers = common.numbers.write([&](ProjectiveNumbers& own) { own = given; });
  common.memory.write([&](ProjectiveMemory& own) { own = given.teams[team_index()]; });
  // What is padding in vectors stays zero.
  int* chip = shared_memory<int>();
  const int words = given.tiles_at / static_cast<int>(sizeof(int));
  for (int k = static_cast<int>(threadIdx.x); k < words; k += block_threads) chip[k] = 0;
  __syncthreads();
  const InverseTables near = tables_on_chip(given);
  common.tables.write([&](InverseTables& own) { own = near; });
  const ReplayNumbers& replay = numbers.replay;
  while (true) {
    synchronize_team();
    int first = 0;
    const int e = take(replay.waiting, &first);
    if (e < 0) return;
    const int interval = replay.restart_interval,
              end = min(replay.waiting.end, (first / interval + 1) * interval);
    advance<parts>(common, e, first, end);
    synchronize_team();
    if (team_rank() == 0) give_back(replay.waiting, e, end, end - first);
  }
}

constexpr int sum_bytes = static_cast<int>(sizeof(double)) * (most_sums * seats);

int bytes_of(const ProjectiveNumbers& numbers, int parts) {
  return numbers.tiles_at + numbers.tiles_on_chip * parts * solve_tile_bytes<half_parts>;
}

}  // namespace

void place_on_chip(ProjectiveNumbers& numbers, InversePrecision precision, int blocks) {
  const int parts = parts_of(precision), most = most_memory();
  const InverseTables& inverse = numbers.inverse;
  // What the kernel and the device have on chip besides.
  const int reserved = 1024 + rounded_up(static_cast<int>(sizeof(CommonState)), 128);
  int used = sum_bytes;
  const auto place = [&](int bytes, bool wanted) {
    if (!wanted || used + bytes > most - reserved) return -1;
    const int at = used;
    used += rounded_up(bytes, 128);
    return at;
  };
  const bool alone = blocks == 1;
  const int split = static_cast<int>(sizeof(__half)) * 6 * (inverse.slots + inverse_tile);
  // Places stand right behind the sums (elastic_gradient.cuh).
  const int places = 3 * static_cast<int>(sizeof(double)) * inverse.size;
  numbers.places_at = place(places, places <= most / 4);
  numbers.right_at = place(split, alone);
  numbers.solved_at = place(split, alone);
  numbers.tables_at = place(table_bytes(inverse), true);
  numbers.scale_at = place(static_cast<int>(sizeof(float)) * inverse.slots, true);
  numbers.passed_at = place(3 * static_cast<int>(sizeof(float)) * inverse.below_count, alone);
  numbers.tiles_at = rounded_up(used, 128);
  // As much is left to the first-level cache.
  const int room = (most - reserved - numbers.tiles_at) / (2 * parts * solve_tile_bytes<half_parts>);
  numbers.tiles_on_chip = alone ? std::max(0, std::min(room, inverse.tiles)) : 0;
}

int projective_team_blocks(ProjectiveNumbers numbers, InversePrecision precision, int environments) {
  if (!launches_clusters()) return 1;
  for (int blocks = most_team_blocks; blocks > 1; blocks /= 2) {
    place_on_chip(numbers, precision, blocks);
    if (resident_projective_teams(numbers, precision, blocks) >= environments) return blocks;
  }
  return 1;
}

int resident_projective_teams(const ProjectiveNumbers& numbers, InversePrecision precision, int blocks) {
  const int parts = parts_of(precision), bytes = bytes_of(numbers, parts);
  return parts == 1 ? resident_teams(projective_kernel<1>, bytes, blocks)
                    : resident_teams(projective_kernel<2>, bytes, blocks);
}

void run_projective(const ProjectiveNumbers& numbers, InversePrecision precision, int teams, int blocks,
                    cudaStream_t stream) {
  const int parts = parts_of(precision);
  const TeamLaunch how(teams, blocks, bytes_of(numbers, parts), stream);
  if (parts == 1)
    launch(projective_kernel<1>, how, numbers);
  else
    launch(projective_kernel<2>, how, numbers);
}

}  // namespace flash::sim::cuda
