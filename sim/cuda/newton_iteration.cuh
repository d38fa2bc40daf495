#pragma once
#include "sim/cuda/common_value.cuh"
#include "sim/cuda/conjugate_gradients.cuh"
#include "sim/cuda/contact.cuh"
#include "sim/cuda/generalized_residuals.cuh"
#include "sim/cuda/incremental_potential.cuh"
#include "sim/cuda/membrane_hessian.cuh"
#include "sim/cuda/team_factor.cuh"
#include "sim/newton/newton_loop.h"
#include "sim/newton/step_end.h"

namespace flash::sim::cuda {

// Newton's method of sim/newton/newton_iteration.h for one environment. All threads of a team decide alike.

/// A team at work on an environment. The threads of a block have it in common.
struct Work {
  const ReplayNumbers& replay;
  const TeamMemory& memory;
  MovingObstacle<double>* obstacles;  ///< room on chip for those of a step
  bool refactor;                      ///< whether the next solve needs a new factor
  Iterate now, trial, longer;
  ContactSet linear;  ///< of the linear problem, to which the direction is the solution
};

__device__ inline void count_phase(const TeamMemory& memory, ReplayPhase phase) {
  PhaseClock{memory.clocks}.count(phase);
}

__device__ inline void evaluate(const Work& w, const StepProblem& step, const ContactSet* line, Iterate& at) {
  count_phase(w.memory, ReplayPhase::rest);
  const int shares_at = w.replay.gradient_shares_at;
  double* shares = shares_at < 0 ? w.memory.triangle_gradients
                                 : reinterpret_cast<double*>(shared_memory<char>() + shares_at);
  const StepRing ring = {shared_memory<char>() + w.replay.gradient_ring_at, w.replay.gradient_depth};
  if (w.replay.places_on_chip)
    evaluate<true>(w.replay.sheet, step, w.memory, shares, ring, line, at);
  else
    evaluate<false>(w.replay.sheet, step, w.memory, shares, ring, line, at);
  count_phase(w.memory, ReplayPhase::evaluation);
}

/// What triangles give to a matrix: on chip behind nine numbers a thread, or in memory.
template <bool on_chip>
__device__ float* matrix_shares(const Work& w) {
  return on_chip ? shared_memory<float>() + 9 * block_threads : w.memory.shares;
}

/// The parts of the Hessian at the iterate, from which a matrix is put together.
template <bool shares_on_chip>
__device__ void write_parts(const Work& w, const StepProblem& step, bool positive) {
  const SheetTables& tables = w.replay.sheet;
  write_shares<shares_on_chip>(tables, step.numbers, step.damped_since, w.now.positions, positive,
                               matrix_shares<shares_on_chip>(w), shared_memory<float>());
  if (tables.hinge_count > 0)
    write_hinge_matrix(tables, step.numbers.effective_rigidity(),
                       [&](int vertex) { return triple(w.now.positions[vertex]); },
                       {w.memory.hinge_matrix, w.memory.hinge_products});
  if (step.obstacles.count > 0) write_own_blocks(tables, step, w.now, !positive, w.memory.own_blocks);
  if (step.springs.count > 0) {
    if (step.obstacles.count == 0)
      for (int k = team_rank(); k < 9 * tables.size; k += team_size()) w.memory.own_blocks[k] = 0;
    synchronize_team();
    add_spring_stiffness(step.springs, w.memory.own_blocks);
  }
  synchronize_team();
}

/// What the linear problem may not move freely; with `coupled`, how friction follows the normal forces.
__device__ inline void restrict_by(const Work& w, const ContactSet& contacts, bool coupled,
                                   StepProblem& step) {
  gather_restrictions(w.replay.sheet, step, contacts, w.memory.restrictions, w.memory.restriction_of,
                      coupled ? w.memory.coupled.left : nullptr, shared_memory<int>());
}

__device__ inline HingeMatrix hinges_of(const Work& w) {
  if (w.replay.sheet.hinge_count == 0) return {};
  return {w.memory.hinge_matrix, w.memory.hinge_products};
}

/// act(std::bool_constant<whether what triangles give to a matrix fits on chip>).
template <typename Act>
__device__ void where_shares_are(const Work& w, const Act& act) {
  if (w.replay.matrix_shares_on_chip)
    act(std::true_type{});
  else
    act(std::false_type{});
}

/// Assembles the Hessian at the iterate: exact, or `positive`.
static __device__ __noinline__ void assemble_matrix(const Work& w, const StepProblem& step, bool positive) {
  where_shares_are(w, [&](auto on_chip) {
    write_parts<on_chip>(w, step, positive);
    assemble_block_rows<on_chip>(w.replay.sheet, step.numbers, matrix_shares<on_chip>(w), w.memory.block_rows,
                                 shared_memory<float>());
  });
  synchronize_team();
  count_phase(w.memory, ReplayPhase::matrix);
}

/// Factorizes the positive Hessian at the iterate. Returns false where it is not positive definite after all.
static __device__ __noinline__ bool factorize(const Work& w, StepProblem& step) {
  float* chip = shared_memory<float>();
  restrict_by(w, w.now.contacts, false, step);
  where_shares_are(w, [&](auto on_chip) {
    write_parts<on_chip>(w, step, true);
    assemble_blocks<on_chip>(w.replay.sheet, step.numbers, step.restrictions, hinges_of(w),
                             matrix_shares<on_chip>(w), w.memory.blocks, chip);
  });
  count_phase(w.memory, ReplayPhase::preconditioner);
  const bool positive = factorize(w.replay, w.memory, chip);
  const bool failed = any_of_team(!positive);
  count_phase(w.memory, ReplayPhase::factorization);
  return !failed;
}

/// On-chip bytes for sums over the team, before what a solve needs.
inline constexpr int linear_partial_bytes = linear_partials * static_cast<int>(sizeof(float));

/// A linear problem and what a team solves it with.
struct LinearWork {
  LinearProblem problem;
  LinearVectors vectors;
  float* partial;  ///< on chip
  char* chip;      ///< behind that
};

__device__ inline LinearWork linear_work(const Work& w, const StepProblem& step) {
  const TeamMemory& m = w.memory;
  char* chip = shared_memory<char>();
  const auto on_chip = [&](int at, auto* otherwise) {
    return at < 0 ? otherwise : reinterpret_cast<decltype(otherwise)>(chip + at);
  };
  return {
      {m.block_rows, static_cast<float>(step.numbers.effective_rigidity()), hinges_of(w), m.factor,
       m.gradient, step.restrictions,
       static_cast<float>(linear_target(w.replay.tolerance * step.material->force_scale, w.now.residual))},
      {m.residual,
       m.image,
       m.search,
       on_chip(w.replay.search_at, m.search),
       on_chip(w.replay.solved_at, m.solved),
       w.replay.solved_at >= 0,
       {chip + w.replay.step_ring_at, w.replay.step_depth},
       {m.clocks}},
      reinterpret_cast<float*>(chip),
      chip + linear_partial_bytes};
}

/// Solves the linear problem. `enough`: residual that is small enough for one that goes on from the last
/// direction, 0 for one that does not.
static __device__ __noinline__ LinearEnd find_direction(const Work& w, const StepProblem& step,
                                                        float enough) {
  LinearWork own = linear_work(w, step);
  own.problem.goes_on = enough > 0;
  own.problem.tolerance = fmaxf(own.problem.tolerance, enough);
  return conjugate_gradients<half_parts>(w.replay.fronts, w.replay.sheet, own.problem, own.vectors,
                                         w.memory.direction, w.memory.change, own.partial, own.chip);
}

/// The same where friction follows the normal forces. Returns the number of solves with the factor.
static __device__ __noinline__ int find_coupled_direction(const Work& w, const StepProblem& step) {
  const LinearWork own = linear_work(w, step);
  return generalized_residuals<half_parts>(w.replay.fronts, w.replay.sheet, own.problem, own.vectors,
                                           w.memory.coupled, w.memory.direction, w.memory.change, own.partial,
                                           own.chip);
}

/// Finds the direction and the contacts that go with it, those of the linear problem: solves it and exchanges
/// its contacts in turn. `stuck`: with the positive Hessian, whose direction leads down.
static __device__ void linear_step(Work& w, StepProblem& step, bool stuck, bool coupled, ReplayStats& stats) {
  const SheetTables& tables = w.replay.sheet;
  const TeamMemory& m = w.memory;
  const bool touches = step.obstacles.count > 0;
  for_own_vertices(
      tables.size, [&](int i) { return force_at(w.now.residuals, i); },
      [&](int i, const Triple& own) {
        put({static_cast<float>(own.x), static_cast<float>(own.y), static_cast<float>(own.z)}, m.gradient, i);
      });
  if (touches) copy_contacts(tables, step, w.now.contacts, w.linear);
  synchronize_team();
  count_phase(m, ReplayPhase::rest);
  bool refactor = false;
  float small = 0;
  solve_and_exchange(
      [&](int solved) {
        restrict_by(w, w.linear, coupled, step);
        count_phase(m, ReplayPhase::contact);
        const LinearEnd end =
            coupled ? LinearEnd{find_coupled_direction(w, step), 0} : find_direction(w, step, small);
        count_phase(m, ReplayPhase::directions);
        stats.solves += end.solves;
        refactor = refactor || end.solves > w.replay.stale_factor_solves;
        if (solved == 0) small = static_cast<float>(enough) * end.first_residual;
      },
      [&] {
        if (!touches) return false;
        const bool changed =
            exchange_contacts(tables, step, w.now, m.direction, m.change, stuck, w.linear, m.gradient);
        count_phase(m, ReplayPhase::contact);
        return changed;
      });
  change_common([&] { w.refactor = refactor; });
}

/// The slope of the potential along the direction, at an iterate [J].
__device__ inline double slope_at(const Work& w, const Iterate& at) {
  double* partial = shared_memory<double>();
  const int size = w.replay.sheet.size;
  synchronize_team();
  add_up<1, 2>(
      size, partial, [&](int i) { return dot(force_at(at.residuals, i), way_at(w.memory.direction, i)); },
      [&](int, double own, double(&sums)[1]) { sums[0] += own; });
  synchronize_team();
  const double slope = total(size, partial);
  synchronize_team();
  return slope;
}

/// Evaluates the feasible iterate nearest to the point `length` directions from the iterate.
__device__ inline void move(const Work& w, const StepProblem& step, double length, Iterate& to) {
  for_own_vertices(
      w.replay.sheet.size,
      [&](int i) { return triple(w.now.positions[i]) + length * way_at(w.memory.direction, i); },
      [&](int i, const Triple& place) {
        to.positions[i] = {place.x, place.y, place.z, 0};
      });
  count_phase(w.memory, ReplayPhase::rest);
  project_to_feasible(w.replay.sheet, step, &w.linear, to.positions);
  count_phase(w.memory, ReplayPhase::contact);
  evaluate(w, step, &w.now.contacts, to);
}

/// The potential with that of friction at the normal forces of the line's start.
__device__ inline double potential_on_line(const Iterate& at) { return at.potential + at.line_friction; }

__device__ inline void swap_iterates(Iterate& a, Iterate& b) {
  change_common([&] {
    const Iterate c = a;
    a = b;
    b = c;
  });
}

/// The way along the direction from w.now (sim/newton/line_search.h).
struct DirectionLine {
  Work& w;
  const StepProblem& step;

