#pragma once
#include "sim/cuda/conjugate_gradients.cuh"
#include "sim/cuda/replay_numbers.h"

namespace flash::sim::cuda {

/// A column of the small least-squares problem by the rotations of those before it; by one thread. Returns
/// the norm of what is left.
__device__ inline double rotate_column(double* small, int column) {
  double *h = small + column * small_columns, *rotations = small + most_directions * small_columns,
         *right = rotations + 2 * most_directions;
  for (int k = 0; k < column; ++k) {
    const double c = rotations[2 * k], s = rotations[2 * k + 1], upper = h[k];
    h[k] = c * upper + s * h[k + 1];
    h[k + 1] = c * h[k + 1] - s * upper;
  }
  const double length = hypot(h[column], h[column + 1]);
  const double c = length > 0 ? h[column] / length : 1, s = length > 0 ? h[column + 1] / length : 0;
  rotations[2 * column] = c;
  rotations[2 * column + 1] = s;
  h[column] = length;
  right[column + 1] = -s * right[column];
  right[column] *= c;
  return fabs(right[column + 1]);
}

/// The weights of the directions, behind the right-hand side; by one thread.
__device__ inline void solve_small(double* small, int count) {
  double *right = small + most_directions * small_columns + 2 * most_directions,
         *weights = right + small_columns;
  for (int k = count - 1; k >= 0; --k) {
    double sum = right[k];
    for (int j = k + 1; j < count; ++j) sum -= small[j * small_columns + k] * weights[j];
    const double own = small[k * small_columns + k];
    weights[k] = own != 0 ? sum / own : 0;
  }
}

/// The generalized minimal residual method for L A x = P b, as gmres of the CPU: `direction` = x over the
/// free directions, `change` = A x. Returns the number of solves with the factor, to all threads.
template <int parts>
__device__ int generalized_residuals(const FrontTables& fronts, const SheetTables& sheet,
                                     const LinearProblem& problem, const LinearVectors& v,
                                     const CoupledMemory& memory, float* direction, float* change,
                                     float* partial, char* chip) {
  const int size = 3 * sheet.size, first = team_rank(), step = team_size();
  // Each block fills its copy of a vector on chip.
  const int first_of_copy = block_rank();
  float *search = reinterpret_cast<float*>(v.search), *preconditioned = v.solved + size;
  const auto slot = [](int i) { return i / 3 * 4 + i % 3; };
  const Restrictions& restrictions = problem.restrictions;
  const auto apply_left = [&](float* x) {
    synchronize_team();
    for (int k = first; k < restrictions.count; k += step) {
      float* own = x + 3 * restrictions.list[k].place;
      const float a = own[0], b = own[1], c = own[2], *left = memory.left + 9 * k;
      for (int r = 0; r < 3; ++r) own[r] = left[r] * a + left[3 + r] * b + left[6 + r] * c;
    }
    synchronize_team();
  };
  // v.image = A x, x in the search vector.
  const auto multiply_search = [&] {
    synchronize_team();
    if (v.near != v.search) {
      for (int i = first_of_copy; i < 4 * sheet.size; i += block_size())
        reinterpret_cast<float*>(v.near)[i] = search[i];
      synchronize_team();
    }
    StepsOnTheirWay<float> steps(sheet, sheet.single_step_values, v.step_ring);
    multiply(sheet, problem.block_rows, problem.rigidity, problem.hinges, steps, v.near, v.image, partial);
    synchronize_team();
  };
  const auto norm_of = [&](const float* x) {
    float squares[1];
    sum_over_team(size, squares, partial, [&](int i, float(&own)[1]) { own[0] += x[i] * x[i]; });
    return sqrtf(squares[0]);
  };

  for (int i = first; i < size; i += step) {
    v.residual[i] = -problem.gradient[i];
    direction[i] = search[slot(i)] = 0;
  }
  for (int i = first; i < sheet.size; i += step) search[4 * i + 3] = 0;
  synchronize_team();
  for (int k = first; k < restrictions.count; k += step)
    for (int c = 0; c < 3; ++c) {
      const int at = restrictions.list[k].place;
      direction[3 * at + c] = search[4 * at + c] = restrictions.list[k].correction[c];
    }
  restrict_to_free(restrictions, v.residual, false);
  multiply_search();
  apply_left(v.image);
  for (int i = first; i < size; i += step) v.residual[i] -= v.image[i];
  const float norm = norm_of(v.residual),
              target = fmaxf(static_cast<float>(enough) * norm, problem.tolerance);
  double* right = memory.small + most_directions * small_columns + 2 * most_directions;
  if (first == 0) right[0] = norm;
  for (int i = first; i < size; i += step) memory.basis[i] = v.residual[i] / norm;
  int count = 0;
  for (float rest = norm; rest > target && count < most_directions;) {
    float* own_direction = memory.directions + static_cast<long>(count) * size;
    const float* last = memory.basis + static_cast<long>(count) * size;
    synchronize_team();
    for (int i = v.solved_on_chip ? first_of_copy : first; i < size;
         i += v.solved_on_chip ? block_size() : step)
      preconditioned[i] = last[i];
    put_zero(fronts, v.solved);
    synchronize_team();
    solve<parts>(fronts, problem.factor, v, chip);
    restrict_to_free(restrictions, preconditioned, v.solved_on_chip);
    synchronize_team();
    for (int i = first; i < size; i += step) own_direction[i] = search[slot(i)] = preconditioned[i];
    multiply_search();
    apply_left(v.image);
    for (int k = 0; k <= count; ++k) {
      const float* other = memory.basis + static_cast<long>(k) * size;
      float product[1];
      sum_over_team(size, product, partial, [&](int i, float(&own)[1]) { own[0] += other[i] * v.image[i]; });
      const float along = product[0];
      for (int i = first; i < size; i += step) v.image[i] -= along * other[i];
      if (first == 0) memory.small[count * small_columns + k] = along;
    }
    const float length = norm_of(v.image);
    for (int i = first; i < size; i += step)
      memory.basis[static_cast<long>(count + 1) * size + i] = length > 0 ? v.image[i] / length : 0;
    if (first == 0) {
      memory.small[count * small_columns + count + 1] = length;
      put_in_all(partial, static_cast<float>(rotate_column(memory.small, count)));
    }
    synchronize_team();
    rest = partial[0];
    synchronize_team();
    ++count;
    if (!(length > 0)) break;
  }
  if (first == 0) solve_small(memory.small, count);
  synchronize_team();
  const double* weights = right + small_columns;
  for (int i = first; i < size; i += step) {
    float sum = direction[i];
    for (int k = 0; k < count; ++k)
      sum += static_cast<float>(weights[k]) * memory.directions[static_cast<long>(k) * size + i];
    direction[i] = search[slot(i)] = sum;
  }
  multiply_search();
  for (int i = first; i < size; i += step) change[i] = v.image[i];
  synchronize_team();
  return count;
}

}  // namespace flash::sim::cuda
