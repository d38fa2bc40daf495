#include "sim/cuda/replay_kernel.h"

#include <algorithm>
#include <new>

#include "sim/cuda/euler_step.cuh"
#include "sim/cuda/launch.h"
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

/// Room for the obstacles of a step.
struct StepObstacles {
  MovingObstacle<double> of[most_obstacles];
};

/// What the threads of a block have in common.
struct CommonState {
  CommonValue<ReplayNumbers> replay;
  CommonValue<TeamMemory> memory;
  CommonValue<ReplayMaterial> material;
  CommonValue<Work> work;
  CommonValue<StepProblem> step;
  CommonValue<StepObstacles> obstacles;
};
static_assert(sizeof(CommonState) <= common_memory);

/// What a team works on an environment with.
__device__ Work& begin_work(CommonState& common, int e) {
  const ReplayNumbers& replay = common.replay.write([&](ReplayNumbers& own) { own.sheet = own.sheets[e]; });
  const TeamMemory& memory =
      common.memory.write([&](TeamMemory& own) { own.factor = replay.factors + e * replay.factor_numbers; });
  const auto iterate = [&](int k) {
    Iterate at = {};
    at.positions = memory.positions[k];
    at.force = memory.forces[k];
    at.residuals = memory.residuals[k];
    at.contacts = memory.contacts[k];
    return at;
  };
  return common.work.write([&](Work& work) {
    new (&work) Work{replay,     memory,     common.obstacles.get().of, true, iterate(0),
                     iterate(1), iterate(2), memory.contacts[3]};
  });
}

/// Where an environment starts: with what its solver had at the end of the step before, or anew.
__device__ void begin_solver(Work& w, StepProblem& step, const SolverState& kept, int first,
                             const Point* positions) {
  const int interval = w.replay.restart_interval;
  if (kept.step == first && (interval == 0 || first % interval != 0)) {
    change_common([&] {
      w.refactor = kept.refactor != 0;
      step.at_start = kept.at_start;
      step.springs.count = kept.spring_count;
      step.held_count = kept.held_count;
    });
    return;
  }
  for (int i = team_rank(); i < step.size; i += team_size()) w.now.positions[i] = positions[i];
  evaluate(w, step, nullptr, w.now);
  change_common([&] { step.at_start = w.now.elastic; });
}

/// Whether a step ended in numbers that are none, or too far from balance to go on.
__device__ bool loses(const ReplayNumbers& replay, const ReplayStats& stats) {
  return !isfinite(stats.residual) || stats.residual > replay.lost_residual;
}

/// Takes an environment from its step `first` up to `end`, or to that which loses it. Returns the work that
/// it took, or -1 where it is lost.
__device__ int advance(CommonState& common, int e, int first, int end) {
  Work& w = begin_work(common, e);
  const ReplayNumbers& replay = w.replay;
  const TeamMemory& memory = w.memory;
  const int size = replay.sheet.size;
  const SheetState state = replay.states.of(e, size, replay.most_obstacles_each);
  const ReplayMaterial& material =
      common.material.write([&](ReplayMaterial& own) { own = replay.materials[e]; });
  PhaseClock{memory.clocks}.start();
  StepProblem& step = common.step.write([&](StepProblem& own) {
    own = {&material,
           replay.time_step,
           {material.law, material.lame, material.rigidity, 0},
           state.positions,
           state.velocities,
           state.bristles,
           size,
           replay.loads == nullptr ? nullptr : replay.loads + static_cast<long>(size) * e,
           {memory.restrictions, 0, memory.restriction_of,
            material.obstacle_count > 0 ? memory.projectors : nullptr, size},
           memory.held_axes,
           0,
           {},
           {},
           {}};
  });
  begin_solver(w, step, replay.solvers[e], first, state.positions);
  int work = 0;
  bool lost = false;
  for (int at = first; at < end && !lost; ++at) {
    const long place = at - replay.waiting.begins[e],
               row = static_cast<long>(replay.motions[e]) * replay.motion_steps + place,
               stats_row = static_cast<long>(replay.stats_each) * e + place;
    const int* starts = replay.hold_starts + row;
    const int* spring_starts = replay.spring_starts + row;
    const StepMotion motion = {replay.holds + starts[0],
                               starts[1] - starts[0],
                               replay.springs + spring_starts[0],
                               spring_starts[1] - spring_starts[0],
                               replay.stiffness + static_cast<long>(replay.stiffness_each) * e,
                               replay.hold_forces + 3 * replay.hold_count * stats_row,
                               replay.obstacle_forces + 3 * replay.most_obstacles_each * stats_row,
                               replay.obstacles + static_cast<long>(replay.most_obstacles_each) * e,
                               material.obstacle_count,
                               material.several,
                               replay.poses + row * replay.frames};
    change_common([&] {
      // A factor does not know springs that come, nor that others have gone.
      if (motion.spring_count != step.springs.count ||
          (motion.spring_count > 0 && motion.held_count != step.held_count))
        w.refactor = true;
      step.springs = {};
      step.restrictions.count = step.held_count = motion.held_count;
    });
    const ReplayStats stats = advance_step(w, step, motion, state);
    work += stats.work();
    lost = loses(replay, stats);
    if (team_rank() == 0) replay.stats[stats_row] = stats;
    const int kept = replay.kept_count > 0 ? replay.kept_index[at - replay.kept_begin] : -1;
    if (kept >= 0)
      keep(replay, state.positions,
           replay.kept + 3L * size * (static_cast<long>(replay.kept_count) * e + kept));
  }
  if (team_rank() == 0)
    replay.solvers[e] = {lost ? -1 : end, w.refactor ? 1 : 0, step.springs.count, step.held_count,
                         step.at_start};
  return lost ? -1 : work;
}

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