  __device__ double start_potential() const { return w.now.potential + w.now.friction; }
  __device__ double start_residual() const { return w.now.residual; }
  __device__ double trial_potential() const { return potential_on_line(w.trial); }
  __device__ double trial_residual() const { return w.trial.residual; }
  __device__ double second_potential() const { return potential_on_line(w.longer); }
  __device__ double second_residual() const { return w.longer.residual; }
  __device__ double end_slope() const { return slope_at(w, w.trial); }
  __device__ double move(double length) const {
    cuda::move(w, step, length, w.trial);
    return length;
  }
  __device__ double move_second(double length) const {
    cuda::move(w, step, length, w.longer);
    return length;
  }
  __device__ void take_second() const { swap_iterates(w.trial, w.longer); }
};

/// From w.now to balance or until it cannot go on, as iterate (sim/newton/newton_loop.h). Counts its work in
/// `stats`.
__device__ inline void iterate_to_balance(Work& w, StepProblem& step, ReplayStats& stats) {
  const DirectionLine line{w, step};
  bool stuck = false;
  int forced_moves = 0;
  const double tolerance = w.replay.tolerance;
  for (int iterations = 0;
       iterations < w.replay.max_iterations &&
       !(iterations == 0 ? rests(step, w.now, tolerance) : balanced(step, w.now, tolerance));
       ++iterations) {
    ++stats.iterations;
    if (w.refactor) {
      if (!factorize(w, step)) {
        // Nothing has moved: forces below the tolerance are no balance then.
        change_common([&] { w.now.worst = INFINITY; });
        return;
      }
      ++stats.factorizations;
    }
    assemble_matrix(w, step, stuck);
    const bool coupled =
        !stuck && step.obstacles.count > 0 && couples_friction(step.h, w.replay.time_step, iterations + 1);
    linear_step(w, step, stuck, coupled, stats);

    const double slope = slope_at(w, w.now);
    const double length = shorten(line, coupled, slope);
    if (!acceptable(line, coupled, slope, length)) {
      if (balanced(step, w.now, tolerance)) return;
      if (!stuck) {
        // The iteration is repeated with a fresh factor and a positive matrix, whose direction leads down.
        stuck = true;
        change_common([&] { w.refactor = true; });
        continue;
      }
      // A small step all the same lets the contacts decide anew.
      if (++forced_moves > most_forced_moves || !isfinite(w.trial.potential)) return;
    }
    stuck = false;
    if (!coupled) lengthen(line, slope, length);
    swap_iterates(w.now, w.trial);
  }
}

}  // namespace flash::sim::cuda
