#pragma once
#include <cmath>

#include "data/mesh/procedural_mesh.h"
#include "sim/cpu/block_cholesky.h"
#include "sim/step/elastic_energy.h"

namespace flash::sim {

/// A towel in mid-air and its preconditioner's matrix.
struct Towel {
  std::shared_ptr<const SheetPlan> plan;
  data::SheetMaterial material;
  data::Points positions;
  BlockValues<double> values;

  explicit Towel(int vertices) {
    data::RectangleMesh rectangle;
    rectangle.width = rectangle.height = 0.4;
    rectangle.cells_x = rectangle.cells_y = static_cast<int>(std::lround(std::sqrt(vertices))) - 1;
    plan = make_sheet_plan(make_sheet(data::rectangle(rectangle)));
    material.areal_density = 0.2;
    material.bending_rigidity = 3e-5;
    positions = plan->sheet.rest.vertices;
    for (int i = 0; i < positions.rows(); ++i)
      positions(i, 2) = 0.02 * std::sin(15 * positions(i, 0)) * std::cos(11 * positions(i, 1));
    assemble(Curvature::positive);
  }

  const BendingOperator& bending() const {
    return bending_operator(*plan, material.bending_model, material.poissons_ratio);
  }

  BodyLaw law() const { return {plan->bodies[0], material, bending()}; }

  void assemble(Curvature curvature) {
    const double time_step = 0.01;
    values.assign(9 * (plan->pattern.size + plan->pattern.pairs.size()), 0.0);
    add_elastic_hessian(*plan, law(), positions, 1.0, curvature, values);
    add_bending_stand_in(bending(), material.bending_rigidity, values);
    for (int i = 0; i < plan->pattern.size; ++i)
      for (int c = 0; c < 3; ++c)
        values[9L * i + 4 * c] +=
            material.areal_density * plan->sheet.vertex_area[i] / (time_step * time_step);
  }
};

}  // namespace flash::sim
