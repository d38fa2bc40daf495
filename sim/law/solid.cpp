#include "sim/law/solid.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "data/files/error.h"
#include "data/files/text.h"

namespace flash::sim {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

/// Sum of two singular values below which the kink of the corotated law is rounded in its Hessian.
constexpr double least_sum = 1e-6;

SolidResponse corotated(const SolidLame& lame, const Vector3d& s) {
  const auto& [mu, lambda] = lame;
  const Vector3d e = s.array() - 1;
  const double pressure = lambda * e.sum();
  SolidResponse r;
  r.energy = mu * e.squaredNorm() + 0.5 * pressure * e.sum();
  r.p = (2 * mu * e).array() + pressure;
  r.stretch = Matrix3d::Constant(lambda);
  r.stretch.diagonal().array() += 2 * mu;
  r.flip.setConstant(2 * mu);
  for (int k = 0; k < 3; ++k) {
    const double sum = std::max(s[(k + 1) % 3] + s[(k + 2) % 3], least_sum);
    r.twist[k] = 2 * (mu * (e[(k + 1) % 3] + e[(k + 2) % 3]) + pressure) / sum;
  }
  return r;
}

/// Derivatives of an energy Psi(I, J): 2 dPsi/dI, 4 d^2Psi/dI^2, dPsi/dJ, d^2Psi/dJ^2.
struct ByInvariants {
  double by_i, by_ii, by_j, by_jj;
};

/// All but the energy and, where s is near 1, the digits of p.
SolidResponse response_of(const ByInvariants& d, const Vector3d& s) {
  const Vector3d cofactors(s[1] * s[2], s[2] * s[0], s[0] * s[1]);
  SolidResponse r;
  r.p = d.by_i * s + d.by_j * cofactors;
  r.stretch = d.by_ii * s * s.transpose() + d.by_jj * cofactors * cofactors.transpose();
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    r.stretch(i, j) += d.by_j * s[k];
    r.stretch(j, i) += d.by_j * s[k];
    r.stretch(k, k) += d.by_i;
    r.twist[k] = d.by_i + d.by_j * s[k];
    r.flip[k] = d.by_i - d.by_j * s[k];
  }
  return r;
}

/// J - 1 from e = s - 1.
double volume_change(const Vector3d& e) {
  return e.sum() + e[0] * e[1] + e[1] * e[2] + e[2] * e[0] + e.prod();
}

SolidResponse neo_hookean(const SolidLame& lame, const Vector3d& s) {
  const double mu = lame.mu, bulk = lame.lambda + mu;
  const Vector3d e = s.array() - 1;
  const double change = volume_change(e);
  SolidResponse r = response_of({mu, 0, bulk * change - mu, bulk}, s);
  // (I - 3)/2 - (J - 1) and s_i - s_j s_k by e, so that nothing cancels at small strains.
  const double pairs = e[0] * e[1] + e[1] * e[2] + e[2] * e[0];
  r.energy = mu * (0.5 * e.squaredNorm() - pairs - e.prod()) + 0.5 * bulk * change * change;
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    r.p[k] = mu * (e[k] - e[i] - e[j] - e[i] * e[j]) + bulk * change * s[i] * s[j];
  }
  return r;
}

SolidResponse neo_hookean_log(const SolidLame& lame, const Vector3d& s) {
  const double m = 4.0 / 3 * lame.mu, l = lame.lambda + 5.0 / 6 * lame.mu;
  const Vector3d e = s.array() - 1;
  const double growth = 2 * e.sum() + e.squaredNorm(), change = volume_change(e);  // I - 3 and J - 1
  const double inverse = 1 / (growth + 4);
  // l (J - a) = l (J - 1) - 3/4 m
  SolidResponse r = response_of({m * (1 - inverse), 2 * m * inverse * inverse, l * change - 0.75 * m, l}, s);
  r.energy = 0.5 * m * (growth - std::log1p(0.25 * growth)) + (0.5 * l * change - 0.75 * m) * change;
  return r;
}

}  // namespace

