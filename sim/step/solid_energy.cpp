#include "sim/step/solid_energy.h"

namespace flash::sim {

using data::Points;
using Eigen::Matrix3d;

std::span<const SolidElement> elements_of(const SheetPlan& plan, const Body& body) {
  return std::span(plan.solid_elements)
      .subspan(static_cast<std::size_t>(body.first_tetrahedron),
               static_cast<std::size_t>(body.tetrahedron_count));
}

void add_stress(const SolidElement& element, const QuadraturePoint& point, const Matrix3d& stress,
                Points& gradient) {
  for (std::size_t k = 0; k < element.vertices.size(); ++k)
    gradient.row(element.vertices[k]) +=
        point.gradients.row(static_cast<Eigen::Index>(k)) * stress.transpose();
}

double add_solid_gradient(const SheetPlan& plan, const Body& body, const Solid& solid,
                          const Points& positions, Points& gradient) {
  double energy = 0;
  for (const SolidElement& element : elements_of(plan, body))
    for (const QuadraturePoint& point : element.points) {
      const SolidFrame frame = solid_frame(element.deformation(point, positions));
      const SolidResponse response = solid_response(solid, frame.s);
      energy += point.volume * response.energy;
      add_stress(element, point, point.volume * solid_stress(frame, response), gradient);
    }
  return energy;
}

void add_solid_hessian(const SheetPlan& plan, const Body& body, const Solid& solid, const Points& positions,
                       double scale, Curvature curvature, BlockValues<double>& values) {
  for (const SolidElement& element : elements_of(plan, body))
    for (const QuadraturePoint& point : element.points) {
      const SolidFrame frame = solid_frame(element.deformation(point, positions));
      SolidResponse response = solid_response(solid, frame.s);
      if (curvature == Curvature::positive) clamp(response);
      const decltype(point.gradients) turned = point.gradients * frame.V;
      for_blocks(element, values, [&](int i, int j, auto& block) {
        block += scale * point.volume *
                 solid_block(frame, response, turned.row(i).transpose(), turned.row(j).transpose());
      });
    }
}

}  // namespace flash::sim
