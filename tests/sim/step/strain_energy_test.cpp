#include "sim/step/strain_energy.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "sim/step/elastic_energy.h"
#include "tests/sim/sheet_scene.h"

namespace flash::sim {
namespace {

using data::Points;

Points noise(Eigen::Index rows, double size, unsigned seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> draw(-size, size);
  Points points(rows, 3);
  for (Eigen::Index i = 0; i < points.size(); ++i) points.data()[i] = draw(generator);
  return points;
}

/// A matrix of blocks times a motion of the vertices.
Points product_of(const SheetPlan& plan, const BlockValues<double>& values, const Points& along) {
  Points product = Points::Zero(along.rows(), 3);
  for (int i = 0; i < plan.pattern.size; ++i)
    product.row(i) += along.row(i) * Eigen::Map<const Eigen::Matrix3d>(values.data() + 9 * i).transpose();
  for (size_t k = 0; k < plan.pattern.pairs.size(); ++k) {
    const auto [row, column] = plan.pattern.pairs[k];
    const Eigen::Map<const Eigen::Matrix3d> block(values.data() + 9 * (plan.pattern.size + k));
    product.row(row) += along.row(column) * block.transpose();
    product.row(column) += along.row(row) * block;
  }
  return product;
}

/// Sheets that lie as they are, and turned: isotropic, and woven.
const data::SheetMaterial materials[] = {
    {.constitutive = data::Constitutive::tri_stvk, .membrane_stiffness = 200},
    {.constitutive = data::Constitutive::tri_stvk,
     .membrane_stiffness = 200,
     .weave = {.warp_direction = 0.6, .young_ratio = 0.3, .shear_ratio = 0.1}}};

class StrainEnergy : public testing::TestWithParam<bool> {
 protected:
  const Sheet sheet = small_sheet();
  const std::shared_ptr<const SheetPlan> plan = make_sheet_plan(sheet);
  const Points start = 1.05 * sheet.rest.vertices + noise(sheet.rest.vertices.rows(), 3e-3, 1);
  const Points x = start + noise(start.rows(), 2e-3, 3), along = noise(x.rows(), 1, 4);
  const std::vector<Eigen::Matrix2d> metrics =
      GetParam() ? triangle_metrics(*plan, start) : std::vector<Eigen::Matrix2d>{};

  double energy(const SheetStiffness& stiffness, const Points& at, Points& gradient) const {
    gradient = Points::Zero(at.rows(), 3);
    return add_strain_gradient(*plan, plan->bodies[0], metrics, stiffness, at, gradient);
  }
};

TEST_P(StrainEnergy, HasItsDerivatives) {
  for (const data::SheetMaterial& material : materials) {
    const SheetStiffness stiffness(material);
    const double step = 1e-7;  // step^2 truncation against 1e-16 / step rounding
    Points gradient, ahead, behind;
    energy(stiffness, x, gradient);
    const double slope =
        (energy(stiffness, x + step * along, ahead) - energy(stiffness, x - step * along, behind)) /
        (2 * step);
    EXPECT_NEAR(gradient.cwiseProduct(along).sum(), slope, 1e-6 * std::abs(slope));
    BlockValues<double> values(9 * (plan->pattern.size + plan->pattern.pairs.size()), 0.0);
    add_strain_hessian(*plan, plan->bodies[0], metrics, stiffness, x, Curvature::exact, values);
    const Points expected = (ahead - behind) / (2 * step);
    EXPECT_LT((product_of(*plan, values, along) - expected).norm(), 1e-6 * expected.norm());
  }
}

TEST_P(StrainEnergy, ItsPositiveHessianPushesAgainstAnyMotion) {
  const Points pressed = 0.8 * x;
  for (const data::SheetMaterial& material : materials) {
    BlockValues<double> values(9 * (plan->pattern.size + plan->pattern.pairs.size()), 0.0);
    add_strain_hessian(*plan, plan->bodies[0], metrics, SheetStiffness(material), pressed,
                       Curvature::positive, values);
    for (unsigned seed = 10; seed < 60; ++seed) {
      const Points motion = noise(x.rows(), 1, seed);
      EXPECT_GE(motion.cwiseProduct(product_of(*plan, values, motion)).sum(), 0);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(OfRestAndOfAStep, StrainEnergy, testing::Bool());

/// Where a weave is none but by a millionth, it is the isotropic law, which the kernels have.
TEST(WovenMembrane, IsTheIsotropicOneWhereItsRatiosAreOne) {
  const Sheet sheet = small_sheet();
  const auto plan = make_sheet_plan(sheet);
  Environment plain = environment_of(sheet);
  plain.materials[0] = {.constitutive = data::Constitutive::tri_stvk, .membrane_stiffness = 200};
  Environment woven = plain;
  woven.materials[0].weave = {.warp_direction = 0.4, .young_ratio = 1 + 1e-6, .shear_ratio = 1 - 1e-6};
  const Points x = 1.05 * sheet.rest.vertices + noise(sheet.rest.vertices.rows(), 3e-3, 1);
  Points one = Points::Zero(x.rows(), 3), other = one;
  const double energy = add_elastic_gradient(*plan, body_laws(*plan, plain)[0], x, one).membrane;
  EXPECT_NEAR(add_elastic_gradient(*plan, body_laws(*plan, woven)[0], x, other).membrane, energy,
              2e-6 * energy);
  EXPECT_LT((one - other).norm(), 4e-6 * one.norm());
}

}  // namespace
}  // namespace flash::sim
