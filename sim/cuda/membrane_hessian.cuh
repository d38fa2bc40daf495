#pragma once
#include "sim/cuda/hinges.cuh"
#include "sim/cuda/membrane.cuh"
#include "sim/cuda/membrane_damping.cuh"
#include "sim/cuda/scalar_rows.cuh"
#include "sim/cuda/team.cuh"

namespace flash::sim::cuda {

// The Hessian of the membrane. What a triangle's corners i and j share is
//   b_ij = area sum_ab q_ia q_jb B_ab,  q_i = (w_i . v_1, w_i . v_2),
// with B_ab as at hessian_of (sim/law/membrane_response.h): five products of u1, u2 and n. A thread takes a
// triangle: singular values in double precision, where differences of places and of singular values cancel,
// the rest in single. It writes its three blocks off the diagonal; since a move of the whole sheet costs
// nothing, blocks on the diagonal are what the others of their row lack to zero. Then a thread takes a row.

/// Numbers from one block of a triangle to the next: column after column, and in memory three unused, so that
/// a block is read by fours. On chip an odd number from one triangle to the next spreads them over the banks.
template <bool on_chip>
inline constexpr int share_step = on_chip ? 9 : 12;

/// Through these on chip a warp writes what its lanes have one after the other.
inline constexpr int hessian_memory = block_threads * 3 * share_step<false>;

/// On-chip numbers of a matrix whose triangles' shares are there too, behind nine numbers a thread.
FLASH_HOST_DEVICE inline int hessian_memory_with_shares(int triangles) {
  return 9 * block_threads + 3 * share_step<true> * triangles;
}

/// The blocks (1,0), (2,0), (2,1) of each triangle, with its damping since `start`. `positive`: of the
/// Hessian without negative eigenvalues. `chip`: hessian_memory, where the shares are not on chip.
template <bool on_chip>
__device__ void write_shares(const SheetTables& tables, const EnvironmentNumbers& environment,
                             const StepStart& start, const Point* positions, bool positive, float* shares,
                             float* chip) {
  constexpr int block_numbers = share_step<on_chip>, fours = 3 * share_step<false> / 4;
  Float4* own_chip = reinterpret_cast<Float4*>(chip) + warp_lanes * fours * warp();
  for (int first = warp_lanes * team_warp(); first < tables.triangle_count; first += team_size()) {
    const int t = min(first + lane(), tables.triangle_count - 1);
    const TriangleFrame f = triangle_frame(tables, t, [&](int vertex) { return triple(positions[vertex]); });
    PrincipalResponse<double> response = response_at(environment, f.frame.s1, f.frame.s2);
    if (positive) clamp(response);
    const auto single = [](double x) { return static_cast<float>(x); };
    const auto moduli = [&](double x) { return static_cast<float>(f.area * x); };
    const float u[3] = {single(f.frame.u1.x), single(f.frame.u1.y), single(f.frame.u1.z)},
                v[3] = {single(f.frame.u2.x), single(f.frame.u2.y), single(f.frame.u2.z)},
                n[3] = {single(f.frame.n.x), single(f.frame.n.y), single(f.frame.n.z)};
    const float p11 = moduli(response.p11), p12 = moduli(response.p12), p22 = moduli(response.p22),
                m = moduli(0.5 * (response.flip + response.twist)),
                k = moduli(0.5 * (response.flip - response.twist)), bend1 = moduli(response.bend1),
                bend2 = moduli(response.bend2);
    const double c = f.frame.c, s = f.frame.s;
    float q[3][2] = {{},
                     {single(c * f.w10 + s * f.w11), single(c * f.w11 - s * f.w10)},
                     {single(c * f.w20 + s * f.w21), single(c * f.w21 - s * f.w20)}};
    q[0][0] = -(q[1][0] + q[2][0]);
    q[0][1] = -(q[1][1] + q[2][1]);
#pragma unroll
    for (int b = 0; b < 3; ++b) {
      const float *i = q[b == 0 ? 1 : 2], *j = q[b == 2 ? 1 : 0];
      const float ones = i[0] * j[0], twos = i[1] * j[1], rising = i[0] * j[1], falling = i[1] * j[0];
      const float uu = ones * p11 + twos * m, vv = ones * m + twos * p22, nn = ones * bend1 + twos * bend2,
                  uv = rising * p12 + falling * k, vu = rising * k + falling * p12;
      float numbers[block_numbers] = {};
#pragma unroll
      for (int column = 0; column < 3; ++column) {
        const float on_u = uu * u[column] + uv * v[column], on_v = vu * u[column] + vv * v[column],
                    on_n = nn * n[column];
#pragma unroll
        for (int row = 0; row < 3; ++row)
          numbers[3 * column + row] = on_u * u[row] + on_v * v[row] + on_n * n[row];
      }
      if constexpr (on_chip) {
        // Lanes beyond the last triangle write what it has.
#pragma unroll
        for (int e = 0; e < block_numbers; ++e) shares[block_numbers * (3 * t + b) + e] = numbers[e];
      } else {
#pragma unroll
        for (int e = 0; e < block_numbers / 4; ++e)
          own_chip[fours * lane() + block_numbers / 4 * b + e] = {numbers[4 * e], numbers[4 * e + 1],
                                                                  numbers[4 * e + 2], numbers[4 * e + 3]};
      }
    }
    if constexpr (on_chip) continue;
    synchronize_warp();
    const int count = fours * min(warp_lanes, tables.triangle_count - first);
    Float4* to = reinterpret_cast<Float4*>(shares) + fours * first;
    for (int i = lane(); i < count; i += warp_lanes) to[i] = own_chip[i];
    synchronize_warp();
  }
  if (start.metrics == nullptr) return;
  synchronize_team();
  add_damping_shares(
      tables, environment, start.metrics, [&](int vertex) { return triple(positions[vertex]); }, positive,
      block_numbers, shares);
}

/// Three by three numbers, column after column.
struct Block {
  float numbers[9];
};

/// What the triangles at an edge give.
template <bool on_chip>
__device__ Block sum_of_shares(const EdgeSources& sources, const float* shares) {
  const auto share = [&](int source) {
    if constexpr (on_chip) {
      Block block;
#pragma unroll
      for (int e = 0; e < 9; ++e)
        block.numbers[e] = source >= 0 ? shares[share_step<true> * source + e] : 0.0f;
      return block;
    } else {
      Float4 fours[3] = {};
      if (source >= 0) {
        const Float4* from = reinterpret_cast<const Float4*>(shares) + share_step<false> / 4 * source;
#pragma unroll
        for (int k = 0; k < 3; ++k) fours[k] = from[k];
      }
      return Block{{fours[0].x, fours[0].y, fours[0].z, fours[0].w, fours[1].x, fours[1].y, fours[1].z,
                    fours[1].w, fours[2].x}};
    }
  };
  Block sum = share(sources.first);
  const Block other = share(sources.second);
#pragma unroll
  for (int k = 0; k < 9; ++k) sum.numbers[k] += other.numbers[k];
  return sum;
}

/// Goes through the blocks of a row off its diagonal, work(slot, block), and returns that on it with the
/// inertia. `slot`: in SheetTables::slice_columns.
template <bool on_chip, typename Work>
__device__ Block go_through_row(const SheetTables& tables, const EnvironmentNumbers& environment, int vertex,
                                const float* shares, const Work& work) {
  const int slice = vertex / slice_size, end = tables.slice_starts[slice + 1];
  Block diagonal = {};
  // What so many blocks read is on its way together.
  constexpr int together = 2;
  for (int first = tables.slice_starts[slice] + 1; first < end; first += together) {
    EdgeSources sources[together];
    Block blocks[together];
#pragma unroll
    for (int k = 0; k < together; ++k)
      sources[k] = tables.slice_sources[min(first + k, end - 1) * slice_size + vertex % slice_size];
#pragma unroll
    for (int k = 0; k < together; ++k) blocks[k] = sum_of_shares<on_chip>(sources[k], shares);
#pragma unroll
    for (int k = 0; k < together; ++k) {
      if (first + k >= end) break;
      Block block = blocks[k];
      if (sources[k].turned) {
#pragma unroll
        for (int e = 0; e < 9; ++e) block.numbers[e] = blocks[k].numbers[e % 3 * 3 + e / 3];
      }
#pragma unroll
      for (int e = 0; e < 9; ++e) diagonal.numbers[e] -= block.numbers[e];
      work((first + k) * slice_size + vertex % slice_size, block);
    }
  }
  const float inertia =
      static_cast<float>(environment.inertia_density * tables.vertex_area[min(vertex, tables.size - 1)]);
  Block symmetric;
#pragma unroll
  for (int e = 0; e < 9; ++e)
    symmetric.numbers[e] =
        0.5f * (diagonal.numbers[e] + diagonal.numbers[e % 3 * 3 + e / 3]) + (e % 4 == 0 ? inertia : 0.0f);
  if (environment.own_blocks != nullptr) {
    const float* own = environment.own_blocks + 9 * min(vertex, tables.size - 1);
#pragma unroll
    for (int e = 0; e < 9; ++e) symmetric.numbers[e] += own[e];
  }
  return symmetric;
}

/// The Hessian of membrane and inertia as block rows (sheet_product.cuh). Hinges apart, these are all blocks.
/// `chip`: nine numbers a thread, through which a warp, that has a slice, writes.
template <bool on_chip>
__device__ void assemble_block_rows(const SheetTables& tables, const EnvironmentNumbers& environment,
                                    const float* shares, float* rows, float* chip) {
  float* own_chip = chip + slice_numbers * warp();
  const auto write = [&](int slot, const Block& block) {
    write_slice_block(block.numbers, slot % slice_size,
                      rows + static_cast<long>(slot / slice_size) * slice_numbers, own_chip);
  };
  for (int slice = team_warp(); slice_size * slice < tables.size; slice += team_warps())
    for_lanes([&](int lane) {
      const int vertex = slice_size * slice + lane;
      const Block diagonal = go_through_row<on_chip>(tables, environment, vertex, shares, write);
      write(tables.slice_starts[slice] * slice_size + lane, diagonal);
    });
}

/// Adds what the hinges give to block b of the pattern.
inline __device__ void add_hinge_blocks(const SheetTables& tables, const HingeMatrix& hinges, int b,
                                        Block& block) {
  for (int k = tables.hinge_source_starts[b]; k < tables.hinge_source_starts[b + 1]; ++k) {
    const int source = tables.hinge_sources[k];
    const float *row = hinges.gradients + 12L * (source / 16) + 3 * (source / 4 % 4),
                *column = hinges.gradients + 12L * (source / 16) + 3 * (source % 4);
#pragma unroll
    for (int e = 0; e < 9; ++e) block.numbers[e] += row[e % 3] * column[e / 3];
  }
}

/// Leaves of a block what moves in the free directions of both its vertices; on the diagonal the others stay
/// among themselves (restrict_matrix of sim/newton/active_set.h).
inline __device__ void restrict_block(const SheetTables& tables, const Restrictions& restrictions, int b,
                                      Block& block) {
  const int row = restrictions.of_place[tables.block_rows[b]],
            column = restrictions.of_place[tables.block_columns[b]];
  if (row < 0 && column < 0) return;
  const auto product = [](const float* left, const float* right) {
    Block result;
#pragma unroll
    for (int e = 0; e < 9; ++e)
      result.numbers[e] = left[e % 3] * right[e / 3 * 3] + left[3 + e % 3] * right[e / 3 * 3 + 1] +
                          left[6 + e % 3] * right[e / 3 * 3 + 2];
    return result;
  };
  const Block whole = block;
  if (row >= 0) block = product(restrictions.list[row].free, block.numbers);
  if (column >= 0) block = product(block.numbers, restrictions.list[column].free);
  if (b >= tables.size) return;
  float held[9];
#pragma unroll
  for (int e = 0; e < 9; ++e) held[e] = (e % 4 == 0 ? 1.0f : 0.0f) - restrictions.list[row].free[e];
  const Block among_held = product(product(held, whole.numbers).numbers, held);
#pragma unroll
  for (int e = 0; e < 9; ++e) block.numbers[e] += among_held.numbers[e];
}

/// The same with bending or the stand-in for it, as blocks of the pattern: what is factorized. `chip`: nine
/// numbers a thread, through which a warp writes its blocks one after the other.
template <bool on_chip>
__device__ void assemble_blocks(const SheetTables& tables, const EnvironmentNumbers& environment,
                                const Restrictions& restrictions, const HingeMatrix& hinges,
                                const float* shares, float* blocks, float* chip) {
  float* own_chip = chip + 9 * warp_lanes * warp();
  for (int first = warp_lanes * team_warp(); first < tables.block_count; first += team_size()) {
    const int b = min(first + lane(), tables.block_count - 1);
    Block block = b < tables.size ? go_through_row<on_chip>(tables, environment, tables.block_rows[b], shares,
                                                            [](int, const Block&) {})
                                  : sum_of_shares<on_chip>(tables.pair_sources[b - tables.size], shares);
    if (tables.stand_in != nullptr) {
      const float bending = static_cast<float>(environment.effective_rigidity()) * tables.stand_in[b];
      for (int e = 0; e < 9; e += 4) block.numbers[e] += bending;
    }
    if (hinges.gradients != nullptr) add_hinge_blocks(tables, hinges, b, block);
    if (restrictions.of_place != nullptr) restrict_block(tables, restrictions, b, block);
    for (int e = 0; e < 9; ++e) own_chip[9 * lane() + e] = block.numbers[e];
    synchronize_warp();
    const int count = 9 * min(warp_lanes, tables.block_count - first);
    for (int i = lane(); i < count; i += warp_lanes) blocks[9L * first + i] = own_chip[i];
    synchronize_warp();
  }
}

}  // namespace flash::sim::cuda
