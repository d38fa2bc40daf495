#pragma once
#include "sim/newton/active_set.h"
#include "sim/newton/step_problem.h"
#include "tests/sim/cuda/drawn_step.h"

namespace flash::sim::cuda {

/// A place near the end of a drawn step, as the processor has it.
struct ProcessorIterate {
  std::shared_ptr<const SheetPlan> plan;
  Environment environment;
  StepProblem problem;
  Iterate at;

  ProcessorIterate(const DrawnStep& drawn, const data::Points& positions)
      : plan(drawn.plan), environment(begun(drawn)), problem(*plan, environment, drawn.h, {.speed = 1}) {
    at.positions = positions;
    data::Points carried = at.positions;
    at.contacts = begin_step(problem.contacts, carried);
    problem.evaluate(at);
  }

  const BodyLaw& law() const { return problem.laws.front(); }
  double rigidity() const { return problem.potential.effective_rigidity(law()); }

  /// The Hessian's blocks with those of contact, without quadratic bending.
  BlockValues<double> blocks(bool positive) const {
    BlockValues<double> values;
    problem.potential.assemble(at.positions, positive ? Curvature::positive : Curvature::exact, false,
                               values);
    add_slip_stiffness(at.contacts, values);
    if (!positive) add_surface_curvature(at.contacts, values);
    return values;
  }
  data::Points product(const BlockValues<double>& values, const data::Points& x) const {
    data::Points y = data::Points::Zero(x.rows(), 3);
    const auto block = [&](std::size_t k) {
      return Eigen::Map<const Eigen::Matrix3d>(values.data() + 9 * k);
    };
    for (Eigen::Index i = 0; i < x.rows(); ++i)
      y.row(i) += x.row(i) * block(static_cast<std::size_t>(i)).transpose();
    for (std::size_t k = 0; k < plan->pattern.pairs.size(); ++k) {
      const auto [row, column] = plan->pattern.pairs[k];
      const auto own = block(static_cast<std::size_t>(plan->pattern.size) + k);
      y.row(row) += x.row(column) * own.transpose();
      y.row(column) += x.row(row) * own;
    }
    return y;
  }
  /// The largest entry of the matrix of the linear problem [N/m].
  double stiffness() const {
    const BlockValues<double> values = blocks(false);
    double largest = rigidity() * law().bending.largest_entry;
    for (const double entry : values) largest = std::max(largest, std::abs(entry));
    return largest;
  }

 private:
  static Environment begun(const DrawnStep& drawn) {
    Environment environment = drawn.environment;
    update_holds(environment, environment.state.time + drawn.h);
    return environment;
  }
};

}  // namespace flash::sim::cuda
