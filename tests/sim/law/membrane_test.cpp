#include "sim/law/membrane.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "data/files/error.h"
#include "sim/scene/sheet.h"
#include "tests/sim/reference_scene.h"

namespace flash::sim {
namespace {

using data::Constitutive;

constexpr Constitutive models[] = {Constitutive::tri_arap, Constitutive::tri_corotated,
                                   Constitutive::tri_stvk, Constitutive::tri_neohookean};
const SheetLame lame = sheet_lame(30.0, 0.3);

double membrane_energy_density(Constitutive model, const Matrix32& F, const SheetLame& parameters) {
  double energy;
  Matrix32 stress;
  membrane_response(model, F, parameters, energy, stress, nullptr);
  return energy;
}

Matrix32 membrane_stress(Constitutive model, const Matrix32& F, const SheetLame& parameters) {
  double energy;
  Matrix32 stress;
  membrane_response(model, F, parameters, energy, stress, nullptr);
  return stress;
}

Matrix66 membrane_hessian(Constitutive model, const Matrix32& F, const SheetLame& parameters,
                          Curvature curvature = Curvature::exact) {
  double energy;
  Matrix32 stress;
  Matrix66 hessian;
  membrane_response(model, F, parameters, energy, stress, &hessian, curvature);
  return hessian;
}

// Deformation gradients with given singular values, in random frames.
Matrix32 random_gradient(std::mt19937& rng, double s1, double s2) {
  std::uniform_real_distribution<double> angle(-M_PI, M_PI);
  const Eigen::Quaterniond u = Eigen::Quaterniond(Eigen::AngleAxisd(angle(rng), Eigen::Vector3d::UnitX()) *
                                                  Eigen::AngleAxisd(angle(rng), Eigen::Vector3d::UnitY()) *
                                                  Eigen::AngleAxisd(angle(rng), Eigen::Vector3d::UnitZ()));
  const Eigen::Rotation2Dd v(angle(rng));
  Matrix32 diagonal = Matrix32::Zero();
  diagonal(0, 0) = s1;
  diagonal(1, 1) = s2;
  return u.toRotationMatrix() * diagonal * v.toRotationMatrix().transpose();
}

std::vector<Matrix32> random_gradients(double low, double high, int count, unsigned seed) {
  std::mt19937 rng(seed);
  std::uniform_real_distribution<double> stretch(low, high);
  std::vector<Matrix32> all;
  for (int i = 0; i < count; ++i) all.push_back(random_gradient(rng, stretch(rng), stretch(rng)));
  return all;
}

// s1 + s2 as the corotated laws take it: by a smooth area where a triangle has collapsed.
double smooth_sum(const Eigen::Vector2d& s) {
  const double u = s[0] * s[1] / collapsed_share;
  const double area = collapsed_share * (u < 1 ? 0.375 + 0.75 * u * u - 0.125 * u * u * u * u : u);
  return std::sqrt(s.squaredNorm() + 2 * area);
}

// The definitions in the header, on singular values from Eigen's Jacobi SVD.
double energy_by_svd(Constitutive model, const Matrix32& F) {
  const Eigen::Vector2d s = Eigen::JacobiSVD<Eigen::MatrixXd>(F).singularValues();
  const double mu = lame.mu, lambda = lame.lambda, log_area = std::log(s[0] * s[1]);
  const Eigen::Matrix2d green = 0.5 * (F.transpose() * F - Eigen::Matrix2d::Identity());
  switch (model) {
    case Constitutive::tri_arap:
      return mu * (s.squaredNorm() - 2 * smooth_sum(s) + 2);
    case Constitutive::tri_corotated:
      return mu * (s.squaredNorm() - 2 * smooth_sum(s) + 2) + 0.5 * lambda * std::pow(smooth_sum(s) - 2, 2);
    case Constitutive::tri_stvk:
      return mu * green.squaredNorm() + 0.5 * lambda * std::pow(green.trace(), 2);
    default:
      return 0.5 * mu * (s.squaredNorm() - 2) - mu * log_area + 0.5 * lambda * log_area * log_area;
  }
}

Eigen::Matrix<double, 6, 1> flat(const Matrix32& F) {
  return Eigen::Map<const Eigen::Matrix<double, 6, 1>>(F.data());
}

TEST(Membrane, LameParametersOfPlaneStress) {
  const SheetLame l = sheet_lame(30.0, 0.4);
  EXPECT_DOUBLE_EQ(l.mu, 30.0 / 2.8);
  EXPECT_DOUBLE_EQ(l.lambda, 12.0 / 0.84);
  EXPECT_THROW(sheet_lame(0.0, 0.3), data::InputError);
  EXPECT_THROW(sheet_lame(1.0, 1.0), data::InputError);
  EXPECT_THROW(sheet_lame(1.0, -1.0), data::InputError);
  EXPECT_THROW(sheet_lame(std::nan(""), 0.3), data::InputError);
}

TEST(Membrane, EnergyIsItsDefinition) {
  for (const Constitutive model : models)
    for (const Matrix32& F : random_gradients(0.05, 3.0, 200, 1)) {
      const double expected = energy_by_svd(model, F);
      EXPECT_NEAR(membrane_energy_density(model, F, lame), expected, 1e-12 * (1 + expected) * lame.mu);
    }
}

TEST(Membrane, StressIsTheDerivativeOfTheEnergy) {
  const double step = 1e-6;
  for (const Constitutive model : models)
    for (const Matrix32& F : random_gradients(0.3, 2.0, 100, 2)) {
      const Matrix32 P = membrane_stress(model, F, lame);
      for (int i = 0; i < 6; ++i) {
        Matrix32 forward = F, backward = F;
        forward.data()[i] += step;
        backward.data()[i] -= step;
        const double slope = (energy_by_svd(model, forward) - energy_by_svd(model, backward)) / (2 * step);
        EXPECT_NEAR(P.data()[i], slope, 1e-7 * lame.mu);  // rounding 1e-16 / step and step^2 curvature
      }
    }
}

TEST(Membrane, HessianIsTheDerivativeOfTheStress) {
  const double step = 1e-5;
  for (const Constitutive model : models)
    for (const Matrix32& F : random_gradients(0.3, 2.0, 100, 3)) {
      const Matrix66 H = membrane_hessian(model, F, lame);
      EXPECT_LT((H - H.transpose()).norm(), 1e-12 * H.norm());
      for (int i = 0; i < 6; ++i) {
        Matrix32 forward = F, backward = F;
        forward.data()[i] += step;
        backward.data()[i] -= step;
        const Eigen::Matrix<double, 6, 1> slope =
            (flat(membrane_stress(model, forward, lame)) - flat(membrane_stress(model, backward, lame))) /
            (2 * step);
        EXPECT_LT((H.col(i) - slope).norm(), 1e-6 * H.norm());  // step^2 times third derivatives
      }
    }
}

TEST(Membrane, DerivativesOfACollapsedTriangleAreThoseOfItsEnergy) {
  const double step = 1e-6;
  std::mt19937 rng(10);
  std::uniform_real_distribution<double> area(0, 1.2 * collapsed_share), stretch(0.5, 3);
  for (const Constitutive model : {Constitutive::tri_arap, Constitutive::tri_corotated})
    for (int k = 0; k < 100; ++k) {
      const double s1 = stretch(rng);
      const Matrix32 F = random_gradient(rng, s1, area(rng) / s1);
      const Matrix32 P = membrane_stress(model, F, lame);
      const Matrix66 H = membrane_hessian(model, F, lame);
      for (int i = 0; i < 6; ++i) {
        Matrix32 forward = F, backward = F;
        forward.data()[i] += step;
        backward.data()[i] -= step;
        const double slope = (energy_by_svd(model, forward) - energy_by_svd(model, backward)) / (2 * step);
        // Rounding 1e-16 / step, and step^2 times third derivatives, which grow as the inverse square of the
        // share; of the Hessian fourth derivatives, where it is not kinked itself.
        EXPECT_NEAR(P.data()[i], slope, 1e-7 * lame.mu);
        const Eigen::Matrix<double, 6, 1> bent =
            (flat(membrane_stress(model, forward, lame)) - flat(membrane_stress(model, backward, lame))) /
            (2 * step);
        EXPECT_LT((H.col(i) - bent).norm(), 1e-4 * H.norm());
      }
    }
}

// Where the transverse fibres of a drawn triangle have become points, the force on them would change its sign
// at once, and nothing would be an equilibrium.
TEST(Membrane, ATriangleThatBecomesALineHasNoTransverseForce) {
  for (const double s1 : {0.5, 1.5, 4.0, 30.0})
    for (const double side : {-1.0, 1.0}) {
      Matrix32 F = Matrix32::Zero();
      F(0, 0) = s1;
      F(1, 1) = side * 1e-9;
      const Matrix32 P = membrane_stress(Constitutive::tri_corotated, F, lame);
      // The force per stretch s2: that of (s1 + s2)'s curvature, and of the law without it.
      const double stiffness =
          2 * lame.mu + (lame.lambda * (s1 + 2) + 2 * lame.mu) * (1 + 1.5 / collapsed_share * s1 * s1) / s1;
      EXPECT_LT(std::abs(P(1, 1)), 1e-9 * stiffness);
    }
}

TEST(Membrane, ProjectedHessianIsTheExactOneWithoutItsNegativeEigenvalues) {
  std::vector<Matrix32> gradients = random_gradients(0.2, 1.6, 200, 4);
  std::mt19937 rng(5);
  gradients.push_back(random_gradient(rng, 0.9, 0.9));
  gradients.push_back(random_gradient(rng, 1.0, 1.0));
  gradients.push_back(random_gradient(rng, 1.0, 1.0 - 1e-13));
  gradients.push_back(random_gradient(rng, 1.3, 1e-3));
  gradients.push_back(Matrix32::Identity());
  gradients.push_back(0.7 * Matrix32::Identity());
  for (const Constitutive model : models)
    for (const Matrix32& F : gradients) {
      const Matrix66 H = membrane_hessian(model, F, lame);
      const Eigen::SelfAdjointEigenSolver<Matrix66> eigen(H);
      const Matrix66 expected = eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0.0).asDiagonal() *
                                eigen.eigenvectors().transpose();
      EXPECT_LT((membrane_hessian(model, F, lame, Curvature::positive) - expected).norm(), 1e-11 * H.norm());
    }
}

TEST(Membrane, CollapsedTrianglesHaveFiniteForceAndSemiDefiniteHessian) {
  std::mt19937 rng(6);
  for (const Constitutive model :
       {Constitutive::tri_arap, Constitutive::tri_corotated, Constitutive::tri_stvk})
    for (const double s2 : {0.0, 1e-300, 1e-14, 1e-9})
      for (const double s1 : {0.0, 1e-200, 0.5, 1.2}) {
        const Matrix32 F = random_gradient(rng, s1, std::min(s1, s2));
        EXPECT_TRUE(membrane_stress(model, F, lame).allFinite());
        const Matrix66 H = membrane_hessian(model, F, lame, Curvature::positive);
        ASSERT_TRUE(H.allFinite());
        EXPECT_GE(Eigen::SelfAdjointEigenSolver<Matrix66>(H).eigenvalues().minCoeff(), -1e-12 * lame.mu);
      }
  EXPECT_EQ(membrane_energy_density(Constitutive::tri_neohookean, Matrix32::Zero(), lame),
            std::numeric_limits<double>::infinity());
}

TEST(Membrane, SingularValuesKeepTheirAccuracyWhenTheTriangleIsAlmostALine) {
  std::mt19937 rng(7);
  for (const double s2 : {1e-3, 1e-6, 1e-9}) {
    const Matrix32 F = random_gradient(rng, 1.0, s2);
    // Neo-Hookean sees ln s2: relative accuracy of s2 itself.
    const double expected = 0.5 * lame.mu * (s2 * s2 - 1) - lame.mu * std::log(s2) +
                            0.5 * lame.lambda * std::log(s2) * std::log(s2);
    EXPECT_NEAR(membrane_energy_density(Constitutive::tri_neohookean, F, lame), expected,
                lame.lambda * 1e-15 / s2 * std::abs(std::log(s2)));
  }
}

TEST(Membrane, IsIsotropicAndFrameIndifferent) {
  std::mt19937 rng(9);
  for (const Constitutive model : models)
    for (int i = 0; i < 50; ++i) {
      const Matrix32 F = random_gradient(rng, 1.3, 0.8);
      const Eigen::Matrix3d Q = Eigen::Quaterniond::UnitRandom().toRotationMatrix();
      const Eigen::Matrix2d R = Eigen::Rotation2Dd(0.37 * i).toRotationMatrix();
      const Matrix32 rotated = membrane_stress(model, Q * F * R, lame);
      EXPECT_LT((rotated - Q * membrane_stress(model, F, lame) * R).norm(), 1e-12 * lame.mu);
    }
}

// Uniaxial tension: the lateral stretch makes the lateral stress vanish.
TEST(Membrane, UniaxialStretchGivesBackYoungsModulusAndPoissonsRatio) {
  const double Et = 30.0, nu = 0.3, e = 0.1;
  const auto gradient = [](double s1, double s2) {
    Matrix32 F = Matrix32::Zero();
    F(0, 0) = s1;
    F(1, 1) = s2;
    return F;
  };
  Matrix32 P = membrane_stress(Constitutive::tri_corotated, gradient(1 + e, 1 - nu * e), lame);
  EXPECT_NEAR(P(0, 0), Et * e, 1e-12 * Et);
  EXPECT_NEAR(P(1, 1), 0.0, 1e-12 * Et);
  P = membrane_stress(Constitutive::tri_arap, gradient(1 + e, 1), lame);
  EXPECT_NEAR(P(0, 0), Et / (1 + nu) * e, 1e-12 * Et);
  EXPECT_NEAR(P(1, 1), 0.0, 1e-12 * Et);
  const double S11 = 0.5 * ((1 + e) * (1 + e) - 1);
  P = membrane_stress(Constitutive::tri_stvk, gradient(1 + e, std::sqrt(1 - 2 * nu * S11)), lame);
  EXPECT_NEAR(P(0, 0), Et * (1 + e) * S11, 1e-12 * Et);
  EXPECT_NEAR(P(1, 1), 0.0, 1e-12 * Et);
  const double small = 1e-5;
  P = membrane_stress(Constitutive::tri_neohookean, gradient(1 + small, 1 - nu * small), lame);
  EXPECT_NEAR(P(0, 0), Et * small, 3 * Et * small * small);  // second order in the strain
  EXPECT_NEAR(P(1, 1), 0.0, 3 * Et * small * small);
}

void expect_reference(const std::string& name, Constitutive model) {
  const nlohmann::json scene = reference_scene(name);
  const Sheet sheet = make_sheet(reference_mesh(scene.at("mesh")));
  const data::Points x = reference_points(scene.at("x"));
  const nlohmann::json& material = scene.at("material");
  const SheetLame scene_lame =
      sheet_lame(material.at("E").get<double>() * material.at("thickness").get<double>(), material.at("nu"));
  double energy = 0;
  data::Points force = data::Points::Zero(x.rows(), 3);
  for (const RestTriangle& triangle : sheet.triangles) {
    Matrix32 edges;
    for (int i = 0; i < 2; ++i) edges.col(i) = x.row(triangle.vertices[i + 1]) - x.row(triangle.vertices[0]);
    double density;
    Matrix32 P;
    membrane_response(model, edges * triangle.inverse_edges, scene_lame, density, P, nullptr);
    energy += triangle.area * density;
    const Matrix32 g = triangle.area * P * triangle.inverse_edges.transpose();
    force.row(triangle.vertices[0]) += g.rowwise().sum();
    for (int i = 0; i < 2; ++i) force.row(triangle.vertices[i + 1]) -= g.col(i);
  }
  const double expected = expected_quantity(scene, "energy");
  EXPECT_NEAR(energy, expected, 1e-6 * expected);
  const data::Points expected_force = reference_points(expected_quantity(scene, "force"));
  EXPECT_LT((force - expected_force).cwiseAbs().maxCoeff(), 1e-5 * expected_force.cwiseAbs().maxCoeff());
}

TEST(Membrane, ReferenceSceneArap) { expect_reference("unit_membrane_arap", Constitutive::tri_arap); }
TEST(Membrane, ReferenceSceneCorotated) {
  expect_reference("unit_membrane_corot", Constitutive::tri_corotated);
}
TEST(Membrane, ReferenceSceneStVK) { expect_reference("unit_membrane_stvk", Constitutive::tri_stvk); }
TEST(Membrane, ReferenceSceneNeoHookean) {
  expect_reference("unit_membrane_nh", Constitutive::tri_neohookean);
}

}  // namespace
}  // namespace flash::sim
