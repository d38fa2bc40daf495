#pragma once
#include "data/asset/material.h"
#include "sim/law/membrane.h"
#include "sim/step/body_law.h"

namespace flash::sim {

struct ElasticEnergy {
  double membrane = 0.0;  ///< [J]
  double bending = 0.0;   ///< with what flows over the step, where hinges yield [J]
  double solid = 0.0;     ///< of tetrahedra [J]
  double layers = 0.0;    ///< of the pressure between layers of the surface [J]

  double total() const { return membrane + bending + solid + layers; }
  ElasticEnergy& operator+=(const ElasticEnergy& other) {
    membrane += other.membrane;
    bending += other.bending;
    solid += other.solid;
    layers += other.layers;
    return *this;
  }
};

/// Elastic energy of a body at `positions` of all vertices; adds its gradient to `gradient` (vertices x 3)
/// [N].
ElasticEnergy add_elastic_gradient(const SheetPlan& plan, const BodyLaw& law, const data::Points& positions,
                                   data::Points& gradient);

/// Adds `scale` times the Hessian of a body's membrane and the Gauss-Newton Hessian of its hinges, or that of
/// a solid. `positive`: the negative eigenvalues of each element are set to zero.
void add_elastic_hessian(const SheetPlan& plan, const BodyLaw& law, const data::Points& positions,
                         double scale, Curvature curvature, BlockValues<double>& values);

/// Adds `rigidity` times the stand-in for the Hessian of a quadratic bending model.
void add_bending_stand_in(const BendingOperator& bending, double rigidity, BlockValues<double>& values);

/// rigidity * stiffness * x over the vertices of the body alone: the Hessian itself of a quadratic bending
/// model, for other models zero.
data::Points bending_product(const BendingOperator& bending, double rigidity, const data::Points& x);

}  // namespace flash::sim
