#pragma once
#include <Eigen/Core>
#include <vector>

#include "sim/law/sheet_stiffness.h"
#include "sim/law/solid.h"
#include "sim/plan/sheet_plan.h"
#include "sim/scene/environment.h"
#include "sim/step/elastic_energy.h"
#include "sim/step/springs.h"

namespace flash::sim {

/// What one implicit Euler step of length h from `environment.state` minimizes, contact and rigid holds
/// apart:
///
///   |x - s|^2_M / (2 h^2) + E(x) - f.x + a / (2 h) |x - x_0|^2_M + b / h E_0(x) + |x - p|^2_K / 2
///   s = x_0 + h v_0 + h^2 g
///
/// with the elastic energy E, loads f, the springs K of soft holds to their places p (springs_of), `air_drag`
/// a and `stiffness_damping` b of each body. E_0 is the elastic energy of what changed since the start of the
/// step: strains, angles of hinges, and positions of a quadratic bending model, less the rotation of the body
/// as a whole. Its forces are b K v for small motions (Kelvin-Voigt). A sheet that turns rigidly feels no
/// torque from them, stressed or not. The arguments of the constructor have to outlive the potential.
class IncrementalPotential {
 public:
  IncrementalPotential(const SheetPlan& plan, const std::vector<BodyLaw>& laws,
                       const Environment& environment, double time_step);

  /// Mass of each vertex [kg].
  const Eigen::VectorXd& mass() const { return mass_; }

  /// Potential [J] at `positions`; `force` becomes its gradient: what every vertex needs from outside [N].
  /// `elastic`: the energy of the bodies alone.
  double evaluate(const data::Points& positions, data::Points& force, ElasticEnergy& elastic) const;

  /// Potential at the start of the step, where the energy of the bodies is `elastic` [J].
  double at_start(const ElasticEnergy& elastic) const;

  /// Hessian of the potential, without the stiffness of a quadratic bending model. Of hinges it has the
  /// Gauss-Newton part; of that model's damping it leaves out the derivative of the turn. `sparse`: only
  /// blocks over edges are filled, which are all where no hinges bend.
  void assemble(const data::Points& positions, Curvature curvature, bool sparse,
                BlockValues<double>& values) const;

  const std::vector<Spring>& springs() const { return springs_; }

  /// What springs add to the diagonal of the Hessian: vertices x axes [N/m].
  const data::Points& spring_stiffness() const { return spring_stiffness_; }

  /// Takes vertices that springs hold from where speeds take them in a `share` of the step to where inertia
  /// and springs balance, given that all was in balance at its start: x <- (m / h^2 x + k q) / (m / h^2 + k).
  /// q goes with the spring's place, from where the vertex was.
  void pull(double share, data::Points& positions) const;

  /// What the stiffness of a body's quadratic bending model enters the Hessian with: D (1 + b / h) [N m].
  double effective_rigidity(const BodyLaw& law) const;

 private:
  /// b / h of a body.
  double damping_share(const BodyLaw& law) const { return law.stiffness_damping() / h_; }

  /// Moduli of a body's membrane times b / h, and those of a solid.
  SheetStiffness damping_stiffness(const BodyLaw& law) const;
  SolidLame solid_damping_lame(const BodyLaw& law) const;

  /// Adds the gradient of a body's a / (2 h) |x - x_0|^2_M to `force` and returns its value [J]; `moved`:
  /// x - x_0.
  double add_drag(const BodyLaw& law, const data::Points& moved, data::Points& force) const;

  /// Adds the gradient of a body's b / h E_0 to `force` and returns its value [J].
  double add_damping(const BodyLaw& law, const data::Points& positions, data::Points& force) const;

  const SheetPlan& plan_;
  const std::vector<BodyLaw>& laws_;
  const Environment& environment_;
  double h_;
  Eigen::VectorXd mass_;
  data::Points target_, loads_;
  std::vector<Spring> springs_;
  data::Points spring_stiffness_;
  // Strains and angles of all bodies at the start of the step; kept where any of them is damped.
  std::vector<Eigen::Matrix2d> start_metrics_;
  std::vector<Eigen::Matrix3d> solid_start_metrics_;
  std::vector<Hinge> start_hinges_;
};

}  // namespace flash::sim