SolidLame solid_lame(double youngs_modulus, double poissons_ratio) {
  if (!(youngs_modulus > 0) || !std::isfinite(youngs_modulus))
    throw data::input_error("material", "young",
                            data::format_short(youngs_modulus) + " Pa, expected a positive number");
  if (!(poissons_ratio > -1 && poissons_ratio < 0.5))
    throw data::input_error(
        "material", "poisson",
        data::format_short(poissons_ratio) + ", expected above -1 and below 0.5 for a solid");
  return {youngs_modulus / (2 * (1 + poissons_ratio)),
          youngs_modulus * poissons_ratio / ((1 + poissons_ratio) * (1 - 2 * poissons_ratio))};
}

Solid solid_of(const data::SolidMaterial& material) {
  const SolidLame lame = solid_lame(material.youngs_modulus, material.poissons_ratio);
  switch (material.constitutive) {
    case data::Constitutive::tet_arap:
      return {SolidLaw::corotated, {lame.mu, 0.0}};
    case data::Constitutive::tet_corotated:
      return {SolidLaw::corotated, lame};
    case data::Constitutive::tet_neohookean:
      return {SolidLaw::neo_hookean, lame};
    case data::Constitutive::tet_neohookean_log:
      return {SolidLaw::neo_hookean_log, lame};
    default:
      throw data::InputError(
          "constitutive: a solid needs one of TET_ARAP, TET_COROTATED, TET_NEOHOOKEAN, TET_NEOHOOKEAN_LOG");
  }
}

SolidFrame solid_frame(const Matrix3d& F) {
  const Eigen::JacobiSVD<Matrix3d> svd(F, Eigen::ComputeFullU | Eigen::ComputeFullV);
  SolidFrame frame{svd.matrixU(), svd.matrixV(), svd.singularValues()};
  for (Matrix3d* side : {&frame.U, &frame.V})
    if (side->determinant() < 0) {
      side->col(2) *= -1;
      frame.s[2] *= -1;
    }
  return frame;
}

SolidResponse solid_response(const Solid& solid, const Vector3d& s) {
  switch (solid.law) {
    case SolidLaw::corotated:
      return corotated(solid.lame, s);
    case SolidLaw::neo_hookean:
      return neo_hookean(solid.lame, s);
    default:
      return neo_hookean_log(solid.lame, s);
  }
}

void clamp(SolidResponse& response) {
  response.twist = response.twist.cwiseMax(0);
  response.flip = response.flip.cwiseMax(0);
  const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(response.stretch);
  if (eigen.eigenvalues()[0] >= 0) return;
  response.stretch =
      eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).asDiagonal() * eigen.eigenvectors().transpose();
}

Matrix3d solid_stress(const SolidFrame& frame, const SolidResponse& response) {
  return frame.U * response.p.asDiagonal() * frame.V.transpose();
}

Matrix3d solid_block(const SolidFrame& frame, const SolidResponse& response, const Vector3d& wi,
                     const Vector3d& wj) {
  // In the principal frame dP_aa = sum_b stretch_ab dF_bb, and with m = (flip + twist)/2, k = (flip -
  // twist)/2 of the pair, dP_ab = m dF_ab + k dF_ba.
  const Vector3d m = 0.5 * (response.flip + response.twist), k = 0.5 * (response.flip - response.twist);
  Matrix3d block;
  for (int a = 0; a < 3; ++a) {
    const int b = (a + 1) % 3, c = (a + 2) % 3;
    block(a, a) = response.stretch(a, a) * wi[a] * wj[a] + m[c] * wi[b] * wj[b] + m[b] * wi[c] * wj[c];
    block(a, b) = response.stretch(a, b) * wi[a] * wj[b] + k[c] * wi[b] * wj[a];
    block(b, a) = response.stretch(b, a) * wi[b] * wj[a] + k[c] * wi[a] * wj[b];
  }
  return frame.U * block * frame.U.transpose();
}

Matrix99 solid_hessian(const SolidFrame& frame, const SolidResponse& response) {
  Matrix99 hessian;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      hessian.block<3, 3>(3 * i, 3 * j) =
          solid_block(frame, response, frame.V.row(i).transpose(), frame.V.row(j).transpose());
  return hessian;
}

}  // namespace flash::sim
