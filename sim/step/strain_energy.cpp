#include "sim/step/strain_energy.h"

#include <Eigen/Eigenvalues>

namespace flash::sim {
namespace {

using data::Points;
using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
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

/// Green's strain against the start of a triangle, and the matrix that gives its stress.
struct Strained {
  Matrix3d stiffness;
  Vector3d strain;  ///< (E_11, E_22, 2 E_12)

  Matrix2d stress() const {
    const Vector3d s = stiffness * strain;
    return (Matrix2d() << s[0], s[2], s[2], s[1]).finished();
  }
};

Strained strained(const SheetPlan& plan, std::span<const Matrix2d> start_metrics,
                  const SheetStiffness& stiffness, std::size_t index, const Matrix32& F) {
  const Matrix2d start = start_metrics.empty() ? Matrix2d::Identity() : start_metrics[index];
  const Matrix2d change = 0.5 * (F.transpose() * F - start);
  return {stiffness.in(plan.sheet.triangles[index].x_axis), {change(0, 0), change(1, 1), 2 * change(0, 1)}};
}

/// The strain (E_11, E_22, 2 E_12) that a motion u of a vertex makes, by F^T u.
Eigen::Matrix<double, 3, 2> strain_of(const Vector2d& w) {
  return (Eigen::Matrix<double, 3, 2>() << w[0], 0, 0, w[1], w[1], w[0]).finished();
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

double add_strain_gradient(const SheetPlan& plan, const BodyPlan& place,
                           std::span<const Matrix2d> start_metrics, const SheetStiffness& stiffness,
                           const Points& positions, Points& gradient) {
  double energy = 0;
  for_each_triangle(plan, place, positions, [&](std::size_t index, const Triangle& triangle) {
    const Strained now = strained(plan, start_metrics, stiffness, index, triangle.F);
    energy += 0.5 * triangle.area * now.strain.dot(now.stiffness * now.strain);
    const Matrix32 P = triangle.area * triangle.F * now.stress();
    for (int k = 0; k < 3; ++k) gradient.row(triangle.vertices[k]) += (P * triangle.w[k]).transpose();
  });
  return energy;
}

void add_strain_hessian(const SheetPlan& plan, const BodyPlan& place, std::span<const Matrix2d> start_metrics,
                        const SheetStiffness& stiffness, const Points& positions, Curvature curvature,
                        BlockValues<double>& values) {
  for_each_triangle(plan, place, positions, [&](std::size_t index, const Triangle& triangle) {
    const Matrix32& F = triangle.F;
    const Strained now = strained(plan, start_metrics, stiffness, index, F);
    Matrix2d stress = now.stress();
    if (curvature == Curvature::positive) {
      const Eigen::SelfAdjointEigenSolver<Matrix2d> eigen(stress);
      stress = eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).asDiagonal() *
               eigen.eigenvectors().transpose();
    }
    // d(F S) w_i for dF = u w_j^T: u (w_j.S w_i) + F B_i^T C B_j F^T u.
    const auto block = [&](int i, int j) -> Matrix3d {
      const Vector2d &wi = triangle.w[i], &wj = triangle.w[j];
      const Matrix2d material = strain_of(wi).transpose() * now.stiffness * strain_of(wj);
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
