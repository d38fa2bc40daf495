#pragma once
#include <new>

#include "sim/cuda/common_value.cuh"
#include "sim/cuda/euler_step.cuh"

namespace flash::sim::cuda {

// Steps of one environment, by whatever team.

/// Positions of an environment in the order of the mesh.
__device__ inline void keep(const ReplayNumbers& replay, const Point* positions, double* kept) {
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

/// What a team works on an environment with.
__device__ inline Work& begin_work(CommonState& common, int e) {
  const ReplayNumbers& replay = common.replay.write([&](ReplayNumbers& own) { own.sheet = own.sheets[e]; });
  const TeamMemory& memory = common.memory.write([&](TeamMemory& own) { own.factor = factor_of(replay, e); });
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
__device__ inline void begin_solver(Work& w, StepProblem& step, const SolverState& kept, int first,
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
__device__ inline bool loses(const ReplayNumbers& replay, const ReplayStats& stats) {
  return !isfinite(stats.residual) || stats.residual > replay.lost_residual;
}

/// The step problem of an environment, before its first step.
__device__ inline StepProblem& begin_problem(CommonState& common, const Work& w, int e,
                                             const SheetState& state) {
  const ReplayNumbers& replay = w.replay;
  const TeamMemory& memory = w.memory;
  const int size = replay.sheet.size;
  const ReplayMaterial& material =
      common.material.write([&](ReplayMaterial& own) { own = replay.materials[e]; });
  PhaseClock{memory.clocks}.start();
  return common.step.write([&](StepProblem& own) {
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
           {},
           {}};
  });
}

/// Row of an environment in what kernels say of its steps.
__device__ inline long stats_row(const ReplayNumbers& replay, int e, int at) {
  return static_cast<long>(replay.stats_each) * e + (at - replay.waiting.begins[e]);
}

/// What moves in step `at` of an environment.
__device__ inline StepMotion motion_of_step(const ReplayNumbers& replay, const ReplayMaterial& material,
                                            int e, int at) {
  const long place = at - replay.waiting.begins[e],
             row = static_cast<long>(replay.motions[e]) * replay.motion_steps + place,
             stats = stats_row(replay, e, at);
  const int* starts = replay.hold_starts + row;
  const int* spring_starts = replay.spring_starts + row;
  return {replay.holds + starts[0],
          starts[1] - starts[0],
          replay.springs + spring_starts[0],
          spring_starts[1] - spring_starts[0],
          replay.stiffness + static_cast<long>(replay.stiffness_each) * e,
          replay.hold_forces + 3 * replay.hold_count * stats,
          replay.obstacle_forces + 3 * replay.most_obstacles_each * stats,
          replay.obstacles + static_cast<long>(replay.most_obstacles_each) * e,
          material.obstacle_count,
          material.several,
          replay.poses + row * replay.frames};
}

/// Takes a motion for the next step.
__device__ inline void begin_motion(Work& w, StepProblem& step, const StepMotion& motion) {
  change_common([&] {
    // A factor does not know springs that come, nor that others have gone.
    if (motion.spring_count != step.springs.count ||
        (motion.spring_count > 0 && motion.held_count != step.held_count))
      w.refactor = true;
    step.springs = {};
    step.restrictions.count = step.held_count = motion.held_count;
  });
}

/// Takes an environment from its step `first` up to `end`, or to that which loses it. Returns the work that
/// it took, or -1 where it is lost.
__device__ inline int advance(CommonState& common, int e, int first, int end) {
  Work& w = begin_work(common, e);
  const ReplayNumbers& replay = w.replay;
  const int size = replay.sheet.size;
  const SheetState state = replay.states.of(e, size, replay.most_obstacles_each);
  StepProblem& step = begin_problem(common, w, e, state);
  begin_solver(w, step, replay.solvers[e], first, state.positions);
  int work = 0;
  bool lost = false;
  for (int at = first; at < end && !lost; ++at) {
    const StepMotion motion = motion_of_step(replay, *step.material, e, at);
    begin_motion(w, step, motion);
    const ReplayStats stats = advance_step(w, step, motion, state);
    work += stats.work();
    lost = loses(replay, stats);
    if (team_rank() == 0) replay.stats[stats_row(replay, e, at)] = stats;
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

}  // namespace flash::sim::cuda
