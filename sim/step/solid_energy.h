#pragma once
#include <span>

#include "sim/law/solid.h"
#include "sim/plan/sheet_plan.h"

namespace flash::sim {

/// The elements of a solid body.
std::span<const SolidElement> elements_of(const SheetPlan& plan, const Body& body);

/// Adds what a first Piola-Kirchhoff stress, times the volume [J], exerts on the vertices of an element.
void add_stress(const SolidElement& element, const QuadraturePoint& point, const Eigen::Matrix3d& stress,
                data::Points& gradient);

/// add(i, j, block) for each stored block of an element: vertices i >= j of it, its 3 x 3 numbers.
template <class Add>
void for_blocks(const SolidElement& element, BlockValues<double>& values, const Add& add) {
  const auto block = [&](int slot) { return Eigen::Map<Eigen::Matrix3d>(values.data() + 9L * slot); };
  const int count = static_cast<int>(element.vertices.size());
  for (int i = 0, pair = 0; i < count; ++i) {
    for (int j = 0; j < i; ++j, ++pair) {
      auto stored = block(element.slots[static_cast<std::size_t>(pair)]);
      add(i, j, stored);
    }
    auto own = block(element.vertices[static_cast<std::size_t>(i)]);
    add(i, i, own);
  }
}

/// Energy of a solid body [J]; adds its gradient [N].
double add_solid_gradient(const SheetPlan& plan, const Body& body, const Solid& solid,
                          const data::Points& positions, data::Points& gradient);

/// Adds `scale` times the Hessian of that energy; `positive`: the negative eigenvalues at each point of
/// quadrature are set to zero.
void add_solid_hessian(const SheetPlan& plan, const Body& body, const Solid& solid,
                       const data::Points& positions, double scale, Curvature curvature,
                       BlockValues<double>& values);

}  // namespace flash::sim
