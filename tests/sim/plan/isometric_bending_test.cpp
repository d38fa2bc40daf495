#include "sim/plan/isometric_bending.h"

#include <gtest/gtest.h>

#include <cmath>

#include "data/mesh/procedural_mesh.h"
#include "tests/sim/reference_scene.h"

namespace flash::sim {
namespace {

TEST(IsometricBending, AffineMapsOfTheFlatSheetCostNothing) {
  const Sheet sheet = make_sheet(data::delaunay_rectangle(0.2, 0.1, 0.02, 3));
  const Eigen::SparseMatrix<double> K = isometric_bending_stiffness(sheet);
  data::Points x = sheet.rest.vertices;
  x.col(2) = 0.3 * x.col(0) - 0.2 * x.col(1);
  x.rowwise() += Eigen::RowVector3d(1, 2, 3);
  EXPECT_LT((K * x).cwiseAbs().maxCoeff(),
            1e-9 * K.diagonal().maxCoeff());  // rounding of positions of size 3
}

// A parabola bent along the strip: with factor 1 the energy of a right-angled grid is D kappa^2/2 per area,
// boundary rows aside.
TEST(IsometricBending, CylinderCostsItsRigidity) {
  const int cells = 60;
  const Sheet sheet = make_sheet(
      data::rectangle({1.0, 1.0, cells, cells, data::DiagonalPattern::alternating_by_row, 0.0, 1}));
  const Eigen::SparseMatrix<double> K = isometric_bending_stiffness(sheet);
  const double kappa = 0.7;
  const Eigen::VectorXd z = 0.5 * kappa * sheet.rest.vertices.col(0).array().square();
  EXPECT_NEAR(0.5 * z.dot(K * z), 0.5 * kappa * kappa,
              3.0 / cells * 0.5 * kappa * kappa);  // a cell lost a side
}

TEST(IsometricBending, ReferenceScene) {
  const nlohmann::json scene = reference_scene("unit_bending_quadratic");
  const Sheet sheet = make_sheet(reference_mesh(scene.at("mesh")));
  const data::Points x = reference_points(scene.at("x"));
  const double D = scene.at("bending").at("D");
  const data::Points force = -D * (isometric_bending_stiffness(sheet) * x);
  const double expected = expected_quantity(scene, "energy");
  EXPECT_NEAR(-0.5 * force.cwiseProduct(x).sum(), expected, 1e-6 * expected);
  const data::Points expected_force = reference_points(expected_quantity(scene, "force"));
  EXPECT_LT((force - expected_force).cwiseAbs().maxCoeff(), 1e-5 * expected_force.cwiseAbs().maxCoeff());
}

}  // namespace
}  // namespace flash::sim
