// Equilibria with closed forms. Long steps of implicit Euler with drag end in them.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/sim/sheet_scene.h"

namespace flash::sim {
namespace {

using data::Constitutive;
using data::DiagonalPattern;

constexpr double g = 9.81;

/// Steps until the sheet rests.
StepReport settle(const Sheet& sheet, Environment& environment, double time_step, int steps,
                  double tolerance) {
  Solver solver(sheet, {.time_step = time_step, .max_iterations = 200, .tolerance = tolerance});
  StepReport report;
  for (int n = 0; n < steps; ++n) report = solver.step(environment);
  EXPECT_TRUE(report.converged);
  return report;
}

class Patch : public testing::TestWithParam<Constitutive> {};

TEST_P(Patch, UniaxialStretchGivesBackYoungsModulusAndPoissonsRatio) {
  // Irregular mesh pulled by 1e-4 between rollers, sides free.
  const double width = 0.1, height = 0.08, stretch = 1e-4;
  const Sheet sheet = make_sheet(data::delaunay_rectangle(width, height, 0.012, 3));
  Environment environment = environment_of(sheet);
  environment.gravity.setZero();
  environment.materials[0].constitutive = GetParam();
  environment.materials[0].membrane_stiffness = 120;
  environment.materials[0].poissons_ratio = 0.3;
  for (int i = 0; i < sheet.rest.vertices.rows(); ++i) {
    const auto x = sheet.rest.vertices.row(i);
    const bool left = x[0]<1e-9, right = x[0]> width - 1e-9;
    environment.holds.push_back(
        support(i, {left || right, left && x[1] < 1e-9, true}, {right ? width * (1 + stretch) : 0, 0, 0}));
  }
  const StepReport report = settle(sheet, environment, 10, 12, 1e-11);
  const double lateral =
      (environment.state.positions.col(1).maxCoeff() - environment.state.positions.col(1).minCoeff()) /
          height -
      1;
  const bool arap = GetParam() == Constitutive::tri_arap;
  const double modulus = arap ? 120 / 1.3 : 120, ratio = arap ? 0 : 0.3;  // ARAP knows E / (1 + nu) alone
  // Energy per area 1/2 E t e^2; the models differ from Hooke at order e: 3/2 e for St. Venant-Kirchhoff.
  EXPECT_NEAR(report.membrane, 0.5 * modulus * stretch * stretch * width * height, 3e-4 * report.membrane);
  EXPECT_NEAR(lateral / stretch, -ratio, 2e-4);
}

TEST_P(Patch, ShearGivesBackTheShearModulus) {
  const double side = 0.1, shear = 1e-3;
  const Sheet sheet = make_sheet(data::delaunay_rectangle(side, side, 0.012, 5));
  Environment environment = environment_of(sheet);
  environment.gravity.setZero();
  environment.materials[0].constitutive = GetParam();
  environment.materials[0].membrane_stiffness = 120;
  environment.materials[0].poissons_ratio = 0.3;
  for (int i = 0; i < sheet.rest.vertices.rows(); ++i) {
    const Eigen::Vector3d x = sheet.rest.vertices.row(i);
    const bool border = x.head<2>().minCoeff() < 1e-9 || x.head<2>().maxCoeff() > side - 1e-9;
    environment.holds.push_back(
        support(i, {border, border, true}, x + shear / 2 * Eigen::Vector3d(x[1], x[0], 0)));
  }
  const StepReport report = settle(sheet, environment, 10, 12, 1e-11);
  const double mu = 120 / (2 * 1.3);
  EXPECT_NEAR(report.membrane, 0.5 * mu * shear * shear * side * side, 1e-4 * report.membrane);
}

INSTANTIATE_TEST_SUITE_P(Membranes, Patch,
                         testing::Values(Constitutive::tri_arap, Constitutive::tri_corotated,
                                         Constitutive::tri_stvk, Constitutive::tri_neohookean));

/// The pull of Patch on a woven sheet, along its warp, its weft and between. The state is uniform at any
/// angle: both ends may slide across, so that the sheet shears as it likes.
TEST(Statics, AWovenSheetStretchesAsItsDirectionsSay) {
  const double width = 0.1, height = 0.08, stretch = 1e-4, e1 = 120, e2 = 36, degree = M_PI / 180;
  const double g12 = 0.1 * std::sqrt(e1 * e2) / (2 * 1.3), nu12 = 0.3 / std::sqrt(e2 / e1);
  const Sheet sheet = make_sheet(data::delaunay_rectangle(width, height, 0.012, 3));
  for (const double warp : {0.0, 90.0, 45.0, -25.0}) {
    Environment environment = environment_of(sheet);
    environment.gravity.setZero();
    environment.materials[0] = {
        .constitutive = Constitutive::tri_stvk,
        .membrane_stiffness = e1,
        .weave = {.warp_direction = warp * degree, .young_ratio = e2 / e1, .shear_ratio = 0.1}};
    for (int i = 0; i < sheet.rest.vertices.rows(); ++i) {
      const auto x = sheet.rest.vertices.row(i);
      const bool left = x[0]<1e-9, right = x[0]> width - 1e-9;
      environment.holds.push_back(
          support(i, {left || right, left && x[1] < 1e-9, true}, {right ? width * (1 + stretch) : 0, 0, 0}));
    }
    const StepReport report = settle(sheet, environment, 10, 12, 1e-11);
    const double c = std::cos(warp * degree), s = std::sin(warp * degree);
    const double compliance =
        std::pow(c, 4) / e1 + std::pow(s, 4) / e2 + (1 / g12 - 2 * nu12 / e1) * c * c * s * s;
    // Green's strain differs from the stretch by 3/2 of it, that of shear by its square over E.
    EXPECT_NEAR(report.membrane, 0.5 / compliance * stretch * stretch * width * height,
                1e-3 * report.membrane)
        << warp;
  }
}

TEST(Statics, AHangingStripStretchesByItsOwnWeight) {
  const double length = 0.5, width = 0.02;
  const Sheet sheet =
      make_sheet(data::rectangle({.width = length, .height = width, .cells_x = 50, .cells_y = 2}));
  Environment environment = environment_of(sheet);
  environment.materials[0] = {.membrane_stiffness = 200,
                              .poissons_ratio = 0,
                              .areal_density = 0.2,
                              .bending_rigidity = 1e-8,
                              .air_drag = 5};
  environment.gravity = {g, 0, 0};
  for (int i = 0; i < sheet.rest.vertices.rows(); ++i)
    if (sheet.rest.vertices(i, 0) < 1e-9)
      environment.holds.push_back(support(i, {true, true, true}, sheet.rest.vertices.row(i)));
  settle(sheet, environment, 1, 20, 1e-8);
  const double elongation = environment.state.positions.col(0).maxCoeff() - length;
  const double expected = 0.2 * g * length * length / (2 * 200);
  EXPECT_NEAR(elongation, expected, 1e-3 * expected);  // lumped ends: h / L of the last half cell squared
}

struct Elastica {
  double gamma;  ///< rho_A g L^3 / D
  double drop;   ///< of the tip over L
};

class HeavyElastica : public testing::TestWithParam<std::string> {};

TEST_P(HeavyElastica, TipDropsAsTheBoundaryValueProblemSays) {
  // E t = 2e3 rho_A g L: stretch 2.5e-4, and little membrane locking at 1/64. The clamp of two columns acts
  // half a cell before the last one.
  const double length = 0.2, cell = length / 64, density = 0.2;
  const Sheet sheet = make_sheet([&] {
    data::TriangleMesh mesh =
        data::parse_mesh_spec("sheet:" + std::to_string(length + cell) + "x0.02:0.003125:" + GetParam());
    mesh.vertices.col(0).array() -= cell;
    return mesh;
  }());
  const double effective = length + cell / 2;
  for (const Elastica& row : {Elastica{1, 0.12347}, {10, 0.70020}, {50, 0.90792}, {100, 0.93752}}) {
    Environment environment = environment_of(sheet);
    environment.materials[0] = {.membrane_stiffness = 2e3 * density * g * length,
                                .poissons_ratio = 0,
                                .areal_density = density,
                                .bending_rigidity = density * g * std::pow(effective, 3) / row.gamma,
                                .air_drag = 5};
    for (int i = 0; i < sheet.rest.vertices.rows(); ++i)
      if (sheet.rest.vertices(i, 0) < 1e-3)
        environment.holds.push_back(support(i, {true, true, true}, sheet.rest.vertices.row(i)));
    settle(sheet, environment, 0.2, 60, 1e-6);
    double tip = 0;
    int count = 0;
    for (int i = 0; i < sheet.rest.vertices.rows(); ++i) {
      if (sheet.rest.vertices(i, 0) < length - 1e-6) continue;
      tip -= environment.state.positions(i, 2);
      ++count;
    }
    EXPECT_NEAR(tip / count / effective, row.drop, 0.01 * row.drop) << "Gamma " << row.gamma;
  }
}

INSTANTIATE_TEST_SUITE_P(Meshes, HeavyElastica,
                         testing::Values("one_way", "alternating", "alternating_by_row", "jittered",
                                         "delaunay"),
                         [](const auto& mesh) { return mesh.param; });

}  // namespace
}  // namespace flash::sim
