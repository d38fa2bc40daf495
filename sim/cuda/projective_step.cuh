#pragma once
#include "sim/cuda/inverse_solve.cuh"
#include "sim/cuda/multipliers.cuh"
#include "sim/cuda/obstacle_motion.cuh"

namespace flash::sim::cuda {

// One time step of an environment by the projective method, as sim/oracle/projective.h without acceleration
// and with the inertia metric. Forces, contacts and positions are in double precision, solves as exact as
// their tiles.

/// What a team takes an environment through steps with.
struct ProjectiveWork {
  const ProjectiveNumbers& numbers;
  const ProjectiveMemory& memory;
  InverseWork inverse;
  double* partial;  ///< on chip
  int environment;

  __device__ const SheetTables& tables() const { return numbers.replay.sheet; }
};

/// Counts the time since the last call to a phase. All threads have just been synchronized.
__device__ inline void count_phase(const ProjectiveWork& w, ProjectivePhase phase) {
  PhaseClock{w.memory.clocks}.count(static_cast<ReplayPhase>(phase));
}

/// What each vertex needs from outside at the iterate, to `force` [N].
__device__ __noinline__ void find_forces(const ProjectiveWork& w, const StepProblem& step) {
  const ProjectiveMemory& m = w.memory;
  const SheetTables& tables = w.tables();
  synchronize_team();
  const GradientShares shares = {m.triangle_gradients, m.hinge_gradients};
  if (w.numbers.places_at >= 0)
    elastic_gradient<true>(tables, step.numbers, step.damped_since, m.positions, m.force, shares, w.partial);
  else
    elastic_gradient<false>(tables, step.numbers, step.damped_since, m.positions, m.force, shares, w.partial);
  if (step.damped_since.metrics != nullptr && tables.bundle_count > 0) {
    TeamMemory turned = {};
    turned.bent = m.bent;
    turned.damped = m.damped;
    add_turned_damping(tables, step, turned, m.positions, m.force, w.partial);
  }
  const double per_step = 1 / (step.h * step.h), drag = step.material->air_drag / step.h;
  for (int i = team_rank(); i < step.size; i += team_size()) {
    const double mass = step.mass(tables, i);
    const Triple moved = triple(m.positions[i]) - triple(step.start[i]);
    const Triple own =
        force_at(m.force, i) + mass * (per_step * step.inertial(i, moved) + drag * moved) - step.load(i);
    m.force[3 * i] = own.x;
    m.force[3 * i + 1] = own.y;
    m.force[3 * i + 2] = own.z;
  }
  synchronize_team();
  count_phase(w, ProjectivePhase::forces);
}

/// The residual of a free vertex, zero of one that is held [N].
__device__ inline Triple residual_of(const ProjectiveWork& w, const StepProblem& step, int i) {
  if (step.held_axes[i] != 0) return {0, 0, 0};
  return force_at(w.memory.force, i) - force_at(w.memory.reaction, i);
}

/// motion = -h^2 A^-1 (force - reaction). Returns the norm of the residual [N].
template <int parts>
__device__ __noinline__ double solve_residual(const ProjectiveWork& w, const StepProblem& step) {
  const double h2 = step.h * step.h;
  const auto scaled = [&](int i) {
    const Triple r = residual_of(w, step, i);
    const auto s = static_cast<float>(-h2 * w.inverse.scale[w.inverse.tables.slot_of[i]]);
    return Vector3<float>{s * static_cast<float>(r.x), s * static_cast<float>(r.y),
                          s * static_cast<float>(r.z)};
  };
  const VertexMerit size = merit_over_team(step.size, w.partial, [&](int i) {
    const Triple r = residual_of(w, step, i);
    const Vector3<float> b = scaled(i);
    return VertexMerit{dot(r, r), worse_of(worse_of(fabsf(b.x), fabsf(b.y)), fabsf(b.z))};
  });
  solve_inverse<parts>(w.inverse, static_cast<float>(size.worst), scaled, step.size, w.memory.motion);
  count_phase(w, ProjectivePhase::solves);
  return sqrt(size.sum);
}

__device__ __noinline__ double norm_of_residual(const ProjectiveWork& w, const StepProblem& step) {
  double sums[1];
  sum_over_team(step.size, sums, w.partial, [&](int i, double(&own)[1]) {
    const Triple r = residual_of(w, step, i);
    own[0] += dot(r, r);
  });
  return sqrt(sums[0]);
}

/// Sets the reaction to the forces of the contacts.
__device__ inline void set_reaction(const ProjectiveWork& w, const StepProblem& step,
                                    const VertexContacts& contacts) {
  for (int i = team_rank(); i < step.size; i += team_size()) {
    Triple reaction = {0, 0, 0};
    if (step.held_axes[i] == 0) reaction = contact_force(contacts, i);
    w.memory.reaction[3 * i] = reaction.x;
    w.memory.reaction[3 * i + 1] = reaction.y;
    w.memory.reaction[3 * i + 2] = reaction.z;
  }
}

/// Finds the contacts at the iterate and their multipliers, from the free motion that a solve has given.
/// Returns what is left of the laws of contact [m]; `moved`: whether the reaction is another one.
template <int parts>
__device__ double meet_obstacles(const ProjectiveWork& w, const StepProblem& step, bool& moved) {
  const MultiplierSettings& settings = w.numbers.multipliers;
  const VertexContacts contacts = {w.memory, step.size, step.obstacles.count};
  const FoundContacts found =
      find_contacts(step, contacts, settings.tangent_angle, w.memory.positions, w.memory.motion);
  const double largest = worst_over_team(found.largest, w.partial);
  const bool lost = any_of_team(found.lost), any = any_of_team(found.any);
  moved = lost || any;
  count_phase(w, ProjectivePhase::contacts);
  if (lost) {
    // The free motion was that with forces of contacts that are none any more.
    set_reaction(w, step, contacts);
    synchronize_team();
    solve_residual<parts>(w, step);
  }
  if (!any) return 0;
  const double tolerance = settings.tolerance > 1e-3 * largest ? settings.tolerance : 1e-3 * largest;
  const double left =
      solve_multipliers(w.tables(), step, contacts, settings, tolerance, w.memory.motion, w.partial);
  set_reaction(w, step, contacts);
  synchronize_team();
  count_phase(w, ProjectivePhase::multipliers);
  return left;
}

/// What moves by itself in a step.
struct ProjectiveMotion {
  const HeldPlace* held;  ///< vertices at its end
  int held_count;
  double* hold_forces;  ///< three numbers a hold [N]
  const PlacedObstacle* obstacles;
  int obstacle_count;
  bool several;            ///< whether a box stands beside another obstacle
  const FramePose* poses;  ///< of the frames at its start; those at its end follow
};

/// Fills in a step, which the threads of a block have in common, and the iterate that the prediction is.
__device__ __noinline__ void begin_step(const ProjectiveWork& w, StepProblem& step,
                                        const ProjectiveMotion& motion) {
  const ProjectiveMemory& m = w.memory;
  const ReplayMaterial& material = *step.material;
  const bool damped = material.stiffness_damping != 0;
  __syncthreads();
  if (threadIdx.x == 0) {
    step.numbers = {material.law, material.lame, material.rigidity, 0};
    step.damped_since = {};
    if (damped) {
      const double share = material.stiffness_damping / step.h;
      step.numbers.damping = {share * material.damping.mu, share * material.damping.lambda};
      step.numbers.damping_share = share;
      step.damped_since = {m.start_metrics, m.start_angles};
    }
    step.obstacles = {};
    if (motion.obstacle_count > 0)
      step.obstacles = {m.obstacles, motion.obstacle_count, motion.several, step.h, {INFINITY, {}}};
  }
  __syncthreads();
  if (damped) {
    const auto place = [&](int vertex) { return triple(step.start[vertex]); };
    write_metrics(w.tables(), place, m.start_metrics);
    if (w.tables().hinge_count > 0) write_angles(w.tables(), place, m.start_angles);
  }
  for (int i = team_rank(); i < step.size; i += team_size()) {
    const Triple x = triple(step.start[i]) + step.h * triple(step.velocities[i]);
    m.positions[i] = {x.x, x.y, x.z, 0};
    m.held_axes[i] = 0;
    for (int c = 0; c < 3; ++c) m.reaction[3 * i + c] = 0;
  }
  if (motion.obstacle_count > 0)
    place_obstacles(team_rank(), motion.obstacles, motion.obstacle_count, motion.poses,
                    w.numbers.replay.frames, 0, 1, m.obstacles);
  const VertexContacts contacts = {m, step.size, motion.obstacle_count};
  for (int i = team_rank(); i < step.size; i += team_size())
    for (int k = 0; k < motion.obstacle_count; ++k) {
      contacts.touching(k, i) = 0;
      contacts.set(ContactNumber::force, k, i, {0, 0, 0});
    }
  synchronize_team();
  for (int k = team_rank(); k < motion.held_count; k += team_size()) {
    const HeldPlace& held = motion.held[k];
    m.held_axes[held.place] = held.axes;
    m.positions[held.place] = {held.target[0], held.target[1], held.target[2], 0};
  }
  synchronize_team();
  project_to_feasible(w.tables(), step, nullptr, m.positions);
}

/// Forces of the holds, and the deepest vertex [m].
__device__ __noinline__ double report_forces(const ProjectiveWork& w, const StepProblem& step,
                                             const ProjectiveMotion& motion) {
  for (int hold = 0; hold < w.numbers.replay.hold_count; ++hold) {
    double sums[3];
    sum_over_team(motion.held_count, sums, w.partial, [&](int k, double(&own)[3]) {
      const HeldPlace& held = motion.held[k];
      for (int axis = 0; axis < 3; ++axis)
        if (held.holds[axis] == hold) own[axis] += w.memory.force[3 * held.place + axis];
    });
    if (team_rank() == 0)
      for (int axis = 0; axis < 3; ++axis) motion.hold_forces[3 * hold + axis] = sums[axis];
  }
  double deepest = 0;
  const VertexContacts contacts = {w.memory, step.size, step.obstacles.count};
  for (int i = team_rank(); i < step.size; i += team_size())
    for (int k = 0; k < contacts.obstacles && step.held_axes[i] == 0; ++k)
      if (contacts.touching(k, i) != 0)
        deepest = worse_of(deepest, fmax(0.0, -contacts.get(ContactNumber::gap, k, i).x));
  return worst_over_team(deepest, w.partial);
}

/// Advances the state by a step.
template <int parts>
__device__ ReplayStats advance_step(const ProjectiveWork& w, StepProblem& step,
                                    const ProjectiveMotion& motion, const SheetState& state) {
  const ProjectiveNumbers& numbers = w.numbers;
  const ProjectiveMemory& m = w.memory;
  begin_step(w, step, motion);
  count_phase(w, ProjectivePhase::rest);
  ReplayStats stats = {};
  stats.substeps = 1;
  for (;; ++stats.iterations) {
    const bool last = stats.iterations == numbers.iterations;
    find_forces(w, step);
    double residual, left = 0;
    bool moved = false;
    if (step.obstacles.count > 0 || !last) {
      residual = solve_residual<parts>(w, step);
      if (step.obstacles.count > 0) left = meet_obstacles<parts>(w, step, moved);
      if (moved) residual = norm_of_residual(w, step);
    } else {
      residual = norm_of_residual(w, step);
    }
    stats.residual = residual / step.material->force_scale;
    stats.converged = stats.residual <= numbers.replay.tolerance && left <= numbers.contact_tolerance;
    stats.solves += 1;
    if (stats.converged || last) break;
    // Without contacts the free motion is the motion.
    if (moved) solve_residual<parts>(w, step);
    for (int i = team_rank(); i < step.size; i += team_size()) {
      const Triple x = triple(m.positions[i]) + way_at(m.motion, i);
      m.positions[i] = {x.x, x.y, x.z, 0};
    }
  }
  stats.penetration = report_forces(w, step, motion);
  for (int i = team_rank(); i < step.size; i += team_size()) {
    const Triple speed = (1 / step.h) * (triple(m.positions[i]) - triple(state.positions[i]));
    state.velocities[i] = {speed.x, speed.y, speed.z, 0};
    state.positions[i] = m.positions[i];
  }
  synchronize_team();
  return stats;
}

}  // namespace flash::sim::cuda
