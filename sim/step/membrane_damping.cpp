#include "sim/step/membrane_damping.h"

#include <Eigen/Eigenvalues>

namespace flash::sim {
namespace {

using data::Points;
using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Matrix32 = Eigen::Matrix<double, 3, 2>;

/// One triangle: vertices, blocks, F = sum_i x_i w_i^T.
struct Triangle {
  int vertices[3], slots[3];
  Vector2d w[3];  ///< [1/m]
  double area;    ///< [m^2]
  Matrix32 F;
};

/// Calls use(index, triangle) for each triangle of a body at `positions`.
template <typename Use>
void for_each_triangle(const SheetPlan& plan, const BodyPlan& place, const Points& positions,
                       const Use& use) {
  size_t index = place.body.first_triangle;
  for (int g = place.first_group; g < place.first_group + place.group_count; ++g) {
    const TriangleGroup& group = plan.triangle_groups[g];
    for (int lane = 0; lane < group.count; ++lane) {
      Triangle triangle;
      for (int k = 0; k < 3; ++k) {
        triangle.vertices[k] = group.vertices[k][lane];
        triangle.slots[k] = group.slots[k][lane];
      }
      triangle.w[1] = {group.gradients[0][lane], group.gradients[1][lane]};
      triangle.w[2] = {group.gradients[2][lane], group.gradients[3][lane]};
      triangle.w[0] = -triangle.w[1] - triangle.w[2];
      triangle.area = group.area[lane];
      triangle.F.setZero();
      for (int k = 0; k < 3; ++k)
        triangle.F += positions.row(triangle.vertices[k]).transpose() * triangle.w[k].transpose();
      use(index++, triangle);
    }
  }
}

/// Second Piola-Kirchhoff stress of a strain: 2 mu E + lambda tr(E) I.
Matrix2d stress_of(const SheetLame& lame, const Matrix2d& strain) {
  return 2 * lame.mu * strain + lame.lambda * strain.trace() * Matrix2d::Identity();
}

}  // namespace

std::vector<Matrix2d> triangle_metrics(const SheetPlan& plan, const Points& positions) {
  std::vector<Matrix2d> metrics;
  for (const BodyPlan& place : plan.bodies)
    for_each_triangle(plan, place, positions, [&](size_t, const Triangle& triangle) {
      metrics.push_back(triangle.F.transpose() * triangle.F);
    });
  return metrics;
}

double add_membrane_damping_gradient(const SheetPlan& plan, const BodyPlan& place,
                                     const std::vector<Matrix2d>& start_metrics, const SheetLame& lame,
                                     const Points& positions, Points& gradient) {
  double potential = 0;
  for_each_triangle(plan, place, positions, [&](size_t index, const Triangle& triangle) {
    const Matrix2d strain = 0.5 * (triangle.F.transpose() * triangle.F - start_metrics[index]);
    const Matrix2d stress = stress_of(lame, strain);
    potential += 0.5 * triangle.area * stress.cwiseProduct(strain).sum();
    const Matrix32 P = triangle.area * triangle.F * stress;
    for (int k = 0; k < 3; ++k) gradient.row(triangle.vertices[k]) += (P * triangle.w[k]).transpose();
  });
  return potential;
}

void add_membrane_damping_hessian(const SheetPlan& plan, const BodyPlan& place,
                                  const std::vector<Matrix2d>& start_metrics, const SheetLame& lame,
                                  const Points& positions, Curvature curvature, BlockValues<double>& values) {
  for_each_triangle(plan, place, positions, [&](size_t index, const Triangle& triangle) {
    const Matrix32& F = triangle.F;
    Matrix2d stress = stress_of(lame, 0.5 * (F.transpose() * F - start_metrics[index]));
    if (curvature == Curvature::positive) {
      const Eigen::SelfAdjointEigenSolver<Matrix2d> eigen(stress);
      stress = eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).asDiagonal() *
               eigen.eigenvectors().transpose();
    }
    // d(F S) w_i for dF = u w_j^T: u (w_j.S w_i) + F (mu ((F^T u) (w_j.w_i) + w_j (F^T u).w_i) +
    // lambda (F^T u).w_j w_i).
    const auto block = [&](int i, int j) -> Matrix3d {
      const Vector2d &wi = triangle.w[i], &wj = triangle.w[j];
      const Matrix2d material = lame.mu * (wi.dot(wj) * Matrix2d::Identity() + wj * wi.transpose()) +
                                lame.lambda * wi * wj.transpose();
      return triangle.area * (wj.dot(stress * wi) * Matrix3d::Identity() + F * material * F.transpose());
    };
    const auto add = [&](int slot, const Matrix3d& b) {
      Eigen::Map<Matrix3d>(values.data() + 9L * slot) += b;
    };
    for (int i = 0; i < 3; ++i) add(triangle.vertices[i], block(i, i));
    add(triangle.slots[0], block(1, 0));
    add(triangle.slots[1], block(2, 0));
    add(triangle.slots[2], block(2, 1));
  });
}

}  // namespace flash::sim
