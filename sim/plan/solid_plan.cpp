#include "sim/plan/solid_plan.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "sim/scene/shape_gradients.h"
#include "sim/scene/solid.h"

namespace flash::sim {

namespace {

using Gradients = decltype(QuadraturePoint::gradients);

/// Of the ten shape functions where the barycentric coordinates are L: L_i (2 L_i - 1) at the corners, 4 L_i
/// L_j at the middle of an edge.
Gradients quadratic_gradients(const Eigen::Matrix<double, 4, 3>& barycentric, const Eigen::Vector4d& L) {
  Gradients gradients(10, 3);
  for (int i = 0; i < 4; ++i) gradients.row(i) = (4 * L[i] - 1) * barycentric.row(i);
  for (int k = 0; k < 6; ++k) {
    const auto [i, j] = tetrahedron_edges[k];
    gradients.row(4 + k) = 4 * (L[i] * barycentric.row(j) + L[j] * barycentric.row(i));
  }
  return gradients;
}

/// The rule of four points that is exact for polynomials of the second degree (Hammer and Stroud 1956): for
/// the energy of small strains, which are linear in a quadratic element.
std::vector<QuadraturePoint> quadratic_points(const RestTetrahedron& tetrahedron) {
  const double near = (5 + 3 * std::sqrt(5.0)) / 20, far = (5 - std::sqrt(5.0)) / 20;
  const Eigen::Matrix<double, 4, 3> barycentric = shape_gradients<3>(tetrahedron.inverse_edges);
  std::vector<QuadraturePoint> points;
  for (int p = 0; p < 4; ++p) {
    Eigen::Vector4d L = Eigen::Vector4d::Constant(far);
    L[p] = near;
    points.push_back({quadratic_gradients(barycentric, L), tetrahedron.volume / 4});
  }
  return points;
}

}  // namespace

Eigen::Matrix3d SolidElement::deformation(const QuadraturePoint& point, const data::Points& positions) const {
  // About one vertex: far from the origin the sum of all would cancel.
  Eigen::Matrix3d F = Eigen::Matrix3d::Zero();
  for (std::size_t k = 1; k < vertices.size(); ++k)
    F += (positions.row(vertices[k]) - positions.row(vertices[0])).transpose() *
         point.gradients.row(static_cast<Eigen::Index>(k));
  return F;
}

std::vector<SolidElement> solid_elements(const Sheet& sheet, const std::function<int(int, int)>& slot) {
  std::vector<SolidElement> elements;
  int first_point = 0;
  for (const RestTetrahedron& tetrahedron : sheet.tetrahedra) {
    std::vector<int> vertices(tetrahedron.vertices.begin(), tetrahedron.vertices.end());
    std::vector<QuadraturePoint> points = {
        {shape_gradients<3>(tetrahedron.inverse_edges), tetrahedron.volume}};
    if (tetrahedron.is_quadratic()) {
      vertices.insert(vertices.end(), tetrahedron.midsides.begin(), tetrahedron.midsides.end());
      points = quadratic_points(tetrahedron);
    }
    std::vector<int> order(vertices.size());
    std::iota(order.begin(), order.end(), 0);
    std::sort(order.begin(), order.end(), [&](int a, int b) { return vertices[a] < vertices[b]; });
    SolidElement element;
    element.first_point = first_point;
    first_point += static_cast<int>(points.size());
    for (const int k : order) element.vertices.push_back(vertices[k]);
    for (const QuadraturePoint& point : points)
      element.points.push_back({point.gradients(order, Eigen::all), point.volume});
    for (std::size_t row = 1; row < vertices.size(); ++row)
      for (std::size_t column = 0; column < row; ++column)
        element.slots.push_back(slot(element.vertices[row], element.vertices[column]));
    elements.push_back(std::move(element));
  }
  return elements;
}

}  // namespace flash::sim
