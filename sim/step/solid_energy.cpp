#include "sim/step/solid_energy.h"

namespace flash::sim {

using data::Points;
using Eigen::Matrix3d;

std::span<const SolidElement> elements_of(const SheetPlan& plan, const Body& body) {
  return std::span(plan.solid_elements)
      .subspan(static_cast<std::size_t>(body.first_tetrahedron),
               static_cast<std::size_t>(body.tetrahedron_count));
}

double add_solid_gradient(const SheetPlan& plan, const Body& body, const Solid& solid,
                          const Points& positions, Points& gradient) {
  double energy = 0;
  for (const SolidElement& element : elements_of(plan, body)) {
    const SolidFrame frame = solid_frame(element.deformation(positions));
    const SolidResponse response = solid_response(solid, frame.s);
    energy += element.volume * response.energy;
    const Matrix3d P = element.volume * solid_stress(frame, response);
    for (int k = 0; k < 4; ++k) gradient.row(element.vertices[k]) += element.gradients.row(k) * P.transpose();
  }
  return energy;
}

void add_solid_hessian(const SheetPlan& plan, const Body& body, const Solid& solid, const Points& positions,
                       double scale, Curvature curvature, BlockValues<double>& values) {
  for (const SolidElement& element : elements_of(plan, body)) {
    const SolidFrame frame = solid_frame(element.deformation(positions));
    SolidResponse response = solid_response(solid, frame.s);
    if (curvature == Curvature::positive) clamp(response);
    const Eigen::Matrix<double, 4, 3> turned = element.gradients * frame.V;
    const auto add = [&](int slot, int i, int j) {
      Eigen::Map<Matrix3d>(values.data() + 9L * slot) +=
          scale * element.volume *
          solid_block(frame, response, turned.row(i).transpose(), turned.row(j).transpose());
    };
    for (int k = 0; k < 4; ++k) add(element.vertices[k], k, k);
    for (int k = 0; k < 6; ++k) add(element.slots[k], solid_pairs[k][0], solid_pairs[k][1]);
  }
}

}  // namespace flash::sim
