#include "sim/elastic_energy.h"

#include "sim/membrane.h"

namespace flash::sim {

namespace {

using data::Points;
using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Derivatives of the deformation gradient: F = x_0 w_0^T + x_1 w_1^T + x_2 w_2^T, row k of the result is
/// w_k.
Eigen::Matrix<double, 3, 2> shape_gradients(const RestTriangle& triangle) {
  Eigen::Matrix<double, 3, 2> w;
  w.bottomRows<2>() = triangle.inverse_edges;
  w.row(0) = -w.row(1) - w.row(2);
  return w;
}

Matrix32 deformation_gradient(const RestTriangle& triangle, const Eigen::Matrix<double, 3, 2>& w,
                              const data::Points& x) {
  Matrix32 F = x.row(triangle.vertices[0]).transpose() * w.row(0);
  F += x.row(triangle.vertices[1]).transpose() * w.row(1);
  F += x.row(triangle.vertices[2]).transpose() * w.row(2);
  return F;
}

void add_block(BlockValues<double>& values, BlockSlot slot, const Matrix3d& block) {
  Eigen::Map<Matrix3d> target(values.data() + 9L * slot.block);
  if (slot.transpose)
    target += block.transpose();
  else
    target += block;
}

/// y += scale * S x. Four lanes a vertex: one vector multiply-add an entry of S.
void add_product(const Eigen::SparseMatrix<double, Eigen::RowMajor>& S, double scale, const Points& x,
                 Points& y) {
  typedef double Lanes __attribute__((vector_size(32), aligned(8)));
  Eigen::Matrix<double, Eigen::Dynamic, 4, Eigen::RowMajor> lanes(x.rows(), 4);
  lanes.leftCols<3>() = x;
  lanes.col(3).setZero();
  for (int i = 0; i < S.outerSize(); ++i) {
    Lanes even{}, odd{};
    int k = S.outerIndexPtr()[i];
    const int end = S.outerIndexPtr()[i + 1];
    const auto column = [&](int entry) {
      return *reinterpret_cast<const Lanes*>(lanes.data() + 4L * S.innerIndexPtr()[entry]);
    };
    for (; k + 1 < end; k += 2) {
      even += S.valuePtr()[k] * column(k);
      odd += S.valuePtr()[k + 1] * column(k + 1);
    }
    if (k < end) even += S.valuePtr()[k] * column(k);
    even += odd;
    for (int c = 0; c < 3; ++c) y(i, c) += scale * even[c];
  }
}

}  // namespace

ElasticEnergy add_elastic_gradient(const SheetPlan& plan, const BendingOperator& bending,
                                   const data::SheetMaterial& material, const data::Points& positions,
                                   data::Points& gradient) {
  ElasticEnergy energy;
  const SheetLame lame = sheet_lame(material.membrane_stiffness, material.poissons_ratio);
  for (const RestTriangle& triangle : plan.sheet.triangles) {
    const auto w = shape_gradients(triangle);
    double density;
    Matrix32 stress;
    membrane_response(material.constitutive, deformation_gradient(triangle, w, positions), lame, density,
                      stress, nullptr);
    energy.membrane += triangle.area * density;
    for (int k = 0; k < 3; ++k)
      gradient.row(triangle.vertices[k]) += triangle.area * (stress * w.row(k).transpose()).transpose();
  }

  const double D = material.bending_rigidity;
  if (bending.model == data::BendingModel::hinge) {
    for (const Hinge& hinge : plan.hinges) {
      HingePositions x, hinge_gradient;
      for (int k = 0; k < 4; ++k) x.col(k) = positions.row(hinge.vertices[k]);
      double hinge_energy;
      hinge_response(hinge, x, hinge_energy, hinge_gradient, nullptr);
      energy.bending += D * hinge_energy;
      for (int k = 0; k < 4; ++k) gradient.row(hinge.vertices[k]) += D * hinge_gradient.col(k).transpose();
    }
    return energy;
  }
  Points bent = Points::Zero(positions.rows(), 3);
  add_product(bending.stiffness, D, positions, bent);
  gradient += bent;
  energy.bending += 0.5 * bent.cwiseProduct(positions).sum();
  return energy;
}

void add_elastic_hessian(const SheetPlan& plan, const BendingOperator& bending,
                         const data::SheetMaterial& material, const data::Points& positions, double scale,
                         Curvature curvature, BlockValues<double>& values) {
  const SheetLame lame = sheet_lame(material.membrane_stiffness, material.poissons_ratio);
  for (size_t t = 0; t < plan.sheet.triangles.size(); ++t) {
    const RestTriangle& triangle = plan.sheet.triangles[t];
    const auto w = shape_gradients(triangle);
    double density;
    Matrix32 stress;
    Matrix66 hessian;
    membrane_response(material.constitutive, deformation_gradient(triangle, w, positions), lame, density,
                      stress, &hessian, curvature);
    const double factor = scale * triangle.area;
    const Matrix3d h00 = factor * hessian.topLeftCorner<3, 3>(),
                   h01 = factor * hessian.topRightCorner<3, 3>(),
                   h11 = factor * hessian.bottomRightCorner<3, 3>();
    const auto block = [&](int i, int j) -> Matrix3d {
      return (w(i, 0) * w(j, 0)) * h00 + (w(i, 0) * w(j, 1)) * h01 + (w(i, 1) * w(j, 0)) * h01.transpose() +
             (w(i, 1) * w(j, 1)) * h11;
    };
    for (int k = 0; k < 3; ++k) add_block(values, {triangle.vertices[k], false}, block(k, k));
    add_block(values, plan.triangle_slots[t][0], block(1, 0));
    add_block(values, plan.triangle_slots[t][1], block(2, 0));
    add_block(values, plan.triangle_slots[t][2], block(2, 1));
  }

  const double D = scale * material.bending_rigidity;
  if (bending.model == data::BendingModel::hinge) {
    for (size_t e = 0; e < plan.hinges.size(); ++e) {
      const Hinge& hinge = plan.hinges[e];
      HingePositions x, hinge_gradient;
      for (int k = 0; k < 4; ++k) x.col(k) = positions.row(hinge.vertices[k]);
      double hinge_energy;
      Matrix12 hessian;
      hinge_response(hinge, x, hinge_energy, hinge_gradient, &hessian);
      for (int k = 0; k < 4; ++k)
        add_block(values, {hinge.vertices[k], false}, D * hessian.block<3, 3>(3 * k, 3 * k));
      constexpr std::array<std::pair<int, int>, 6> blocks = {
          {{1, 0}, {2, 0}, {2, 1}, {3, 0}, {3, 1}, {3, 2}}};
      for (int b = 0; b < 6; ++b)
        add_block(values, plan.hinge_slots[e][b],
                  D * hessian.block<3, 3>(3 * blocks[b].first, 3 * blocks[b].second));
    }
    return;
  }
  for (size_t block = 0; block < bending.stand_in.size(); ++block)
    for (int c = 0; c < 3; ++c) values[9 * block + 4 * c] += D * bending.stand_in[block];
}

void add_bending_correction(const BendingOperator& bending, double bending_rigidity, const Points& x,
                            Points& y) {
  add_product(bending.correction, bending_rigidity, x, y);
}

void add_block_product(const BlockPattern& pattern, const BlockValues<double>& values, double scale,
                       const data::Points& x, data::Points& y) {
  const auto block = [&](size_t k) { return Eigen::Map<const Matrix3d>(values.data() + 9 * k); };
  for (int i = 0; i < pattern.size; ++i) y.row(i) += scale * (block(i) * x.row(i).transpose()).transpose();
  for (size_t k = 0; k < pattern.pairs.size(); ++k) {
    const auto [row, column] = pattern.pairs[k];
    const auto b = block(pattern.size + k);
    y.row(row) += scale * (b * x.row(column).transpose()).transpose();
    y.row(column) += scale * (b.transpose() * x.row(row).transpose()).transpose();
  }
}

}  // namespace flash::sim
