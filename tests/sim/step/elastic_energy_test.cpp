#include "sim/step/elastic_energy.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "tests/sim/sheet_scene.h"

namespace flash::sim {
namespace {

using data::BendingModel;
using data::Constitutive;
using data::Points;

constexpr Constitutive membranes[] = {Constitutive::tri_arap, Constitutive::tri_corotated,
                                      Constitutive::tri_stvk, Constitutive::tri_neohookean};
constexpr BendingModel bendings[] = {BendingModel::plate, BendingModel::isometric, BendingModel::hinge};

Points noise(int rows, double size, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> entry(-size, size);
  return Points::NullaryExpr(rows, 3, [&] { return entry(random); });
}

data::SheetMaterial material_of(Constitutive constitutive, BendingModel bending_model) {
  data::SheetMaterial material;
  material.constitutive = constitutive;
  material.bending_model = bending_model;
  material.bending_rigidity = 1e-3;
  return material;
}

TEST(ElasticEnergy, GradientIsTheDerivativeOfTheEnergy) {
  const Sheet sheet = small_sheet();
  const auto plan = make_sheet_plan(sheet);
  for (const Constitutive constitutive : membranes) {
    for (const BendingModel model : bendings) {
      const data::SheetMaterial material = material_of(constitutive, model);
      const BendingOperator& bending = bending_operator(*plan, model, material.poissons_ratio);
      const BodyLaw law{plan->bodies[0], material, bending};
      const Points x = sheet.rest.vertices + noise(sheet.rest.vertices.rows(), 2e-3, 4);
      const Points along = noise(x.rows(), 1, 5);
      const auto energy = [&](double step) {
        Points unused = Points::Zero(x.rows(), 3);
        const ElasticEnergy e = add_elastic_gradient(*plan, law, x + step * along, unused);
        return e.membrane + e.bending;
      };
      Points gradient = Points::Zero(x.rows(), 3);
      add_elastic_gradient(*plan, law, x, gradient);
      const double step = 1e-6;  // central differences: step^2 truncation against 1e-16 / step rounding
      const double slope = (energy(step) - energy(-step)) / (2 * step);
      EXPECT_NEAR(gradient.cwiseProduct(along).sum(), slope, 1e-5 * std::abs(slope));
    }
  }
}

TEST(ElasticEnergy, BendingIsTheSameFarFromTheOrigin) {
  const Sheet sheet = small_sheet();
  const auto plan = make_sheet_plan(sheet);
  const Points x = sheet.rest.vertices + noise(sheet.rest.vertices.rows(), 2e-3, 6);
  const Eigen::RowVector3d shift(10, -20, 5);
  const Points far = x.rowwise() + shift;
  const Points back = far.rowwise() - shift;  // what is left of the places at that distance, exactly
  for (const BendingModel model : {BendingModel::plate, BendingModel::isometric}) {
    const data::SheetMaterial material = material_of(Constitutive::tri_corotated, model);
    const BendingOperator& bending = bending_operator(*plan, model, material.poissons_ratio);
    const BodyLaw law{plan->bodies[0], material, bending};
    Points unused = Points::Zero(x.rows(), 3);
    const double here = add_elastic_gradient(*plan, law, back, unused).bending;
    const double there = add_elastic_gradient(*plan, law, far, unused).bending;
    EXPECT_EQ(there, here);  // differences of such places are exact
  }
}

/// y += values * x, block by block.
void add_block_product(const BlockPattern& pattern, const BlockValues<double>& values, const Points& x,
                       Points& y) {
  const auto block = [&](size_t k) { return Eigen::Map<const Eigen::Matrix3d>(values.data() + 9 * k); };
  for (int i = 0; i < pattern.size; ++i) y.row(i) += (block(i) * x.row(i).transpose()).transpose();
  for (size_t k = 0; k < pattern.pairs.size(); ++k) {
    const auto [row, column] = pattern.pairs[k];
    const auto b = block(pattern.size + k);
    y.row(row) += (b * x.row(column).transpose()).transpose();
    y.row(column) += (b.transpose() * x.row(row).transpose()).transpose();
  }
}

TEST(ElasticEnergy, HessianOfAStretchedSheetIsTheDerivativeOfTheGradient) {
  // Stretched in both directions every eigenvalue is positive, so that the projection changes nothing.
  const Sheet sheet = small_sheet();
  const auto plan = make_sheet_plan(sheet);
  for (const Constitutive constitutive : membranes) {
    const data::SheetMaterial material = material_of(constitutive, BendingModel::plate);
    const BendingOperator& bending = bending_operator(*plan, material.bending_model, material.poissons_ratio);
    const BodyLaw law{plan->bodies[0], material, bending};
    const Points x = 1.1 * sheet.rest.vertices + noise(sheet.rest.vertices.rows(), 2e-4, 4);
    const Points along = noise(x.rows(), 1, 6);
    BlockValues<double> values(9 * (plan->pattern.size + plan->pattern.pairs.size()), 0.0);
    add_elastic_hessian(*plan, law, x, 1.0, Curvature::exact, values);
    Points product = Points::Zero(x.rows(), 3);
    add_block_product(plan->pattern, values, along, product);
    product += bending_product(bending, material.bending_rigidity, along);
    const double step = 1e-7;
    Points ahead = Points::Zero(x.rows(), 3), behind = ahead;
    add_elastic_gradient(*plan, law, x + step * along, ahead);
    add_elastic_gradient(*plan, law, x - step * along, behind);
    const Points expected = (ahead - behind) / (2 * step);
    EXPECT_LT((product - expected).norm(), 1e-6 * expected.norm());
  }
}

TEST(ElasticEnergy, RigidMotionCostsNothing) {
  const Sheet sheet = small_sheet();
  const auto plan = make_sheet_plan(sheet);
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, 2, -1).normalized()).matrix();
  const Points moved = (sheet.rest.vertices * turn.transpose()).rowwise() + Eigen::RowVector3d(0.3, -2, 5);
  for (const Constitutive constitutive : membranes) {
    for (const BendingModel model : bendings) {
      const data::SheetMaterial material = material_of(constitutive, model);
      const BendingOperator& bending = bending_operator(*plan, model, material.poissons_ratio);
      const BodyLaw law{plan->bodies[0], material, bending};
      Points gradient = Points::Zero(moved.rows(), 3);
      const ElasticEnergy energy = add_elastic_gradient(*plan, law, moved, gradient);
      EXPECT_NEAR(energy.membrane, 0, 1e-12);
      // A quadratic model sums products of entries and places that cancel.
      double entries = 0;
      for (const double value : bending.stiffness.values) entries += std::abs(value);
      const double rounding = std::numeric_limits<double>::epsilon() * material.bending_rigidity * entries *
                              moved.cwiseAbs().maxCoeff() * moved.cwiseAbs().maxCoeff();
      EXPECT_NEAR(energy.bending, 0, model == BendingModel::hinge ? 1e-12 : rounding);
      EXPECT_LT(gradient.cwiseAbs().maxCoeff(),
                1e-9);  // E t 100 N/m, edges 0.02 m, rounding 1e-14 of a strain
    }
  }
}

}  // namespace
}  // namespace flash::sim
