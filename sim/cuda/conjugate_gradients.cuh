#pragma once
#include "sim/cuda/environment_numbers.h"
#include "sim/cuda/front_solve.cuh"
#include "sim/cuda/phase_clock.h"
#include "sim/cuda/sheet_product.cuh"

namespace flash::sim::cuda {

// Conjugate gradients of one environment, as NewtonMatrix::solve of the CPU. A thread owns the numbers i,
// i + team_threads, ... of each vector.

/// The linear problem of an environment.
struct LinearProblem {
  const float* block_rows;
  float rigidity;
  HingeMatrix hinges;
  const __half* factor;
  const float* gradient;
  Restrictions restrictions;
  float tolerance;
};

/// Memory of a team, three numbers a vertex but where said.
struct LinearVectors {
  float *residual, *image;
  Four<float>* search;  ///< four
  Four<float>* near;    ///< four: a copy of `search` for products on chip, free during a solve; or `search`
  float* solved;        ///< what a solve works on (solve_chunk.h)
  bool solved_on_chip = false;
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

__device__ inline void restrict_to_free(const Restrictions& restrictions, float* x) {
  if (restrictions.count == 0) return;
  __syncthreads();
  for (int k = static_cast<int>(threadIdx.x); k < restrictions.count; k += team_threads) {
    const VertexRestriction& restriction = restrictions.list[k];
    float* own = x + 3 * restriction.place;
    const float a = own[0], b = own[1], c = own[2];
    const float* free = restriction.free;
    for (int r = 0; r < 3; ++r) own[r] = free[r] * a + free[3 + r] * b + free[6 + r] * c;
  }
  __syncthreads();
}

/// `direction` = the solution over the free directions, `change` = matrix * direction. Stops as the CPU does:
/// at a tenth of the residual, at the tolerance, where the matrix curves down, after `most` iterations.
/// Returns the number of solves with the factor, to all threads. `partial`, `chip`: on chip, a number a warp
/// and solve_memory.
template <int parts>
__device__ int conjugate_gradients(const FrontTables& fronts, const SheetTables& sheet,
                                   const LinearProblem& problem, const LinearVectors& v, float* direction,
                                   float* change, float* partial, char* chip) {
  constexpr int most = 20;
  const int size = 3 * sheet.size, first = static_cast<int>(threadIdx.x);
  float* search = reinterpret_cast<float*>(v.search);
  float* preconditioned = v.solved + size;
  const auto slot = [](int i) { return i / 3 * 4 + i % 3; };
  const auto restricted = [&](float* x) { restrict_to_free(problem.restrictions, x); };
  for (int i = first; i < size; i += team_threads) {
    v.residual[i] = -problem.gradient[i];
    direction[i] = change[i] = search[slot(i)] = 0;
  }
  __syncthreads();
  int moved = 0;
  for (int k = first; k < problem.restrictions.count; k += team_threads) {
    const VertexRestriction& restriction = problem.restrictions.list[k];
    for (int c = 0; c < 3; ++c) {
      moved += restriction.correction[c] != 0;
      direction[3 * restriction.place + c] = search[4 * restriction.place + c] = restriction.correction[c];
    }
  }
  // The copy is of the thread's own numbers.
  const auto copy_search = [&] {
    if (v.near == v.search) return;
    for (int i = first; i < size; i += team_threads)
      reinterpret_cast<float*>(v.near)[slot(i)] = search[slot(i)];
  };
  if (sum_over_team(static_cast<float>(moved), partial) > 0) {
    copy_search();
    __syncthreads();
    multiply(sheet, problem.block_rows, problem.rigidity, problem.hinges, v.near, v.image);
    for (int i = first; i < size; i += team_threads) {
      v.residual[i] -= v.image[i];
      change[i] += v.image[i];
    }
  }
  // The residual's norm; it becomes the next right-hand side of the factor.
  const auto take_residual = [&] {
    restricted(v.residual);
    float squares = 0;
    for (int i = first; i < size; i += team_threads) {
      const float own = v.residual[i];
      preconditioned[i] = own;
      squares += own * own;
    }
    return sqrtf(sum_over_team(squares, partial));
  };
  float norm = take_residual(), previous = 0;
  const float target = fmaxf(0.1f * norm, problem.tolerance);
  int iteration = 0;
  while (norm > target && iteration < most) {
    ++iteration;
    v.clock.count(ReplayPhase::directions);
    solve<parts>(fronts, problem.factor, v, chip);
    v.clock.count(ReplayPhase::solves);
    restricted(preconditioned);
    float product = 0;
    for (int i = first; i < size; i += team_threads) product += v.residual[i] * preconditioned[i];
    const float along = sum_over_team(product, partial);
    const float kept = iteration == 1 ? 0 : along / previous;
    previous = along;
    float* near = reinterpret_cast<float*>(v.near);
    for (int i = first; i < size; i += team_threads) {
      const float own = preconditioned[i] + (iteration == 1 ? 0 : kept * search[slot(i)]);
      search[slot(i)] = own;
      near[slot(i)] = own;
    }
    __syncthreads();
    v.clock.count(ReplayPhase::directions);
    product = multiply(sheet, problem.block_rows, problem.rigidity, problem.hinges, v.near, v.image);
    const float curvature = sum_over_team(product, partial);
    v.clock.count(ReplayPhase::products);
    // Where the sheet is about to buckle the matrix is indefinite, and what was found so far leads down.
    if (curvature <= 0 && iteration > 1) break;
    const float step = curvature > 0 ? along / curvature : 1;
    for (int i = first; i < size; i += team_threads) {
      const float image = step * v.image[i];
      direction[i] += step * near[slot(i)];
      change[i] += image;
      v.residual[i] -= image;
    }
    if (curvature <= 0) break;
    norm = take_residual();
  }
  __syncthreads();
  return iteration;
}

}  // namespace flash::sim::cuda
