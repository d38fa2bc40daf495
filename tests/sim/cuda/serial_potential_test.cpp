// What a device computes of an iterate, by its own text on the processor: beside the processor's potential,
// and beside finite differences.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <limits>

#include "tests/sim/cuda/drawn_step.h"
#include "tests/sim/cuda/processor_iterate.h"

namespace flash::sim::cuda {
namespace {

using data::Points;
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double epsilon = std::numeric_limits<double>::epsilon(),
                 single_epsilon = std::numeric_limits<float>::epsilon();

// Forces are positions, rounded, times stiffness, added up over some tens of neighbours.
RC_GTEST_PROP(SerialPotential, ForcesAndEnergiesAreThoseOfTheProcessor, ()) {
  const DrawnStep drawn(draw_world);
  SerialReplay serial = drawn.serial();
  const ProcessorIterate processor(drawn, drawn.positions);
  const SerialIterate own = serial.evaluate(drawn.positions);
  const Iterate& other = processor.at;
  const double rounded = 64 * epsilon * drawn.positions.cwiseAbs().maxCoeff() * processor.stiffness();
  const auto largest = [](const Points& x) { return x.rowwise().norm().maxCoeff(); };
  RC_ASSERT(largest(own.force - other.force) <= rounded);
  RC_ASSERT(largest(own.residual - other.residual) <= rounded);
  const double work = rounded * drawn.positions.size() * drawn.cell();
  RC_ASSERT(std::abs(own.potential - other.incremental_potential) <= work + 64 * epsilon * own.potential);
  RC_ASSERT(std::abs(own.elastic.membrane - other.elastic.membrane) <= work);
  RC_ASSERT(std::abs(own.elastic.bending - other.elastic.bending) <= work);
  RC_ASSERT(std::abs(own.friction - friction_potential(processor.problem.contacts, other.contacts,
                                                       other.positions)) <= work);
  RC_ASSERT(own.balanced == processor.problem.balanced(other, ReplaySettings{}.tolerance));
  RC_CLASSIFY(other.contacts.constraints.size() > other.contacts.held, "touches");
  RC_CLASSIFY(own.friction > 0, "rubs");
}

// Central differences over t and 2t part by three times what the first are off by.
RC_GTEST_PROP(SerialPotential, ForcesAreTheSlopeOfThePotential, ()) {
  const DrawnStep drawn(draw_world);
  SerialReplay serial = drawn.serial();
  const SerialIterate at = serial.evaluate(drawn.positions);
  const double t = 1e-4 * drawn.cell();
  const Points way = draw_noise(drawn.positions.rows(), 1);
  const auto slope = [&](double length) {
    return (serial.evaluate(drawn.positions + length * way).potential -
            serial.evaluate(drawn.positions - length * way).potential) /
           (2 * length);
  };
  const double once = slope(t), twice = slope(2 * t), expected = at.force.cwiseProduct(way).sum();
  const double rounded = 64 * epsilon * (at.potential + at.force.cwiseAbs().sum() * drawn.cell()) / t;
  RC_ASSERT(std::abs(once - expected) <= std::abs(twice - once) + rounded);
}

RC_GTEST_PROP(SerialPotential, TheMatrixIsThatOfTheProcessor, ()) {
  const DrawnStep drawn(draw_world);
  SerialReplay serial = drawn.serial();
  const ProcessorIterate processor(drawn, drawn.positions);
  const Points x = draw_noise(drawn.positions.rows(), 1);
  for (const bool positive : {false, true}) {
    const Points own = serial.matrix_product(drawn.positions, positive, x),
                 other = processor.product(processor.blocks(positive), x) +
                         bending_product(processor.law().bending, processor.rigidity(), x);
    // Up to fifty neighbours with three numbers each, in single precision.
    const double rounded = 150 * single_epsilon * processor.stiffness();
    RC_ASSERT((own - other).cwiseAbs().maxCoeff() <= rounded);
  }
}

// Where neither hinges nor the turn of damping are left out, the matrix is the slope of the forces.
RC_GTEST_PROP(SerialPotential, TheMatrixIsTheSlopeOfTheForces, ()) {
  DrawnStep drawn(draw_flight);
  data::SheetMaterial& material = drawn.environment.materials[0];
  if (material.bending_model == data::BendingModel::hinge) material.bending_model = data::BendingModel::plate;
  material.stiffness_damping = 0;
  SerialReplay serial = drawn.serial();
  const double t = 1e-4 * drawn.cell();
  const Points way = draw_noise(drawn.positions.rows(), 1);
  const auto slope = [&](double length) -> Points {
    return (serial.evaluate(drawn.positions + length * way).force -
            serial.evaluate(drawn.positions - length * way).force) /
           (2 * length);
  };
  const Points once = slope(t), twice = slope(2 * t),
               product = serial.matrix_product(drawn.positions, false, way);
  const double stiffness = ProcessorIterate(drawn, drawn.positions).stiffness(),
               rounded = 64 * epsilon * drawn.positions.cwiseAbs().maxCoeff() / t * stiffness +
                         150 * single_epsilon * stiffness;
  RC_ASSERT((once - product).cwiseAbs().maxCoeff() <= (twice - once).cwiseAbs().maxCoeff() + rounded);
}

// A factor solves a system near the given one, as near as its blocks are rounded: its residual is small,
// whatever the condition is.
RC_GTEST_PROP(SerialPotential, TheFactorIsThatOfTheRestrictedMatrix, ()) {
  const DrawnStep drawn(draw_world);
  SerialReplay serial = drawn.serial();
  const ProcessorIterate processor(drawn, drawn.positions);
  BlockValues<double> values = processor.blocks(true);
  for (const BodyLaw& law : processor.problem.laws)
    add_bending_stand_in(law.bending, processor.problem.potential.effective_rigidity(law), values);
  double largest = 0;
  for (const double entry : values) largest = std::max(largest, std::abs(entry));
  restrict_matrix(processor.plan->pattern, processor.at.contacts, values);
  const Points b = draw_noise(drawn.positions.rows(), 1), solved = serial.factor_solve(drawn.positions, b);
  const double rounded = 150 * single_epsilon * (largest * solved.cwiseAbs().maxCoeff() + 1);
  RC_ASSERT((processor.product(values, solved) - b).cwiseAbs().maxCoeff() <= rounded);
}

}  // namespace
}  // namespace flash::sim::cuda
