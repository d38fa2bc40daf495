#include "sim/elastic_energy.h"

#include "sim/membrane_response.h"

namespace flash::sim {

namespace {

using data::Points;
using Eigen::Matrix3d;
using Eigen::Vector3d;

using Triple = Vector3<Lanes>;
static_assert(lane_count == triangle_group_size);

/// Rows of `points` at eight vertices.
Triple gather(const Points& points, const std::array<int, lane_count>& vertices) {
  alignas(64) double x[lane_count], y[lane_count], z[lane_count];
  for (int lane = 0; lane < lane_count; ++lane) {
    const double* row = points.data() + 3L * vertices[lane];
    x[lane] = row[0];
    y[lane] = row[1];
    z[lane] = row[2];
  }
  return {load_lanes(x), load_lanes(y), load_lanes(z)};
}

/// The group's triangles at `positions`.
SingularFrame<Lanes> frame_of(const TriangleGroup& group, const Points& positions) {
  const Triple x0 = gather(positions, group.vertices[0]);
  const Triple e1 = gather(positions, group.vertices[1]) - x0, e2 = gather(positions, group.vertices[2]) - x0;
  const Lanes w10 = load_lanes(group.gradients[0]), w11 = load_lanes(group.gradients[1]),
              w20 = load_lanes(group.gradients[2]), w21 = load_lanes(group.gradients[3]);
  return singular_frame(w10 * e1 + w20 * e2, w11 * e1 + w21 * e2);
}

/// Column after column.
struct BlockLanes {
  Triple columns[3];
};

BlockLanes operator+(const BlockLanes& a, const BlockLanes& b) {
  return {{a.columns[0] + b.columns[0], a.columns[1] + b.columns[1], a.columns[2] + b.columns[2]}};
}
BlockLanes negative(const BlockLanes& a) {
  const Lanes minus = Lanes{} - 1.0;
  return {{minus * a.columns[0], minus * a.columns[1], minus * a.columns[2]}};
}
BlockLanes transposed(const BlockLanes& a) {
  const auto& [c0, c1, c2] = a.columns;
  return {{{c0.x, c1.x, c2.x}, {c0.y, c1.y, c2.y}, {c0.z, c1.z, c2.z}}};
}

/// Adds lane after lane to the blocks it belongs to.
void scatter(const BlockLanes& block, const std::array<int, lane_count>& slots, int count,
             BlockValues<double>& values) {
  alignas(64) double entries[9][lane_count];
  for (int c = 0; c < 3; ++c) {
    store_lanes(block.columns[c].x, entries[3 * c]);
    store_lanes(block.columns[c].y, entries[3 * c + 1]);
    store_lanes(block.columns[c].z, entries[3 * c + 2]);
  }
  for (int lane = 0; lane < count; ++lane) {
    double* target = values.data() + 9L * slots[lane];
    for (int k = 0; k < 9; ++k) target[k] += entries[k][lane];
  }
}

void scatter(const Triple& rows, const std::array<int, lane_count>& vertices, int count, Points& points) {
  alignas(64) double x[lane_count], y[lane_count], z[lane_count];
  store_lanes(rows.x, x);
  store_lanes(rows.y, y);
  store_lanes(rows.z, z);
  for (int lane = 0; lane < count; ++lane) {
    double* row = points.data() + 3L * vertices[lane];
    row[0] += x[lane];
    row[1] += y[lane];
    row[2] += z[lane];
  }
}

template <typename Law>
double add_membrane_gradient(const SheetPlan& plan, const SheetLame& lame, const Points& positions,
                             Points& gradient) {
  double energy = 0;
  for (const TriangleGroup& group : plan.triangle_groups) {
    const SingularFrame<Lanes> frame = frame_of(group, positions);
    const PrincipalResponse<Lanes> response = Law::at(frame.s1, frame.s2, lame.mu, lame.lambda);
    const StressColumns<Lanes> stress = stress_of(frame, response);
    const Lanes area = load_lanes(group.area);
    const auto along = [&](int k) {
      return area *
             (load_lanes(group.gradients[k]) * stress.p1 + load_lanes(group.gradients[k + 1]) * stress.p2);
    };
    const Triple g1 = along(0), g2 = along(2), g0 = Lanes(Lanes{} - 1.0) * (g1 + g2);
    scatter(g0, group.vertices[0], group.count, gradient);
    scatter(g1, group.vertices[1], group.count, gradient);
    scatter(g2, group.vertices[2], group.count, gradient);
    Lanes energies = area * response.energy;
    for (int lane = group.count; lane < lane_count; ++lane) energies[lane] = 0;
    energy += sum_of(energies);
  }
  return energy;
}

template <typename Law>
void add_membrane_hessian(const SheetPlan& plan, const SheetLame& lame, const Points& positions, double scale,
                          Curvature curvature, BlockValues<double>& values) {
  for (const TriangleGroup& group : plan.triangle_groups) {
    const SingularFrame<Lanes> frame = frame_of(group, positions);
    PrincipalResponse<Lanes> response = Law::at(frame.s1, frame.s2, lame.mu, lame.lambda);
    if (curvature == Curvature::positive) clamp(response);
    const HessianBlocks<Lanes> H = hessian_of(frame, response);
    const Lanes factor = scale * load_lanes(group.area);
    // sum_cd w_ic w_jd H_cd, where H_10 = H_01^T.
    const auto block = [&](int i, int j) {
      const Lanes i0 = factor * load_lanes(group.gradients[2 * i - 2]),
                  i1 = factor * load_lanes(group.gradients[2 * i - 1]);
      const Lanes j0 = load_lanes(group.gradients[2 * j - 2]), j1 = load_lanes(group.gradients[2 * j - 1]);
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
    scatter(b00, group.vertices[0], group.count, values);
    scatter(b11, group.vertices[1], group.count, values);
    scatter(b22, group.vertices[2], group.count, values);
    scatter(b10, group.slots[0], group.count, values);
    scatter(b20, group.slots[1], group.count, values);
    scatter(b21, group.slots[2], group.count, values);
  }
}

void add_block(BlockValues<double>& values, BlockSlot slot, const Matrix3d& block) {
  Eigen::Map<Matrix3d> target(values.data() + 9L * slot.block);
  if (slot.transpose)
    target += block.transpose();
  else
    target += block;
}

/// Four numbers a vertex.
std::vector<double> padded_vertices(const Points& x) {
  std::vector<double> padded(4 * x.rows());
  for (long i = 0; i < x.rows(); ++i)
    for (int c = 0; c < 3; ++c) padded[4 * i + c] = x(i, c);
  return padded;
}

}  // namespace

ElasticEnergy add_elastic_gradient(const SheetPlan& plan, const BendingOperator& bending,
                                   const data::SheetMaterial& material, const data::Points& positions,
                                   data::Points& gradient) {
  ElasticEnergy energy;
  energy.membrane = with_membrane_law(
      material.constitutive, sheet_lame(material.membrane_stiffness, material.poissons_ratio),
      [&](auto law, const SheetLame& lame) {
        return add_membrane_gradient<decltype(law)>(plan, lame, positions, gradient);
      });

  if (bending.model == data::BendingModel::hinge) {
    energy.bending = add_hinge_gradient(plan.hinges, material.bending_rigidity, positions, gradient);
    return energy;
  }
  Points bent = Points::Zero(positions.rows(), 3);
  add_bending_product(bending, material.bending_rigidity, positions, bent);
  gradient += bent;
  energy.bending += 0.5 * bent.cwiseProduct(positions).sum();
  return energy;
}

void add_elastic_hessian(const SheetPlan& plan, const BendingOperator& bending,
                         const data::SheetMaterial& material, const data::Points& positions, double scale,
                         Curvature curvature, BlockValues<double>& values) {
  with_membrane_law(material.constitutive, sheet_lame(material.membrane_stiffness, material.poissons_ratio),
                    [&](auto law, const SheetLame& lame) {
                      add_membrane_hessian<decltype(law)>(plan, lame, positions, scale, curvature, values);
                    });
  if (bending.model == data::BendingModel::hinge)
    add_hinge_hessian(plan, plan.hinges, scale * material.bending_rigidity, positions, values);
}

double add_hinge_gradient(const std::vector<Hinge>& hinges, double rigidity, const Points& positions,
                          Points& gradient) {
  double energy = 0;
  for (const Hinge& hinge : hinges) {
    HingePositions x, hinge_gradient;
    for (int k = 0; k < 4; ++k) x.col(k) = positions.row(hinge.vertices[k]);
    double hinge_energy;
    hinge_response(hinge, x, hinge_energy, hinge_gradient, nullptr);
    energy += rigidity * hinge_energy;
    for (int k = 0; k < 4; ++k)
      gradient.row(hinge.vertices[k]) += rigidity * hinge_gradient.col(k).transpose();
  }
  return energy;
}

void add_hinge_hessian(const SheetPlan& plan, const std::vector<Hinge>& hinges, double rigidity,
                       const Points& positions, BlockValues<double>& values) {
  for (size_t e = 0; e < hinges.size(); ++e) {
    const Hinge& hinge = hinges[e];
    HingePositions x, hinge_gradient;
    for (int k = 0; k < 4; ++k) x.col(k) = positions.row(hinge.vertices[k]);
    double hinge_energy;
    Matrix12 hessian;
    hinge_response(hinge, x, hinge_energy, hinge_gradient, &hessian);
    for (int k = 0; k < 4; ++k)
      add_block(values, {hinge.vertices[k], false}, rigidity * hessian.block<3, 3>(3 * k, 3 * k));
    constexpr std::array<std::pair<int, int>, 6> blocks = {{{1, 0}, {2, 0}, {2, 1}, {3, 0}, {3, 1}, {3, 2}}};
    for (int b = 0; b < 6; ++b)
      add_block(values, plan.hinge_slots[e][b],
                rigidity * hessian.block<3, 3>(3 * blocks[b].first, 3 * blocks[b].second));
  }
}

void add_bending_stand_in(const BendingOperator& bending, double rigidity, BlockValues<double>& values) {
  for (size_t block = 0; block < bending.stand_in.size(); ++block)
    for (int c = 0; c < 3; ++c) values[9 * block + 4 * c] += rigidity * bending.stand_in[block];
}

void add_bending_product(const BendingOperator& bending, double rigidity, const Points& x, Points& y) {
  if (!bending.stiffness.empty())
    add_product(bending.stiffness, rigidity, padded_vertices(x).data(), y.data());
}

}  // namespace flash::sim
