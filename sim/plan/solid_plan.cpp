#include "sim/plan/solid_plan.h"

#include <algorithm>
#include <numeric>

namespace flash::sim {

Eigen::Matrix3d SolidElement::deformation(const data::Points& positions) const {
  // About one vertex: far from the origin the sum of all four would cancel.
  Eigen::Matrix3d F = Eigen::Matrix3d::Zero();
  for (int k = 1; k < 4; ++k)
    F += (positions.row(vertices[k]) - positions.row(vertices[0])).transpose() * gradients.row(k);
  return F;
}

std::vector<SolidElement> solid_elements(const Sheet& sheet, const std::function<int(int, int)>& slot) {
  std::vector<SolidElement> elements;
  for (const RestTetrahedron& tetrahedron : sheet.tetrahedra) {
    Eigen::Matrix<double, 4, 3> gradients;
    gradients.bottomRows<3>() = tetrahedron.inverse_edges;
    gradients.row(0) = -tetrahedron.inverse_edges.colwise().sum();
    std::array<int, 4> order;
    std::iota(order.begin(), order.end(), 0);
    std::sort(order.begin(), order.end(),
              [&](int a, int b) { return tetrahedron.vertices[a] < tetrahedron.vertices[b]; });
    SolidElement element;
    element.volume = tetrahedron.volume;
    for (int k = 0; k < 4; ++k) {
      element.vertices[k] = tetrahedron.vertices[order[k]];
      element.gradients.row(k) = gradients.row(order[k]);
    }
    for (int k = 0; k < 6; ++k)
      element.slots[k] = slot(element.vertices[solid_pairs[k][0]], element.vertices[solid_pairs[k][1]]);
    elements.push_back(element);
  }
  return elements;
}

}  // namespace flash::sim
