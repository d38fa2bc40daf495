#pragma once
#include "sim/cuda/multipliers.cuh"
#include "sim/cuda/obstacle_motion.cuh"
#include "sim/cuda/projective_forces.cuh"
#include "sim/cuda/projective_work.cuh"

namespace flash::sim::cuda {

// One time step of an environment by the projective method, as sim/oracle/projective.h without acceleration
// and with the inertia metric. Forces and contacts are in single precision but for distances to obstacles,
// solves as exact as their tiles.

/// The right-hand side of a solve, and what it is the right-hand side of.
struct RightSide {
  double residual;  ///< norm [N]
  float back;       ///< SolveScale of what is solved
};

/// Sets the right-hand side of -h^2 A^-1 (force - reaction). Barriers of the team.
template <Keeping keeping>
__device__ __noinline__ RightSide set_right_side(const ProjectiveWork<keeping>& work,
                                                 const StepProblem& step) {
  struct Loaded {
    SolveVertex vertex;
    Four<float> force, reaction;

    /// Of what moves; what is held has none [N].
    __device__ Vector3<float> residual() const {
      if (vertex.scale == 0) return {0, 0, 0};
      return vector_of(force) - vector_of(reaction);
    }
  };
  const InverseWork<keeping> inverse = work.inverse;
  const SolveVertex* vertices = kept_whole(work.vertices);
  const Four<float>*forces = kept_whole(work.memory.forces), *reactions = kept_whole(work.memory.reactions);
  double* partial = work.partial;
  const int size = step.size;
  const auto load = [&](int i) { return Loaded{vertices[i], forces[i], reactions[i]}; };
  const auto minus_h2 = static_cast<float>(-step.h * step.h);
  float largest = 0;
  double* largest_of_warps = partial + seats;
  synchronize_team();
  add_up<1, 2>(size, partial, load, [&](int, const Loaded& own, double(&sums)[1]) {
    const Vector3<float> r = own.residual(), b = (minus_h2 * own.vertex.scale) * r;
    sums[0] += static_cast<double>(dot(r, r));
    largest = worse_of(largest, std::fmax(std::fmax(std::fabs(b.x), std::fabs(b.y)), std::fabs(b.z)));
  });
  largest = largest_of_warp(largest);
  if (lane() == 0) put_in_all(largest_of_warps + team_warp(), static_cast<double>(largest));
  synchronize_team();
  const double sum = total(size, partial);
  largest = 0;
  for (int k = lane(); k < team_warps(); k += 32)
    largest = worse_of(largest, static_cast<float>(largest_of_warps[k]));
  const SolveScale scale(largest_of_warp(largest));
  for_own_vertices(size, load, [&](int, const Loaded& own) {
    inverse.set_right(own.vertex.place, (scale.to * minus_h2 * own.vertex.scale) * own.residual());
  });
  return {sqrt(sum), scale.back};
}

/// Finds the contacts at the iterate and their multipliers, from the free motion that a solve has given.
/// `right`: of that solve, and of one more where contacts are lost. Returns what is left of the laws of
/// contact [m]; `moved`: whether the reaction is another one.
template <int parts, Keeping keeping>
__device__ double meet_obstacles(const ProjectiveWork<keeping>& w, const StepProblem& step, RightSide& right,
                                 bool& moved) {
  const FoundContacts found = find_contacts(w, step, right.back);
  const bool lost = any_of_team(found.lost), any = any_of_team(found.any);
  moved = lost || any;
  count_phase(w, ProjectivePhase::contacts);
  if (lost) {
    // The free motion was that with forces of contacts that are none any more.
    set_reactions(w, step);
    right = set_right_side(w, step);
    solve_inverse<parts>(w.inverse);
    count_phase(w, ProjectivePhase::solves);
  }
  if (!any) return 0;
  const float left = solve_multipliers(w, step, right.back);
  const double worst = worst_over_team(left, w.partial);
  count_phase(w, ProjectivePhase::multipliers);
  return worst;
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
template <Keeping keeping>
__device__ __noinline__ void begin_step(const ProjectiveWork<keeping>& w, StepProblem& step,
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
    m.reactions[i] = {0, 0, 0, 0};
  }
  if (motion.obstacle_count > 0) {
    if (const int k = team_rank(); k < motion.obstacle_count)
      m.obstacles[k] = placed_between(motion.obstacles[k], motion.poses, w.numbers.replay.frames, 0, 1);
    synchronize_team();
  }
  const VertexContacts contacts(m, step.size, motion.obstacle_count);
  for (int i = team_rank(); i < step.size; i += team_size())
    for (int k = 0; k < motion.obstacle_count; ++k) {
      contacts.touching(k, i) = 0;
      contacts.force(k, i) = {0, 0, 0, 0};
    }
  synchronize_team();
  for (int k = team_rank(); k < motion.held_count; k += team_size()) {
    const HeldPlace& held = motion.held[k];
    m.held_axes[held.place] = held.axes;
    m.positions[held.place] = {held.target[0], held.target[1], held.target[2], 0};
  }
  synchronize_team();
  project_to_feasible(w.tables(), step, nullptr, m.positions);
  set_places(w.places, step.start, m.positions);
  begin_forces(w.tables(), m, step, w.places);
}

/// Forces of the holds, and the deepest vertex [m].
template <Keeping keeping>
__device__ __noinline__ double report_forces(const ProjectiveWork<keeping>& w, const StepProblem& step,
                                             const ProjectiveMotion& motion) {
  for (int hold = 0; hold < w.numbers.replay.hold_count; ++hold) {
    double sums[3];
    sum_over_team(motion.held_count, sums, w.partial, [&](int k, double(&own)[3]) {
      const HeldPlace& held = motion.held[k];
      const Vector3<float> force = vector_of(w.memory.forces[held.place]);
      for (int axis = 0; axis < 3; ++axis)
        if (held.holds[axis] == hold) own[axis] += force[axis];
    });
    if (team_rank() == 0)
      for (int axis = 0; axis < 3; ++axis) motion.hold_forces[3 * hold + axis] = sums[axis];
  }
  double deepest = 0;
  const VertexContacts contacts(w.memory, step.size, step.obstacles.count);
  for (int i = team_rank(); i < step.size; i += team_size())
    for (int k = 0; k < contacts.obstacles && step.held_axes[i] == 0; ++k)
      if (contacts.touching(k, i) != 0)
        deepest = worse_of(deepest, fmax(0.0, -static_cast<double>(contacts.surface(k, i).w)));
  return worst_over_team(deepest, w.partial);
}

/// Writes the end of a step to the state, held vertices as they are told.
template <Keeping keeping>
__device__ void end_step(const ProjectiveWork<keeping>& w, const StepProblem& step,
                         const ProjectiveMotion& motion, const SheetState& state) {
  const auto arrive = [&](int i, const Triple& x) {
    const Triple speed = (1 / step.h) * (x - triple(state.positions[i]));
    state.velocities[i] = {speed.x, speed.y, speed.z, 0};
    state.positions[i] = {x.x, x.y, x.z, 0};
  };
  for (int i = team_rank(); i < step.size; i += team_size())
    if (step.held_axes[i] == 0) arrive(i, w.places.place(i));
  for (int k = team_rank(); k < motion.held_count; k += team_size()) {
    const HeldPlace& held = motion.held[k];
    arrive(held.place, {held.target[0], held.target[1], held.target[2]});
  }
  synchronize_team();
}

/// Advances the state by a step.
template <int parts, Keeping keeping>
__device__ ReplayStats advance_step(const ProjectiveWork<keeping>& w, StepProblem& step,
                                    const ProjectiveMotion& motion, const SheetState& state) {
  const ProjectiveNumbers& numbers = w.numbers;
  begin_step(w, step, motion);
  count_phase(w, ProjectivePhase::rest);
  ReplayStats stats = {};
  stats.substeps = 1;
  for (;; ++stats.iterations) {
    const bool last = stats.iterations == numbers.iterations;
    find_forces(numbers, w.memory, step, w.places, w.partial);
    RightSide right = set_right_side(w, step);
    count_phase(w, ProjectivePhase::forces);
    double left = 0;
    bool moved = false, solved = false;
    if (step.obstacles.count > 0) {
      solve_inverse<parts>(w.inverse);
      count_phase(w, ProjectivePhase::solves);
      left = meet_obstacles<parts>(w, step, right, moved);
      solved = !moved;
      if (moved) right = set_right_side(w, step);
    }
    stats.residual = right.residual / step.material->force_scale;
    stats.converged = stats.residual <= numbers.replay.tolerance && left <= numbers.contact_tolerance;
    stats.solves += 1;
    if (stats.converged || last) break;
    // Without contacts the free motion is the motion.
    if (!solved) solve_inverse<parts>(w.inverse);
    const SolvedWay<keeping> way(w, right.back);
    const VertexPlaces<keeping> places = w.places;
    for_own_vertices(
        step.size, [&](int i) { return way.vertices[i]; },
        [&](int i, const SolveVertex& vertex) {
          places.set_rest(i, vector_of(places.rests()[i]) + way(vertex));
        });
    if (needs_double(w.tables(), step))
      for (int i = team_rank(); i < step.size; i += team_size()) {
        const Triple x = w.places.place(i);
        w.memory.positions[i] = {x.x, x.y, x.z, 0};
      }
    count_phase(w, ProjectivePhase::solves);
  }
  stats.penetration = report_forces(w, step, motion);
  end_step(w, step, motion, state);
  return stats;
}

}  // namespace flash::sim::cuda
