#pragma once
#include <map>
#include <memory>

#include "sim/step/contact_set.h"
#include "sim/step/incremental_potential.h"
#include "sim/step/layer_contact.h"

namespace flash::sim {

/// A point on the way to the end of a step, always feasible.
struct Iterate {
  data::Points positions;  ///< [m]
  data::Points force;      ///< what each vertex needs from outside [N]
  data::Points residual;   ///< what the constraints leave of it [N]
  ContactSet contacts;
  LayerContact layers;                         ///< of the surface with itself
  std::vector<data::SheetMaterial> materials;  ///< of `elastic`
  std::map<int, data::SolidMaterial> solids;   ///< likewise
  std::vector<double> rest_angles;             ///< likewise, as in State
  ElasticEnergy elastic;
  double incremental_potential = 0;  ///< [J]
};

/// One implicit Euler step as a problem: its potential, its contacts and the scale of its forces.
struct StepProblem {
  std::vector<BodyLaw> laws;
  IncrementalPotential potential;
  ContactStep contacts;
  double gravity;                     ///< [m/s^2]; 9.81 without
  std::vector<double> force_scales;   ///< |M g| of each body [N]
  std::vector<double> stiffnesses;    ///< the largest of each body, roughly [N/m]
  double time_step;                   ///< [s]
  std::unique_ptr<LayerStep> layers;  ///< the contact of the surface with itself; none: it passes through

  /// The arguments but `way_out` have to outlive the problem. `memory`: of the plan's sheet, where it meets
  /// itself; else null.
  StepProblem(const SheetPlan& plan, const Environment& environment, double h, const WayOut<double>& way_out,
              LayerMemory* memory = nullptr);
  StepProblem(const StepProblem&) = delete;  // the potential refers to the laws

  /// Fills in an iterate from its positions.
  void evaluate(Iterate& iterate) const;

  /// The largest |r| / |M g| of a body.
  double relative_residual(const Iterate& iterate) const;

  /// Whether |r| <= tolerance |M g| for each body, and no vertex misses its weight by more than 30 times as
  /// much. A vertex of small cells counts as no lighter than a tenth of the mean: its weight is far below the
  /// forces between cells. The rounding of positions moves a vertex against its inertia, strains and bends
  /// what is about it, stretches the springs of holds, and turns the friction of what starts to slide: that
  /// much more may be missing, of inertia and of elastic forces no more than most_rounding of the weight.
  bool balanced(const Iterate& iterate, double tolerance) const;

  /// Whether the place where a step starts is its end: |r| <= start_tolerance_share * tolerance * |M g|.
  bool rests(const Iterate& start, double tolerance) const;
};

}  // namespace flash::sim
