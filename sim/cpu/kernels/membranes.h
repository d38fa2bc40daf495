#pragma once
#include "sim/cpu/kernels.h"
#include "sim/cpu/kernels/four.h"
#include "sim/law/membrane_response.h"

namespace flash::sim {
inline namespace FLASH_LEVEL {

// Triangles go through the formulas as many together as a register takes.
static_assert(triangle_group_size % lane_count == 0);

using Triple = Vector3<Lanes>;

/// Positions of one vertex of each lane's triangle.
inline Triple gather(const double* positions, const int* vertices) {
  alignas(64) double x[lane_count], y[lane_count], z[lane_count];
  for (int lane = 0; lane < lane_count; ++lane) {
    const double* row = positions + 3L * vertices[lane];
    x[lane] = row[0];
    y[lane] = row[1];
    z[lane] = row[2];
  }
  return {load_lanes(x), load_lanes(y), load_lanes(z)};
}

/// Singular frames of the group's triangles from `first` on.
inline SingularFrame<Lanes> frame_of(const TriangleGroup& group, int first, const double* positions) {
  const Triple x0 = gather(positions, group.vertices[0] + first);
  const Triple e1 = gather(positions, group.vertices[1] + first) - x0,
               e2 = gather(positions, group.vertices[2] + first) - x0;
  const Lanes w10 = load_lanes(group.gradients[0] + first), w11 = load_lanes(group.gradients[1] + first),
              w20 = load_lanes(group.gradients[2] + first), w21 = load_lanes(group.gradients[3] + first);
  return singular_frame(w10 * e1 + w20 * e2, w11 * e1 + w21 * e2);
}

/// A 3 x 3 block for each lane, stored by columns.
struct BlockLanes {
  Triple columns[3];
};

inline BlockLanes operator+(const BlockLanes& a, const BlockLanes& b) {
  return {{a.columns[0] + b.columns[0], a.columns[1] + b.columns[1], a.columns[2] + b.columns[2]}};
}
inline BlockLanes negative(const BlockLanes& a) {
  const Lanes minus = Lanes{} - 1.0;
  return {{minus * a.columns[0], minus * a.columns[1], minus * a.columns[2]}};
}
inline BlockLanes transposed(const BlockLanes& a) {
  const Triple* c = a.columns;
  return {{{c[0].x, c[1].x, c[2].x}, {c[0].y, c[1].y, c[2].y}, {c[0].z, c[1].z, c[2].z}}};
}

/// Turns four lanes of four vectors into four vectors of four numbers.
inline void transpose(FourOf<double>::type (&rows)[4]) {
  using Four = FourOf<double>::type;
  const Four a = __builtin_shufflevector(rows[0], rows[1], 0, 4, 2, 6),
             b = __builtin_shufflevector(rows[0], rows[1], 1, 5, 3, 7),
             c = __builtin_shufflevector(rows[2], rows[3], 0, 4, 2, 6),
             d = __builtin_shufflevector(rows[2], rows[3], 1, 5, 3, 7);
  rows[0] = __builtin_shufflevector(a, c, 0, 1, 4, 5);
  rows[1] = __builtin_shufflevector(b, d, 0, 1, 4, 5);
  rows[2] = __builtin_shufflevector(a, c, 2, 3, 6, 7);
  rows[3] = __builtin_shufflevector(b, d, 2, 3, 6, 7);
}

/// Adds each lane of `block` to the matrix block that it belongs to.
inline void scatter(const BlockLanes& block, const int* slots, int count, double* values) {
  const Triple* c = block.columns;
  const Lanes entries[9] = {c[0].x, c[0].y, c[0].z, c[1].x, c[1].y, c[1].z, c[2].x, c[2].y, c[2].z};
  if constexpr (lane_count < 4) {
    for (int lane = 0; lane < count; ++lane)
      for (int k = 0; k < 9; ++k) values[9L * slots[lane] + k] += entries[k][lane];
  } else {
    alignas(64) double numbers[9][lane_count];
    for (int k = 0; k < 9; ++k) store_lanes(entries[k], numbers[k]);
    for (int first = 0; first < count; first += 4) {
      FourOf<double>::type low[4], high[4];
      for (int k = 0; k < 4; ++k) {
        low[k] = load_four(numbers[k] + first);
        high[k] = load_four(numbers[k + 4] + first);
      }
      transpose(low);
      transpose(high);
      for (int lane = 0; lane < 4 && first + lane < count; ++lane) {
        double* target = values + 9L * slots[first + lane];
        store_four<double>(load_four(target) + low[lane], target);
        store_four<double>(load_four(target + 4) + high[lane], target + 4);
        target[8] += numbers[8][first + lane];
      }
    }
  }
}

inline void scatter(const Triple& rows, const int* vertices, int count, double* points) {
  alignas(64) double x[lane_count], y[lane_count], z[lane_count];
  store_lanes(rows.x, x);
  store_lanes(rows.y, y);
  store_lanes(rows.z, z);
  for (int lane = 0; lane < count; ++lane) {
    double* row = points + 3L * vertices[lane];
    row[0] += x[lane];
    row[1] += y[lane];
    row[2] += z[lane];
  }
}

inline int count_from(const TriangleGroup& group, int first) {
  return group.count - first < lane_count ? group.count - first : lane_count;
}

template <typename Law>
double add_gradient(const SheetLame& lame, const TriangleGroup* groups, long count, const double* positions,
                    double* gradient) {
  double energy = 0;
  for (const TriangleGroup* group = groups; group != groups + count; ++group) {
    double energies[triangle_group_size] = {};
    for (int first = 0; first < group->count; first += lane_count) {
      const SingularFrame<Lanes> frame = frame_of(*group, first, positions);
      const PrincipalResponse<Lanes> response = Law::at(frame.s1, frame.s2, lame.mu, lame.lambda);
      const StressColumns<Lanes> stress = stress_of(frame, response);
      const Lanes area = load_lanes(group->area + first);
      const auto along = [&](int k) {
        return area * (load_lanes(group->gradients[k] + first) * stress.p1 +
                       load_lanes(group->gradients[k + 1] + first) * stress.p2);
      };
      const Triple g1 = along(0), g2 = along(2), g0 = Lanes(Lanes{} - 1.0) * (g1 + g2);
      const int own = count_from(*group, first);
      scatter(g0, group->vertices[0] + first, own, gradient);
      scatter(g1, group->vertices[1] + first, own, gradient);
      scatter(g2, group->vertices[2] + first, own, gradient);
      store_lanes(area * response.energy, energies + first);
    }
    for (int lane = group->count; lane < triangle_group_size; ++lane) energies[lane] = 0;
    // The order of the sum is fixed: the same numbers give the same sum at every level.
    energy += ((energies[0] + energies[1]) + (energies[2] + energies[3])) +
              ((energies[4] + energies[5]) + (energies[6] + energies[7]));
  }
  return energy;
}

template <typename Law>
void add_hessian(const SheetLame& lame, const TriangleGroup* groups, long count, const double* positions,
                 double scale, bool positive, double* values) {
  for (const TriangleGroup* group = groups; group != groups + count; ++group) {
    for (int first = 0; first < group->count; first += lane_count) {
      const SingularFrame<Lanes> frame = frame_of(*group, first, positions);
      PrincipalResponse<Lanes> response = Law::at(frame.s1, frame.s2, lame.mu, lame.lambda);
      if (positive) clamp(response);
      const HessianBlocks<Lanes> H = hessian_of(frame, response);
      const Lanes factor = scale * load_lanes(group->area + first);
      // sum_cd w_ic w_jd H_cd, where H_10 = H_01^T.
      const auto block = [&](int i, int j) {
        const Lanes i0 = factor * load_lanes(group->gradients[2 * i - 2] + first),
                    i1 = factor * load_lanes(group->gradients[2 * i - 1] + first);
        const Lanes j0 = load_lanes(group->gradients[2 * j - 2] + first),
                    j1 = load_lanes(group->gradients[2 * j - 1] + first);
        const BlockLanes turned = transposed({{H.h01[0], H.h01[1], H.h01[2]}});
        BlockLanes sum;
        for (int c = 0; c < 3; ++c)
          sum.columns[c] = Lanes(i0 * j0) * H.h00[c] + Lanes(i0 * j1) * H.h01[c] +
                           Lanes(i1 * j0) * turned.columns[c] + Lanes(i1 * j1) * H.h11[c];
        return sum;
      };
      // Rows and columns of a triangle sum to zero.
      const BlockLanes b11 = block(1, 1), b22 = block(2, 2), b21 = block(2, 1);
      const BlockLanes b10 = negative(b11 + transposed(b21)), b20 = negative(b21 + b22),
                       b00 = negative(b10 + b20);
      const int own = count_from(*group, first);
      scatter(b00, group->vertices[0] + first, own, values);
      scatter(b11, group->vertices[1] + first, own, values);
      scatter(b22, group->vertices[2] + first, own, values);
      scatter(b10, group->slots[0] + first, own, values);
      scatter(b20, group->slots[1] + first, own, values);
      scatter(b21, group->slots[2] + first, own, values);
    }
  }
}

inline double add_membrane_gradient(MembraneLaw law, const SheetLame& lame, const TriangleGroup* groups,
                                    long count, const double* positions, double* gradient) {
  return with_membrane_law(law, [&](auto formulas) {
    return add_gradient<decltype(formulas)>(lame, groups, count, positions, gradient);
  });
}

inline void add_membrane_hessian(MembraneLaw law, const SheetLame& lame, const TriangleGroup* groups,
                                 long count, const double* positions, double scale, bool positive,
                                 double* values) {
  with_membrane_law(law, [&](auto formulas) {
    add_hessian<decltype(formulas)>(lame, groups, count, positions, scale, positive, values);
  });
}

}  // namespace FLASH_LEVEL
}  // namespace flash::sim
