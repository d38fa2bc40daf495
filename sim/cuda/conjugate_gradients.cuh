#pragma once
#include "sim/cuda/environment_numbers.h"
#include "sim/cuda/own_vertices.cuh"
#include "sim/cuda/phase_clock.h"
#include "sim/cuda/sheet_product.cuh"
#include "sim/cuda/team_factor.cuh"
#include "sim/cuda/team_sum.cuh"
#include "sim/newton/step_numbers.h"

namespace flash::sim::cuda {

// Conjugate gradients of one environment, as NewtonMatrix::solve of the CPU. A thread owns the vertices i,
// i + team_size(), ... of each vector; a few of them are on their way at a time. Of what is on chip each
// block has a copy, and what a thread writes there goes to all of them.

/// The linear problem of an environment.
struct LinearProblem {
  const float* block_rows;
  float rigidity;
  HingeMatrix hinges;
  const __half* factor;
  const float* gradient;
  Restrictions restrictions;
  float tolerance;
  bool goes_on = false;  ///< from the direction that is there, that of a problem with other contacts
};

/// How a linear problem went.
struct LinearEnd {
  int solves;            ///< with the factor
  float first_residual;  ///< norm of that at the start
};

/// Memory of a team, three numbers a vertex but where said.
struct LinearVectors {
  float *residual, *image;
  Four<float>* search;  ///< four
  Four<float>* near;    ///< four: a copy of `search` for products on chip, free during a solve; or `search`
  float* solved;        ///< what a solve works on (solve_chunk.h)
  bool solved_on_chip = false;
  StepRing step_ring = {};  ///< for products, free during a solve too
  PhaseClock clock = {};
};

template <int parts>
__device__ void solve(const FrontTables& fronts, const __half* factor, const LinearVectors& v,
                      const char* chip) {
  if (v.solved_on_chip)
    solve<parts, true>(fronts, factor, v.solved, chip);
  else
    solve<parts, false>(fronts, factor, v.solved, chip);
}

/// `copies`: whether each block has a copy of x.
__device__ inline void restrict_to_free(const Restrictions& restrictions, float* x, bool copies) {
  if (restrictions.count == 0) return;
  synchronize_team();
  const int first = copies ? block_rank() : team_rank(), step = copies ? block_size() : team_size();
  for (int k = first; k < restrictions.count; k += step) {
    const VertexRestriction& restriction = restrictions.list[k];
    float* own = x + 3 * restriction.place;
    const float a = own[0], b = own[1], c = own[2];
    const float* free = restriction.free;
    for (int r = 0; r < 3; ++r) own[r] = free[r] * a + free[3 + r] * b + free[6 + r] * c;
  }
  synchronize_team();
}

/// Three numbers of a vertex.
struct Numbers3 {
  float x, y, z;
};

struct NumbersPair {
  Numbers3 first, second;
};

__device__ inline Numbers3 numbers_at(const float* vector, int vertex) {
  const float* own = vector + 3 * vertex;
  return {own[0], own[1], own[2]};
}
__device__ inline void put(const Numbers3& v, float* vector, int vertex) {
  float* own = vector + 3 * vertex;
  own[0] = v.x;
  own[1] = v.y;
  own[2] = v.z;
}
__device__ inline Numbers3 scaled_sum(const Numbers3& a, float scale, const Numbers3& b) {
  return {a.x + scale * b.x, a.y + scale * b.y, a.z + scale * b.z};
}
__device__ inline float product(const Numbers3& a, const Numbers3& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

/// What of a vertex may move freely.
__device__ inline Numbers3 free_part(const Restrictions& restrictions, int vertex, const Numbers3& v) {
  if (restrictions.projectors != nullptr) {
    const float* own = restrictions.projectors + vertex;
    const long step = restrictions.size;
    const float xx = own[0], xy = own[step], xz = own[2 * step], yy = own[3 * step], yz = own[4 * step],
                zz = own[5 * step];
    return {xx * v.x + xy * v.y + xz * v.z, xy * v.x + yy * v.y + yz * v.z, xz * v.x + yz * v.y + zz * v.z};
  }
  const int at = restrictions.count == 0 ? -1 : restrictions.of_place[vertex];
  if (at < 0) return v;
  const float* free = restrictions.list[at].free;
  return {free[0] * v.x + free[3] * v.y + free[6] * v.z, free[1] * v.x + free[4] * v.y + free[7] * v.z,
          free[2] * v.x + free[5] * v.y + free[8] * v.z};
}

/// Numbers on chip for sums over the team: those of norms have a place of their own, so that no barrier parts
/// them from the others.
inline constexpr int linear_partials = 2 * seats;

/// `direction` = the solution over the free directions, `change` = matrix * direction. Stops as the CPU does:
/// at a share of the residual, at the tolerance, where the matrix curves down, after `most_solves`
/// iterations. `partial`, `chip`: on chip, linear_partials and solve_memory. What it returns all threads get.
template <int parts>
__device__ LinearEnd conjugate_gradients(const FrontTables& fronts, const SheetTables& sheet,
                                         const LinearProblem& problem, const LinearVectors& v,
                                         float* direction, float* change, float* partial, char* chip) {
  const int size = sheet.size;
  float *residual = v.residual, *preconditioned = v.solved + 3 * size;
  const Restrictions& restrictions = problem.restrictions;
  const auto multiply_search = [&](StepsOnTheirWay<float>& steps) {
    return multiply(sheet, problem.block_rows, problem.rigidity, problem.hinges, steps, v.near, v.image,
                    partial);
  };
  const auto put_search = [&](int i, const Numbers3& own) {
    const Four<float> four = {own.x, own.y, own.z, 0};
    v.search[i] = four;
    if (v.near != v.search) put_in_all(v.near + i, four);
  };
  // The right-hand side, and where the restrictions have the solution start.
  int moved = 0;
  for_own_vertices(
      size,
      [&](int i) {
        const int at = restrictions.count == 0 ? -1 : restrictions.of_place[i];
        const float* correction = at < 0 ? nullptr : restrictions.list[at].correction;
        Numbers3 start = at < 0 ? Numbers3{} : Numbers3{correction[0], correction[1], correction[2]};
        if (problem.goes_on)
          start = scaled_sum(start, 1, free_part(restrictions, i, numbers_at(direction, i)));
        return NumbersPair{numbers_at(problem.gradient, i), start};
      },
      [&](int i, const NumbersPair& from) {
        const auto& [gradient, start] = from;
        moved |= start.x != 0 || start.y != 0 || start.z != 0;
        put({-gradient.x, -gradient.y, -gradient.z}, residual, i);
        put(start, direction, i);
        put({}, change, i);
        put_search(i, start);
      });
  const bool starts_elsewhere = any_of_team(moved != 0);
  if (starts_elsewhere) {
    StepsOnTheirWay<float> steps(sheet, sheet.single_step_values, v.step_ring);
    multiply_search(steps);
    synchronize_team();
    for_own_vertices(
        size, [&](int i) { return numbers_at(v.image, i); },
        [&](int i, const Numbers3& own) { put(own, change, i); });
  }
  // The norm of the residual, of which `step` times the image is taken off. What the restrictions leave
  // becomes the next right-hand side of the factor. Behind a barrier.
  float* norm_partial = partial + seats;
  const auto take_residual = [&](float step) {
    put_zero(fronts, v.solved);
    add_up<1, 2>(
        size, norm_partial,
        [&](int i) {
          const Numbers3 own = numbers_at(residual, i);
          const Numbers3 left = step == 0 ? own : scaled_sum(own, -step, numbers_at(v.image, i));
          return free_part(restrictions, i, left);
        },
        [&](int i, const Numbers3& left, float(&squares)[1]) {
          put(left, residual, i);
          if (v.solved_on_chip)
            put_in_all(reinterpret_cast<Numbers3*>(preconditioned) + i, left);
          else
            put(left, preconditioned, i);
          squares[0] += product(left, left);
        });
    synchronize_team();
    return sqrtf(total(size, norm_partial));
  };
  // Goes a step along the search direction, the image with it.
  const auto go = [&](float step) {
    for_own_vertices(
        size,
        [&](int i) {
          const Four<float> along = v.near[i];
          return NumbersPair{scaled_sum(numbers_at(direction, i), step, {along.x, along.y, along.z}),
                             scaled_sum(numbers_at(change, i), step, numbers_at(v.image, i))};
        },
        [&](int i, const NumbersPair& next) {
          put(next.first, direction, i);
          put(next.second, change, i);
        });
  };
  float norm = take_residual(starts_elsewhere ? 1.0f : 0.0f), previous = 0;
  const float first_residual = norm, target = fmaxf(static_cast<float>(enough) * norm, problem.tolerance);
  int iteration = 0;
  while (norm > target && iteration < most_solves) {
    ++iteration;
    v.clock.count(ReplayPhase::directions);
    solve<parts>(fronts, problem.factor, v, chip);
    v.clock.count(ReplayPhase::solves);
    // Nothing that follows keeps the product's numbers from being sent for.
    StepsOnTheirWay<float> steps(sheet, sheet.single_step_values, v.step_ring);
    // The residual has free parts alone, so that those of what the factor gives need not be taken for this.
    add_up<1, 2>(
        size, partial, [&](int i) { return product(numbers_at(residual, i), numbers_at(preconditioned, i)); },
        [&](int, float own, float(&sum)[1]) { sum[0] += own; });
    synchronize_team();
    const float along = total(size, partial);
    const float kept = iteration == 1 ? 0 : along / previous;
    previous = along;
    for_own_vertices(
        size,
        [&](int i) {
          const Four<float> last = v.search[i];
          const Numbers3 own = free_part(restrictions, i, numbers_at(preconditioned, i));
          return iteration == 1 ? own : scaled_sum(own, kept, {last.x, last.y, last.z});
        },
        put_search);
    synchronize_team();
    v.clock.count(ReplayPhase::directions);
    const float curvature = multiply_search(steps);
    v.clock.count(ReplayPhase::products);
    // Where the sheet is about to buckle the matrix is indefinite, and what was found so far leads down.
    if (curvature <= 0 && iteration > 1) break;
    const float step = curvature > 0 ? along / curvature : 1;
    go(step);
    if (curvature <= 0) break;
    norm = take_residual(step);
  }
  synchronize_team();
  return {iteration, first_residual};
}

}  // namespace flash::sim::cuda
