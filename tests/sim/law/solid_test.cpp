#include "sim/law/solid.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <cmath>
#include <random>
#include <vector>

#include "data/files/error.h"

namespace flash::sim {
namespace {

using data::Constitutive;
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr Constitutive models[] = {Constitutive::tet_arap, Constitutive::tet_corotated,
                                   Constitutive::tet_neohookean, Constitutive::tet_neohookean_log};
constexpr double youngs_modulus = 3e4, poissons_ratio = 0.4;

Solid solid(Constitutive model, double nu = poissons_ratio) {
  return solid_of({.constitutive = model, .youngs_modulus = youngs_modulus, .poissons_ratio = nu});
}

double energy_of(const Solid& law, const Matrix3d& F) { return solid_response(law, solid_frame(F).s).energy; }

Matrix3d stress_of(const Solid& law, const Matrix3d& F) {
  const SolidFrame frame = solid_frame(F);
  return solid_stress(frame, solid_response(law, frame.s));
}

Matrix99 hessian_of(const Solid& law, const Matrix3d& F, bool positive = false) {
  const SolidFrame frame = solid_frame(F);
  SolidResponse response = solid_response(law, frame.s);
  if (positive) clamp(response);
  return solid_hessian(frame, response);
}

// The definitions in the header, by invariants of F and by Eigen's polar factors.
double energy_by_definition(Constitutive model, const Matrix3d& F) {
  const double mu = youngs_modulus / (2 * (1 + poissons_ratio)),
               lambda = youngs_modulus * poissons_ratio / ((1 + poissons_ratio) * (1 - 2 * poissons_ratio));
  const double I = F.squaredNorm(), J = F.determinant();
  if (model == Constitutive::tet_neohookean)
    return mu / 2 * (I - 3) - mu * (J - 1) + (lambda + mu) / 2 * (J - 1) * (J - 1);
  if (model == Constitutive::tet_neohookean_log) {
    const double m = 4 * mu / 3, l = lambda + 5 * mu / 6, a = 1 + 3 * m / (4 * l);
    return m / 2 * (I - 3) - m / 2 * std::log((I + 1) / 4) + l / 2 * ((J - a) * (J - a) - (1 - a) * (1 - a));
  }
  const Eigen::JacobiSVD<Matrix3d> svd(F, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Vector3d signs(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1);
  const Matrix3d stretch =
      svd.matrixV() * signs.asDiagonal() * svd.singularValues().asDiagonal() * svd.matrixV().transpose() -
      Matrix3d::Identity();
  const double l = model == Constitutive::tet_arap ? 0 : lambda;
  return mu * stretch.squaredNorm() + l / 2 * stretch.trace() * stretch.trace();
}

std::vector<Matrix3d> gradients(double size, int count, unsigned seed, bool inverted) {
  std::mt19937 rng(seed);
  std::uniform_real_distribution<double> entry(-size, size), angle(-M_PI, M_PI);
  std::vector<Matrix3d> all;
  while (static_cast<int>(all.size()) < count) {
    Matrix3d change;
    for (double& value : change.reshaped()) value = entry(rng);
    const Matrix3d turn =
        (Eigen::AngleAxisd(angle(rng), Vector3d::UnitX()) * Eigen::AngleAxisd(angle(rng), Vector3d::UnitZ()))
            .toRotationMatrix();
    const Matrix3d F = turn * (Matrix3d::Identity() + change);
    // Away from the kink of the corotated laws, where no derivative exists.
    const Vector3d s = solid_frame(F).s;
    if ((F.determinant() < 0) == inverted && s[1] + s[2] > 0.1) all.push_back(F);
  }
  return all;
}

std::vector<Matrix3d> any_gradients(unsigned seed) {
  std::vector<Matrix3d> all = gradients(0.6, 20, seed, false);
  for (const Matrix3d& F : gradients(1.2, 10, seed + 1, true)) all.push_back(F);
  return all;
}

TEST(Solid, EnergiesAreAsDefined) {
  for (const Constitutive model : models)
    for (const Matrix3d& F : any_gradients(1)) {
      const double expected = energy_by_definition(model, F);
      EXPECT_NEAR(energy_of(solid(model), F), expected, 1e-12 * (youngs_modulus + std::abs(expected)));
    }
}

TEST(Solid, SingularFrameIsOfRotations) {
  for (const Matrix3d& F : any_gradients(2)) {
    const SolidFrame f = solid_frame(F);
    EXPECT_NEAR(f.U.determinant(), 1, 1e-12);
    EXPECT_NEAR(f.V.determinant(), 1, 1e-12);
    EXPECT_LT((f.U * f.s.asDiagonal() * f.V.transpose() - F).norm(), 1e-13 * F.norm());
    EXPECT_GE(f.s[0], f.s[1]);
    EXPECT_GE(f.s[1], std::abs(f.s[2]));
  }
}

TEST(Solid, StressIsTheGradientOfTheEnergy) {
  const double h = 1e-6;  // the error of central differences is h^2 of the third derivative, 1e-11 E
  for (const Constitutive model : models)
    for (const Matrix3d& F : any_gradients(3)) {
      const Matrix3d P = stress_of(solid(model), F);
      for (int k = 0; k < 9; ++k) {
        Matrix3d plus = F, minus = F;
        plus.reshaped()[k] += h;
        minus.reshaped()[k] -= h;
        const double slope =
            (energy_by_definition(model, plus) - energy_by_definition(model, minus)) / (2 * h);
        EXPECT_NEAR(P.reshaped()[k], slope, 1e-8 * (youngs_modulus + P.norm()));
      }
    }
}

TEST(Solid, HessianIsTheGradientOfTheStress) {
  const double h = 1e-6;
  for (const Constitutive model : models)
    for (const Matrix3d& F : any_gradients(4)) {
      const Matrix99 H = hessian_of(solid(model), F);
      EXPECT_LT((H - H.transpose()).norm(), 1e-12 * H.norm());
      for (int k = 0; k < 9; ++k) {
        Matrix3d plus = F, minus = F;
        plus.reshaped()[k] += h;
        minus.reshaped()[k] -= h;
        const Matrix3d slope = (stress_of(solid(model), plus) - stress_of(solid(model), minus)) / (2 * h);
        EXPECT_LT((H.col(k) - slope.reshaped()).norm(), 1e-7 * H.norm());
      }
    }
}

TEST(Solid, PositiveHessianIsTheNearestOne) {
  for (const Constitutive model : models)
    for (const Matrix3d& F : any_gradients(5)) {
      const Eigen::SelfAdjointEigenSolver<Matrix99> eigen(hessian_of(solid(model), F));
      const Matrix99 nearest = eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).asDiagonal() *
                               eigen.eigenvectors().transpose();
      EXPECT_LT((hessian_of(solid(model), F, true) - nearest).norm(), 1e-11 * nearest.norm());
    }
}

TEST(Solid, RotationsCostNothing) {
  for (const Constitutive model : models)
    for (const Matrix3d& F : any_gradients(6)) {
      const SolidFrame f = solid_frame(F);
      const Matrix3d turn = f.U * f.V.transpose();
      EXPECT_LT(energy_of(solid(model), turn), 1e-24 * youngs_modulus);
      EXPECT_LT(stress_of(solid(model), turn).norm(), 1e-13 * youngs_modulus);
      // An isotropic law sees the stretch alone, on either side.
      const double energy = energy_of(solid(model), F);
      EXPECT_NEAR(energy_of(solid(model), turn * F), energy, 1e-12 * (youngs_modulus + energy));
      EXPECT_NEAR(energy_of(solid(model), F * turn), energy, 1e-12 * (youngs_modulus + energy));
    }
}

// Hooke's law: stress of a small strain, whatever the model; tet_arap has no lambda.
TEST(Solid, SmallStrainsObeyHookesLaw) {
  const double size = 1e-6;  // what a law adds in second order is 1e-6 of the stress
  const SolidLame lame = solid_lame(youngs_modulus, poissons_ratio);
  Matrix3d strain;
  strain << 0.3, -0.2, 0.5, -0.2, 0.7, 0.1, 0.5, 0.1, -0.4;
  strain *= size;
  for (const Constitutive model : models) {
    const double lambda = model == Constitutive::tet_arap ? 0 : lame.lambda;
    const Matrix3d expected = 2 * lame.mu * strain + lambda * strain.trace() * Matrix3d::Identity();
    const Matrix3d P = stress_of(solid(model), Matrix3d::Identity() + strain);
    EXPECT_LT((P - expected).norm(), 10 * size * expected.norm());
  }
}

TEST(Solid, NeoHookeanHasDerivativesWhereATetrahedronIsFlatOrAPoint) {
  for (const Constitutive model : {Constitutive::tet_neohookean, Constitutive::tet_neohookean_log})
    for (const Vector3d& s : {Vector3d(1, 1, 0), Vector3d(1, 0, 0), Vector3d(0, 0, 0), Vector3d(1, 1, -1)}) {
      const Matrix3d F = s.asDiagonal();
      EXPECT_TRUE(hessian_of(solid(model), F).allFinite());
      EXPECT_TRUE(stress_of(solid(model), F).allFinite());
    }
}

TEST(Solid, MaterialsOutOfRangeAreNamed) {
  const auto message = [](const data::SolidMaterial& material) -> std::string {
    try {
      solid_of(material);
    } catch (const data::InputError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(message({.poissons_ratio = 0.5}),
            "material: poisson: 0.5, expected above -1 and below 0.5 for a solid");
  EXPECT_EQ(message({.youngs_modulus = 0}), "material: young: 0 Pa, expected a positive number");
  EXPECT_EQ(message({.constitutive = Constitutive::tri_arap}),
            "constitutive: a solid needs one of TET_ARAP, TET_COROTATED, TET_NEOHOOKEAN, TET_NEOHOOKEAN_LOG");
}

}  // namespace
}  // namespace flash::sim
