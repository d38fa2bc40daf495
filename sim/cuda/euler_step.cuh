#pragma once
#include "sim/cuda/exits.cuh"
#include "sim/cuda/newton_iteration.cuh"
#include "sim/cuda/obstacle_motion.cuh"

namespace flash::sim::cuda {

// One time step of an environment as in sim/newton/solver.h, whole or in halves.

/// What moves by itself in a step.
struct StepMotion {
  const HeldPlace* held;  ///< vertices at its end
  int held_count;
  const SpringPlace* springs;
  int spring_count;
  const double* stiffness;  ///< of springs, by entry [N/m]
  // On the sheet, three numbers a hold and an obstacle, for which this step has zeros [N].
  double *hold_forces, *obstacle_forces;
  const PlacedObstacle* obstacles;
  int obstacle_count;
  bool several;            ///< whether a box stands beside another obstacle
  const FramePose* poses;  ///< of the frames at its start; those at its end follow
};

/// Notes what is held and where it is now; forget_restrictions takes it back.
__device__ inline void begin_holds(const Work& w, const StepProblem& step, const StepMotion& motion,
                                   const Point* positions) {
  for (int k = team_rank(); k < motion.held_count; k += team_size()) {
    const HeldPlace& held = motion.held[k];
    VertexRestriction restriction = {held.place, {}, {}};
    for (int axis = 0; axis < 3; ++axis) restriction.free[4 * axis] = held.axes >> axis & 1 ? 0.0f : 1.0f;
    w.memory.restrictions[k] = restriction;
    if (step.restrictions.projectors != nullptr)
      step.restrictions.set_projector(
          held.place, Symmetric3{restriction.free[0], 0, 0, restriction.free[4], 0, restriction.free[8]});
    w.memory.restriction_of[held.place] = k;
    w.memory.held_axes[held.place] = held.axes;
    const Point from = positions[held.place];
    w.memory.hold_starts[3 * k] = from.x;
    w.memory.hold_starts[3 * k + 1] = from.y;
    w.memory.hold_starts[3 * k + 2] = from.z;
  }
  synchronize_team();
}

__device__ inline void forget_restrictions(const Work& w) {
  synchronize_team();
  for (int i = team_rank(); i < w.replay.sheet.size; i += team_size()) {
    w.memory.restriction_of[i] = -1;
    w.memory.held_axes[i] = 0;
  }
  synchronize_team();
}

/// The positions without forces, held vertices where they have to be: `share` of their way of the whole step.
/// Springs pull as IncrementalPotential::pull of the CPU has it.
__device__ inline void predict(const Work& w, const StepProblem& step, const StepMotion& motion,
                               double share) {
  for (int i = team_rank(); i < w.replay.sheet.size; i += team_size()) {
    const Triple x = triple(step.start[i]) + step.h * triple(step.velocities[i]);
    w.now.positions[i] = {x.x, x.y, x.z, 0};
  }
  synchronize_team();
  for (int k = team_rank(); k < motion.held_count; k += team_size()) {
    const HeldPlace& held = motion.held[k];
    Point& own = w.now.positions[held.place];
    double* places[3] = {&own.x, &own.y, &own.z};
#pragma unroll
    for (int axis = 0; axis < 3; ++axis) {
      const double from = w.memory.hold_starts[3 * k + axis], to = held.target[axis];
      const double way = to - from + (1 - share) * held.bow[axis];
      if (held.axes >> axis & 1) *places[axis] = share == 1 ? to : from + share * way;
    }
  }
  const Springs& springs = step.springs;
  for_sprung_vertices(springs, [&](int first) {
    const int i = springs.list[first].place;
    const double inertia = step.mass(w.replay.sheet, i) / (step.h * step.h);
    Triple whole = {inertia, inertia, inertia}, place = triple(w.now.positions[i]);
    for_springs_of_vertex(springs, first, [&](int k) {
      const Triple own = springs.along_axes(k), way = triple(step.start[i]) + springs.moved(k) - place;
      whole = whole + own;
      place = place + Triple{own.x / whole.x * way.x, own.y / whole.y * way.y, own.z / whole.z * way.z};
    });
    // A hold may carry the vertex along other axes.
    Point& to = w.now.positions[i];
    const int carried = w.memory.held_axes[i];
    if ((carried & 1) == 0) to.x = place.x;
    if ((carried & 2) == 0) to.y = place.y;
    if ((carried & 4) == 0) to.z = place.z;
  });
}

/// Adds what the holds exert in a share of the step.
__device__ inline void add_hold_forces(const Work& w, const StepProblem& step, const StepMotion& motion,
                                       double share) {
  for (int hold = 0; hold < w.replay.hold_count; ++hold) {
    double sums[3];
    sum_over_team(motion.held_count, sums, shared_memory<double>(), [&](int k, double(&own)[3]) {
      const HeldPlace& held = motion.held[k];
      for (int axis = 0; axis < 3; ++axis)
        if ((held.axes >> axis & 1) != 0 && held.holds[axis] == hold)
          own[axis] += w.now.force[3 * held.place + axis];
    });
    if (team_rank() == 0)
      for (int axis = 0; axis < 3; ++axis) motion.hold_forces[3 * hold + axis] += share * sums[axis];
    synchronize_team();
    if (motion.spring_count == 0) continue;
    sum_over_team(motion.spring_count, sums, shared_memory<double>(), [&](int k, double(&own)[3]) {
      const SpringPlace& spring = motion.springs[k];
      if (spring.hold != hold) return;
      const Triple force = step.springs.force(k, triple(w.now.positions[spring.place]));
      for (int axis = 0; axis < 3; ++axis) own[axis] += force[axis];
    });
    if (team_rank() == 0)
      for (int axis = 0; axis < 3; ++axis) motion.hold_forces[3 * hold + axis] += share * sums[axis];
    synchronize_team();
  }
}

/// Adds what the obstacles exert in a share of the step.
static __device__ __noinline__ void add_obstacle_forces(const Work& w, const StepProblem& step,
                                                        const StepMotion& motion, double share) {
  const ContactSet& contacts = w.now.contacts;
  for (int k = 0; k < motion.obstacle_count; ++k) {
    double sums[3];
    sum_over_team(w.replay.sheet.size, sums, shared_memory<double>(), [&](int i, double(&own)[3]) {
      if (step.held_axes[i] != 0 || contacts.listed[i] == 0) return;
      const TouchRecord touch = read(contacts.touches, i, k);
      if ((touch.flags & 1) == 0) return;
      const Triple force =
          touch.normal_force * (touch.normal - w.obstacles[k].friction * touch.slip_direction);
      for (int axis = 0; axis < 3; ++axis) own[axis] += force[axis];
    });
    if (team_rank() == 0)
      for (int axis = 0; axis < 3; ++axis) motion.obstacle_forces[3 * k + axis] += share * sums[axis];
    synchronize_team();
  }
}

struct StepEnd {
  bool sound;              ///< whether its energy came from somewhere, and contact is complementary
  bool finite;             ///< whether all positions are
  double penetration;      ///< deepest vertex below a surface [m]
  double start_depth;      ///< deepest that started inside an obstacle [m]
  double complementarity;  ///< of contact [m]
  double kinetic;          ///< energy [J]
};

/// What springs do over a step.
struct SpringEnd {
  double work;      ///< on the sheet [J]
  double at_start;  ///< their energy with the vertices where they were at its start [J]
};

static __device__ __noinline__ SpringEnd judge_springs(const Work& w, const StepProblem& step,
                                                       double* partial) {
  double sums[2];
  sum_over_team(step.springs.count, sums, partial, [&](int k, double(&own)[2]) {
    const int i = step.springs.list[k].place;
    const Triple start = triple(step.start[i]), end = triple(w.now.positions[i]);
    own[0] += dot(step.springs.force(k, end), end - start);
    own[1] += step.springs.energy(k, start);
  });
  synchronize_team();
  return {sums[0], sums[1]};
}

/// The end of a step, its energy as account_for_energy of the CPU has it.
__device__ inline StepEnd judge_end(const Work& w, const StepProblem& step) {
  const SheetTables& tables = w.replay.sheet;
  const ReplayMaterial& material = *step.material;
  enum {
    kinetic,
    kinetic_at_start,
    falls,
    unbalanced,
    work,
    moved_holds,
    inertial_at_start,
    mass_sum,
    count
  };
  double sums[count];
  sum_over_team(tables.size, sums, shared_memory<double>(), [&](int i, double(&own)[count]) {
    const double mass = step.mass(tables, i);
    const Triple way = triple(w.now.positions[i]) - triple(step.start[i]), speed = triple(step.velocities[i]),
                 residual = force_at(w.now.residuals, i), inertial = step.inertial(i, {0, 0, 0}),
                 held_way = step.held_part(i, way);
    own[kinetic] += 0.5 * mass * dot(way, way);
    own[kinetic_at_start] += 0.5 * mass * dot(speed, speed);
    own[falls] += mass * dot(step.gravity(), way) + dot(step.load(i), way);
    own[unbalanced] += fabs(dot(residual, way));
    own[work] += dot(force_at(w.now.force, i), held_way);
    own[moved_holds] += dot(held_way, held_way) > 0 ? 1 : 0;
    own[inertial_at_start] += 0.5 * mass * dot(inertial, inertial);
    own[mass_sum] += mass;
  });
  synchronize_team();
  const ContactEnd contact = judge_contacts(tables, step, w.now, shared_memory<double>());
  const SpringEnd springs =
      step.springs.count > 0 ? judge_springs(w, step, shared_memory<double>()) : SpringEnd{};
  sums[work] += contact.work + springs.work;
  bool start_is_feasible = sums[moved_holds] == 0 && contact.start_depth == 0;
  for (int k = 0; k < step.obstacles.count; ++k)
    start_is_feasible = start_is_feasible && !step.obstacles.obstacles[k].moves;
  const double per_step = 1 / (step.h * step.h);
  const double stored_at_start = step.at_start.membrane + step.at_start.bending,
               stored_at_end = w.now.elastic.membrane + w.now.elastic.bending;
  const EnergyAccount energy = {
      sums[kinetic_at_start],
      per_step * sums[kinetic],
      stored_at_start,
      stored_at_end,
      sums[falls],
      sums[work],
      sums[unbalanced],
      contact.bristles,
      material.bending_rounding + rounding_of_weight(sums[mass_sum], material.weight_factor) +
          rounding_of_membrane(sums[mass_sum], material.membrane_stiffness, material.areal_density)};
  const bool finite = isfinite(sums[kinetic]);
  const bool complementary = is_complementary(contact.complementarity);
  StepEnd end = {false,
                 finite,
                 contact.penetration,
                 contact.start_depth,
                 contact.complementarity,
                 per_step * sums[kinetic]};
  if (!energy.balances() || !complementary) return end;
  const bool falls_below_start = w.now.potential <= per_step * sums[inertial_at_start] + stored_at_start +
                                                        springs.at_start + energy.allowed();
  end.sound = !start_is_feasible || falls_below_start;
  return end;
}

/// What damping measures from, at the start of a step of h.
__device__ inline void begin_damping(const Work& w, StepProblem& step) {
  const ReplayMaterial& material = *step.material;
  const bool damped = material.stiffness_damping != 0;
  change_common([&] {
    EnvironmentNumbers& numbers = step.numbers;
    numbers = {material.law, material.lame, material.rigidity,
               material.areal_density * (1 / (step.h * step.h) + material.air_drag / step.h)};
    step.damped_since = {};
    if (!damped) return;
    const double share = material.stiffness_damping / step.h;
    numbers.damping = {share * material.damping.mu, share * material.damping.lambda};
    numbers.damping_share = share;
    step.damped_since = {w.memory.start_metrics, w.memory.start_angles};
  });
  if (!damped) return;
  const auto place = [&](int vertex) { return triple(step.start[vertex]); };
  write_metrics(w.replay.sheet, place, w.memory.start_metrics);
  if (w.replay.sheet.hinge_count > 0) write_angles(w.replay.sheet, place, w.memory.start_angles);
  synchronize_team();
}

/// The obstacles from a share of the step to another one.
__device__ inline void begin_obstacles(const Work& w, StepProblem& step, const StepMotion& motion,
                                       double begin, double end) {
  if (motion.obstacle_count == 0) return;
  for_ranks_below(motion.obstacle_count, [&](int k) {
    w.obstacles[k] = placed_between(motion.obstacles[k], motion.poses, w.replay.frames, begin, end);
  });
  synchronize_team();
  change_common([&] {
    bool planes = true;
    for (int k = 0; k < motion.obstacle_count; ++k)
      planes = planes && w.obstacles[k].shape == ObstacleShape::plane;
    step.obstacles = {w.obstacles, motion.obstacle_count,     motion.several,
                      step.h,      {w.replay.exit_speed, {}}, planes};
    step.numbers.own_blocks = w.memory.own_blocks;
  });
}

/// The springs from a share of the step to another one, behind begin_obstacles.
__device__ inline void begin_springs(const Work& w, StepProblem& step, const StepMotion& motion, double begin,
                                     double end) {
  if (motion.spring_count == 0) return;
  change_common([&] {
    step.springs = {motion.springs, motion.spring_count, motion.stiffness, begin, end};
    step.numbers.own_blocks = w.memory.own_blocks;
  });
}

struct PartEnd {
  StepEnd end;
  bool solved;  ///< as well as halves would be
};

/// Solves a part of a step, of which w.now becomes the end, at `share` of the whole.
static __device__ __noinline__ PartEnd solve_part(Work& w, StepProblem& step, const StepMotion& motion,
                                                  double share, ReplayStats& stats) {
  predict(w, step, motion, share);
  project_to_feasible(w.replay.sheet, step, nullptr, w.now.positions);
  evaluate(w, step, nullptr, w.now);
  iterate_to_balance(w, step, stats);
  const double tolerance = w.replay.tolerance;
  const StepEnd end = judge_end(w, step);
  return {end, end.sound &&
                   balanced(step, w.now, tolerance > rounding_tolerance ? tolerance : rounding_tolerance)};
}

/// A sheet that starts inside obstacles takes the first exit that does not tear it: each vertex leaves on its
/// own side, then all by the shortest way, then both slowly; at last it stays. `part`: by the first exit.
static __device__ __noinline__ PartEnd leave_obstacles(Work& w, StepProblem& step, const StepMotion& motion,
                                                       double share, ReplayStats& stats, PartEnd part) {
  const SheetTables& tables = w.replay.sheet;
  const double speed = w.replay.exit_speed;
  const Triple direction = shortest_way_out(tables, step, shared_memory<double>());
  const int ways = is_zero(direction) ? 1 : 2, last = 2 * ways;
  for (int k = 1; k <= last; ++k) {
    if (part.solved && exits_gently(tables, step, w.now.positions, speed)) break;
    // A slower exit does not help an unsolved step, which costs the most: only staying is tried.
    if (!part.solved && k > 1) k = last;
    const double own_speed = k == last ? 0 : k < ways ? speed : slow_exit_share * speed;
    change_common([&] {
      step.obstacles.way_out = {own_speed, k < last && k % ways == 1 ? direction : Triple{}};
      w.refactor = true;
    });
    part = solve_part(w, step, motion, share, stats);
  }
  return part;
}

/// The part of a step from the share `begin` to `end` of it, as a whole. The state advances where it is
/// solved or this is the `last_try`. Returns whether it is solved.
static __device__ bool try_step(Work& w, StepProblem& step, const StepMotion& motion, double begin,
                                double end, const SheetState& state, ReplayStats& stats, bool last_try) {
  begin_damping(w, step);
  begin_obstacles(w, step, motion, begin, end);
  begin_springs(w, step, motion, begin, end);
  PartEnd part = solve_part(w, step, motion, end, stats);
  if (part.end.start_depth > 0) part = leave_obstacles(w, step, motion, end, stats, part);
  const bool solved = part.solved;
  const StepEnd& judged = part.end;
  if (!solved) change_common([&] { w.refactor = true; });
  if (!solved && !last_try) return false;
  // A sheet that is not finite stands still instead.
  const double residual = judged.finite ? w.now.residual / step.material->force_scale : INFINITY;
  if (!(residual <= stats.residual)) stats.residual = residual;
  ++stats.substeps;
  add_hold_forces(w, step, motion, end - begin);
  add_obstacle_forces(w, step, motion, end - begin);
  stats.penetration = worse_of(stats.penetration, judged.penetration);
  stats.complementarity = worse_of(stats.complementarity, judged.complementarity);
  stats.kinetic = judged.kinetic;
  stats.membrane = w.now.elastic.membrane;
  stats.bending = w.now.elastic.bending;
  stats.converged = judged.sound && balanced(step, w.now, w.replay.tolerance);
  for (int i = team_rank(); i < w.replay.sheet.size; i += team_size()) {
    const Triple moved = triple(w.now.positions[i]) - triple(state.positions[i]),
                 speed = (1 / step.h) * moved;
    state.velocities[i] = {judged.finite ? speed.x : 0, judged.finite ? speed.y : 0,
                           judged.finite ? speed.z : 0, 0};
    if (judged.finite) state.positions[i] = w.now.positions[i];
  }
  if (judged.finite) write_bristles(w.replay.sheet, step, w.now.contacts, state.bristles);
  if (judged.finite && block_rank() == 0) step.at_start = w.now.elastic;
  synchronize_team();
  return solved;
}

/// One time step, in halves where it cannot be solved as a whole, so often as `halvings` says. Once a half
/// has failed the other is not divided any more.
static __device__ ReplayStats advance_step(Work& w, StepProblem& step, const StepMotion& motion,
                                           const SheetState& state) {
  ReplayStats stats = {};
  begin_holds(w, step, motion, state.positions);
  // Of each part of a part, from the whole step on: halves that it may be divided into still.
  int halvings[most_halvings + 1], level = 0;
  unsigned second = 0, first_converged = 0;  // a bit a level
  double begin = 0;                          // share of the step that is behind
  halvings[0] = w.replay.halvings;
  while (true) {
    const double length = 1.0 / (1 << level);
    change_common([&] { step.h = length * w.replay.time_step; });
    const bool last_try = halvings[level] == 0;
    const bool solved = try_step(w, step, motion, begin, begin + length, state, stats, last_try);
    if (!solved && !last_try) {
      halvings[level + 1] = halvings[level] - 1;
      ++level;
      second &= ~(1u << level);
      continue;
    }
    begin += length;
    bool converged = stats.converged;
    // A second half ends its whole.
    for (; level > 0 && (second >> level & 1); --level)
      converged = converged && (first_converged >> level & 1);
    if (level == 0) {
      stats.converged = converged;
      break;
    }
    first_converged = (first_converged & ~(1u << level)) | (converged ? 1u << level : 0);
    second |= 1u << level;
    if (!converged) halvings[level] = 0;
  }
  forget_restrictions(w);
  return stats;
}

}  // namespace flash::sim::cuda
