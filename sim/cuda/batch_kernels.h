#pragma once
#include <cuda_fp16.h>
#include <cuda_runtime.h>

#include "sim/cuda/environment_numbers.h"
#include "sim/cuda/four.h"
#include "sim/cuda/front_tables.h"
#include "sim/cuda/sheet_tables.h"

namespace flash::sim::cuda {

/// What the kernels of a batch know: the plan, all environments, and memory of each team. Vectors have three
/// numbers a vertex, in the order of elimination.
struct BatchNumbers {
  FrontTables fronts;
  SheetTables sheet;
  int environment_count, restrictions_each;
  const EnvironmentNumbers* environments;
  const Point* positions;
  const float* vectors;
  const VertexRestriction* restrictions;
  const int *restriction_counts, *restriction_of;
  float *results, *changes;
  double* gradients;
  ElasticEnergies* energies;
  long block_row_size;
  float *block_rows, *blocks;
  __half* factors;
  int *positive, *solves;
  // Of a team.
  double* triangle_gradients;
  float *shares, *updates, *solved, *residuals, *images;
  Four<float>* searches;
};

enum class BatchKernel {
  evaluate,
  assemble_matrix,
  assemble_preconditioner,
  factorize,
  multiply,
  solve,
  find_directions
};
inline constexpr BatchKernel batch_kernels[] = {
    BatchKernel::evaluate,       BatchKernel::assemble_matrix, BatchKernel::assemble_preconditioner,
    BatchKernel::factorize,      BatchKernel::multiply,        BatchKernel::solve,
    BatchKernel::find_directions};

/// Teams that the device runs at the same time.
int resident_teams(BatchKernel kernel, FactorPrecision precision, const FrontTables& fronts);

/// Queues a kernel for all environments, on at most `teams` teams. `tolerance` of find_directions [N].
void run(BatchKernel kernel, FactorPrecision precision, const BatchNumbers& numbers, int teams,
         float tolerance, cudaStream_t stream);

}  // namespace flash::sim::cuda
