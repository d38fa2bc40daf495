#include "sim/cuda/batch_kernels.h"

#include <algorithm>

#include "sim/cuda/conjugate_gradients.cuh"
#include "sim/cuda/elastic_gradient.cuh"
#include "sim/cuda/front_factor.cuh"
#include "sim/cuda/launch.h"
#include "sim/cuda/membrane_hessian.cuh"

namespace flash::sim::cuda {
namespace {

__device__ const float* vector_of(const BatchNumbers& batch, int e) {
  return batch.vectors + 3L * batch.sheet.size * e;
}
__device__ float* result_of(const BatchNumbers& batch, int e) {
  return batch.results + 3L * batch.sheet.size * e;
}
__device__ const Point* places_of(const BatchNumbers& batch, int e) {
  return batch.positions + static_cast<long>(batch.sheet.size) * e;
}
template <int parts>
__device__ __half* factor_of(const BatchNumbers& batch, int e) {
  return batch.factors + static_cast<long>(batch.fronts.factor_tiles) * parts * solve_tile_numbers * e;
}
__device__ LinearVectors linear_vectors(const BatchNumbers& batch) {
  const long team = blockIdx.x, size = 3L * batch.sheet.size;
  return {batch.residuals + size * team, batch.images + size * team, batch.searches + batch.sheet.size * team,
          batch.searches + batch.sheet.size * team, batch.solved + batch.fronts.vector_size * team};
}

// A kernel's block goes through the environments that are its own.
#define FOR_OWN_ENVIRONMENTS(batch, e) \
  for (int e = static_cast<int>(blockIdx.x); e < (batch).environment_count; e += static_cast<int>(gridDim.x))

template <bool places_on_chip>
__global__ void __launch_bounds__(block_threads, resident_blocks_each)
    evaluate_kernel(const __grid_constant__ BatchNumbers batch, float) {
  const int triangles = batch.sheet.triangle_count;
  FOR_OWN_ENVIRONMENTS(batch, e) {
    const ElasticEnergies energy = elastic_gradient<places_on_chip>(
        batch.sheet, batch.environments[e], {}, places_of(batch, e),
        batch.gradients + 3L * batch.sheet.size * e,
        {batch.triangle_gradients + 9L * triangles * blockIdx.x, nullptr}, shared_memory<double>());
    if (team_rank() == 0) batch.energies[e] = energy;
    synchronize_team();
  }
}

template <bool Preconditioner>
__global__ void __launch_bounds__(block_threads, resident_blocks_each)
    assemble_kernel(const __grid_constant__ BatchNumbers batch, float) {
  float* chip = shared_memory<float>();
  float* shares = batch.shares + 3L * share_step<false> * batch.sheet.triangle_count * blockIdx.x;
  FOR_OWN_ENVIRONMENTS(batch, e) {
    write_shares<false>(batch.sheet, batch.environments[e], {}, places_of(batch, e), Preconditioner, shares,
                        chip);
    synchronize_team();
    if constexpr (Preconditioner)
      assemble_blocks<false>(batch.sheet, batch.environments[e], {}, {}, shares,
                             batch.blocks + 9L * batch.sheet.block_count * e, chip);
    else
      assemble_block_rows<false>(batch.sheet, batch.environments[e], shares,
                                 batch.block_rows + batch.block_row_size * e, chip);
    synchronize_team();
  }
}

template <int parts>
__global__ void __launch_bounds__(block_threads, resident_blocks_each)
    factorize_kernel(const __grid_constant__ BatchNumbers batch, float) {
  FOR_OWN_ENVIRONMENTS(batch, e) {
    if (team_rank() == 0) batch.positive[e] = 1;
    const bool positive = factorize<parts>(batch.fronts, batch.blocks + 9L * batch.sheet.block_count * e,
                                           batch.updates + batch.fronts.update_size * blockIdx.x,
                                           factor_of<parts>(batch, e), shared_memory<float>());
    if (!positive) batch.positive[e] = 0;
  }
}

template <int parts>
__global__ void __launch_bounds__(block_threads, resident_blocks_each)
    solve_kernel(const __grid_constant__ BatchNumbers batch, float) {
  const int size = 3 * batch.sheet.size;
  FOR_OWN_ENVIRONMENTS(batch, e) {
    const LinearVectors v = linear_vectors(batch);
    for (int i = team_rank(); i < size; i += team_size()) v.solved[size + i] = vector_of(batch, e)[i];
    put_zero(batch.fronts, v.solved);
    synchronize_team();
    solve<parts>(batch.fronts, factor_of<parts>(batch, e), v, shared_memory<char>());
    for (int i = team_rank(); i < size; i += team_size()) result_of(batch, e)[i] = v.solved[size + i];
    synchronize_team();
  }
}

__global__ void __launch_bounds__(block_threads, resident_blocks_each)
    multiply_kernel(const __grid_constant__ BatchNumbers batch, float) {
  FOR_OWN_ENVIRONMENTS(batch, e) {
    Four<float>* x = linear_vectors(batch).search;
    for (int i = team_rank(); i < batch.sheet.size; i += team_size()) {
      const float* from = vector_of(batch, e) + 3 * i;
      x[i] = {from[0], from[1], from[2], 0};
    }
    synchronize_team();
    StepsOnTheirWay<float> steps(batch.sheet, batch.sheet.single_step_values, {});
    multiply(batch.sheet, batch.block_rows + batch.block_row_size * e,
             static_cast<float>(batch.environments[e].rigidity), {}, steps, x, result_of(batch, e),
             shared_memory<float>());
    synchronize_team();
  }
}

template <int parts>
__global__ void __launch_bounds__(block_threads, resident_blocks_each)
    find_directions_kernel(const __grid_constant__ BatchNumbers batch, float tolerance) {
  float* chip = shared_memory<float>();
  FOR_OWN_ENVIRONMENTS(batch, e) {
    const LinearProblem problem = {
        batch.block_rows + batch.block_row_size * e,
        static_cast<float>(batch.environments[e].rigidity),
        {},
        factor_of<parts>(batch, e),
        vector_of(batch, e),
        {batch.restrictions + static_cast<long>(batch.restrictions_each) * e, batch.restriction_counts[e],
         batch.restriction_of + static_cast<long>(batch.restrictions_each) * e},
        tolerance};
    const LinearEnd end = conjugate_gradients<parts>(
        batch.fronts, batch.sheet, problem, linear_vectors(batch), result_of(batch, e),
        batch.changes + 3L * batch.sheet.size * e, chip, reinterpret_cast<char*>(chip + linear_partials));
    if (team_rank() == 0) batch.solves[e] = end.solves;
  }
}

/// A kernel and the on-chip memory of a team [bytes].
struct Choice {
  void (*kernel)(BatchNumbers, float);
  int bytes;
};

/// Places on chip where all teams find room.
Choice evaluation(int size) {
  const int near = gradient_memory(size, true);
  return resident_blocks_each * (near + 1024) <= most_memory()
             ? Choice{evaluate_kernel<true>, near}
             : Choice{evaluate_kernel<false>, gradient_memory(size, false)};
}

template <int parts>
Choice choice(BatchKernel kernel, const FrontTables& fronts) {
  const int number = sizeof(float), solve_bytes = solve_memory<parts>(fronts.solve_depth);
  switch (kernel) {
    case BatchKernel::evaluate:
      return evaluation(fronts.size);
    case BatchKernel::assemble_matrix:
      return {assemble_kernel<false>, hessian_memory * number};
    case BatchKernel::assemble_preconditioner:
      return {assemble_kernel<true>, hessian_memory * number};
    case BatchKernel::factorize:
      return {factorize_kernel<parts>, number * factor_memory(fronts.shared_panel)};
    case BatchKernel::multiply:
      return {multiply_kernel, seats * number};
    case BatchKernel::solve:
      return {solve_kernel<parts>, solve_bytes};
    case BatchKernel::find_directions:
      break;
  }
  return {find_directions_kernel<parts>, solve_bytes + number * linear_partials};
}

Choice choice(BatchKernel kernel, FactorPrecision precision, const FrontTables& fronts) {
  return precision == FactorPrecision::half ? choice<half_parts>(kernel, fronts)
                                            : choice<single_parts>(kernel, fronts);
}

}  // namespace

int resident_teams(BatchKernel kernel, FactorPrecision precision, const FrontTables& fronts) {
  const Choice chosen = choice(kernel, precision, fronts);
  return resident_teams(chosen.kernel, chosen.bytes);
}

void run(BatchKernel kernel, FactorPrecision precision, const BatchNumbers& numbers, int teams,
         float tolerance, cudaStream_t stream) {
  const Choice chosen = choice(kernel, precision, numbers.fronts);
  const TeamLaunch teams_at_once(std::min(teams, resident_teams(chosen.kernel, chosen.bytes)), 1,
                                 chosen.bytes, stream);
  launch(chosen.kernel, teams_at_once, numbers, tolerance);
}

}  // namespace flash::sim::cuda
