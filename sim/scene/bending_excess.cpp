#include "sim/scene/bending_excess.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>
#include <span>

#include "sim/law/solid.h"
#include "sim/scene/solid.h"

namespace flash::sim {
namespace {

using Corners = Eigen::Matrix<double, 3, 4>;  ///< a column each [m]

Corners corners_of(const Sheet& sheet, const RestTetrahedron& element) {
  Corners corners;
  for (int i = 0; i < 4; ++i) corners.col(i) = sheet.rest.vertices.row(element.vertices[i]).transpose();
  return corners;
}

/// Integral of x x^T over a tetrahedron.
Eigen::Matrix3d second_moment(const Corners& corners, double volume) {
  const Eigen::Vector3d sum = corners.rowwise().sum();
  return volume / 20 * (corners * corners.transpose() + sum * sum.transpose());
}

/// Middle of a body, its principal axes in columns, and its second moments about them, from the longest to
/// the shortest.
struct PrincipalAxes {
  Eigen::Vector3d middle;
  Eigen::Matrix3d axes;
  Eigen::Vector3d moments;  ///< [m^5]
};

std::span<const RestTetrahedron> elements_of(const Sheet& sheet, const Body& body) {
  return std::span(sheet.tetrahedra)
      .subspan(static_cast<std::size_t>(body.first_tetrahedron),
               static_cast<std::size_t>(body.tetrahedron_count));
}

PrincipalAxes principal_axes(const Sheet& sheet, std::span<const RestTetrahedron> elements) {
  double volume = 0;
  Eigen::Vector3d first = Eigen::Vector3d::Zero();
  for (const RestTetrahedron& element : elements) {
    volume += element.volume;
    first += element.volume * corners_of(sheet, element).rowwise().mean();
  }
  const Eigen::Vector3d middle = first / volume;
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
  for (const RestTetrahedron& element : elements)
    second += second_moment(corners_of(sheet, element).colwise() - middle, element.volume);
  // Where two are alike, as in a cube, the mesh's own axes decide, not rounding.
  second.diagonal() += 1e-9 * second.trace() * Eigen::Vector3d(2, 1, 0);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(second);  // the smallest comes first
  return {middle, solver.eigenvectors().rowwise().reverse(), solver.eigenvalues().reverse()};
}

/// Displacement at `x` by a curvature of 1, in principal axes.
Eigen::Vector3d bent(const Eigen::Vector3d& x, double nu) {
  return {-x[0] * x[2], nu * x[1] * x[2], (x[0] * x[0] + nu * (x[2] * x[2] - x[1] * x[1])) / 2};
}

}  // namespace

double bending_excess(const Sheet& sheet, const Body& body, data::Constitutive constitutive,
                      double poissons_ratio) {
  if (is_quadratic(sheet, body)) return 0;
  const double nu = constitutive == data::Constitutive::tet_arap ? 0 : poissons_ratio;
  const SolidLame lame = solid_lame(1, nu);
  const std::span<const RestTetrahedron> elements = elements_of(sheet, body);
  const PrincipalAxes principal = principal_axes(sheet, elements);
  double energy = 0, exact = 0;
  for (const RestTetrahedron& element : elements) {
    const Corners corners =
        principal.axes.transpose() * (corners_of(sheet, element).colwise() - principal.middle);
    Eigen::Matrix3d edges, moved;
    for (int i = 0; i < 3; ++i) {
      edges.col(i) = corners.col(i + 1) - corners.col(0);
      moved.col(i) = bent(corners.col(i + 1), nu) - bent(corners.col(0), nu);
    }
    const Eigen::Matrix3d gradient = moved * edges.inverse();
    const Eigen::Matrix3d strain = (gradient + gradient.transpose()) / 2;
    energy +=
        element.volume * (lame.mu * strain.squaredNorm() + lame.lambda / 2 * strain.trace() * strain.trace());
    exact += second_moment(corners, element.volume)(2, 2) / 2;
  }
  return energy / exact - 1;
}

double slenderness(const Sheet& sheet, const Body& body) {
  const Eigen::Vector3d moments = principal_axes(sheet, elements_of(sheet, body)).moments;
  return std::sqrt(moments[0] / moments[2]);
}

}  // namespace flash::sim
