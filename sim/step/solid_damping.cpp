#include "sim/step/solid_damping.h"

#include <Eigen/Eigenvalues>

#include "sim/step/solid_energy.h"

namespace flash::sim {

using data::Points;
using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

/// Second Piola-Kirchhoff stress of a strain: 2 mu E + lambda tr(E) I.
Matrix3d stress_of(const SolidLame& lame, const Matrix3d& strain) {
  return 2 * lame.mu * strain + lame.lambda * strain.trace() * Matrix3d::Identity();
}

}  // namespace

std::vector<Matrix3d> solid_metrics(const SheetPlan& plan, const Points& positions) {
  std::vector<Matrix3d> metrics;
  for (const SolidElement& element : plan.solid_elements)
    for (const QuadraturePoint& point : element.points) {
      const Matrix3d F = element.deformation(point, positions);
      metrics.push_back(F.transpose() * F);
    }
  return metrics;
}

double add_solid_damping_gradient(const SheetPlan& plan, const Body& body,
                                  const std::vector<Matrix3d>& start_metrics, const SolidLame& lame,
                                  const Points& positions, Points& gradient) {
  double potential = 0;
  for (const SolidElement& element : elements_of(plan, body)) {
    const Matrix3d* start = start_metrics.data() + element.first_point;
    for (const QuadraturePoint& point : element.points) {
      const Matrix3d F = element.deformation(point, positions);
      const Matrix3d strain = 0.5 * (F.transpose() * F - *start++);
      const Matrix3d stress = stress_of(lame, strain);
      potential += 0.5 * point.volume * stress.cwiseProduct(strain).sum();
      add_stress(element, point, point.volume * F * stress, gradient);
    }
  }
  return potential;
}

void add_solid_damping_hessian(const SheetPlan& plan, const Body& body,
                               const std::vector<Matrix3d>& start_metrics, const SolidLame& lame,
                               const Points& positions, Curvature curvature, BlockValues<double>& values) {
  for (const SolidElement& element : elements_of(plan, body)) {
    const Matrix3d* start = start_metrics.data() + element.first_point;
    for (const QuadraturePoint& point : element.points) {
      const Matrix3d F = element.deformation(point, positions);
      Matrix3d stress = stress_of(lame, 0.5 * (F.transpose() * F - *start++));
      if (curvature == Curvature::positive) {
        const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(stress);
        stress = eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).asDiagonal() *
                 eigen.eigenvectors().transpose();
      }
      // As that of a triangle in sim/step/strain_energy.cpp.
      for_blocks(element, values, [&](int i, int j, auto& block) {
        const Vector3d wi = point.gradients.row(i), wj = point.gradients.row(j);
        const Matrix3d material = lame.mu * (wi.dot(wj) * Matrix3d::Identity() + wj * wi.transpose()) +
                                  lame.lambda * wi * wj.transpose();
        block += point.volume * (wj.dot(stress * wi) * Matrix3d::Identity() + F * material * F.transpose());
      });
    }
  }
}

}  // namespace flash::sim
