#include "sim/membrane.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "data/error.h"

namespace flash::sim {
namespace {

using data::Constitutive;
using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

// F = s1 u1 v1^T + s2 u2 v2^T with s1 >= s2 >= 0, v1 = (c, s), v2 = (-s, c) and n = u1 x u2.
struct SingularValues {
  double s1, s2;
  double c, s;
  Vector3d u1, u2, n;
};

// The angle of v1 comes from the 2 x 2 matrix F^T F by half-angle formulas, s2 from the area |f1 x f2| = s1
// s2, which keeps its relative accuracy where s2 is small.
SingularValues singular_values(const Matrix32& F) {
  const Vector3d f1 = F.col(0), f2 = F.col(1);
  const double a = f1.squaredNorm(), b = f1.dot(f2), d = f2.squaredNorm();
  const double mean = 0.5 * (a + d), half = 0.5 * (a - d);
  const double radius = std::sqrt(half * half + b * b);
  SingularValues r;
  r.s1 = std::sqrt(mean + radius);
  if (r.s1 < 1e-150) return {0, 0, 1, 0, Vector3d::UnitX(), Vector3d::UnitY(), Vector3d::UnitZ()};
  const Vector3d normal = f1.cross(f2);
  const double area = normal.norm();
  r.s2 = area / r.s1;
  const double cos2 = radius > 0 ? half / radius : 1.0;
  const double large = std::sqrt(0.5 * (1 + std::abs(cos2)));
  const double small = radius > 0 ? 0.5 * b / (radius * large) : 0.0;
  r.c = cos2 >= 0 ? large : std::abs(small);
  r.s = cos2 >= 0 ? small : std::copysign(large, b);
  r.u1 = (r.c * f1 + r.s * f2) / r.s1;
  if (area > 1e-12 * r.s1 * r.s1) {
    r.n = normal / area;
    r.u2 = r.n.cross(r.u1);
  } else {
    r.u2 = r.u1.unitOrthogonal();
    r.n = r.u1.cross(r.u2);
  }
  return r;
}

// The energy and its derivatives by the singular values. flip = (p1 - p2)/(s1 - s2) and twist = (p1 + p2)/(s1
// + s2) are written so that nothing cancels at s1 = s2; bend_i = p_i / s_i.
struct Principal {
  double energy;
  double p1, p2;
  double p11, p12, p22;
  double twist, flip;
  double bend1, bend2;
};

constexpr double tiny = 1e-150;

Principal corotated(double s1, double s2, double mu, double lambda) {
  const double e1 = s1 - 1, e2 = s2 - 1, sum = e1 + e2;
  Principal r;
  r.energy = mu * (e1 * e1 + e2 * e2) + 0.5 * lambda * sum * sum;
  r.p1 = 2 * mu * e1 + lambda * sum;
  r.p2 = 2 * mu * e2 + lambda * sum;
  r.p11 = r.p22 = 2 * mu + lambda;
  r.p12 = lambda;
  r.twist = 2 * (mu + lambda) * sum / std::max(s1 + s2, tiny);
  r.flip = 2 * mu;
  r.bend1 = r.p1 / std::max(s1, tiny);
  r.bend2 = r.p2 / std::max(s2, tiny);
  return r;
}

Principal stvk(double s1, double s2, double mu, double lambda) {
  const double c1 = s1 * s1 - 1, c2 = s2 * s2 - 1, trace = 0.5 * lambda * (c1 + c2);
  Principal r;
  r.energy = 0.25 * mu * (c1 * c1 + c2 * c2) + 0.125 * lambda * (c1 + c2) * (c1 + c2);
  r.bend1 = mu * c1 + trace;
  r.bend2 = mu * c2 + trace;
  r.p1 = s1 * r.bend1;
  r.p2 = s2 * r.bend2;
  r.p11 = r.bend1 + (2 * mu + lambda) * s1 * s1;
  r.p22 = r.bend2 + (2 * mu + lambda) * s2 * s2;
  r.p12 = lambda * s1 * s2;
  const double squares = s1 * s1 + s2 * s2 - 1;
  r.twist = mu * (squares - s1 * s2) + trace;
  r.flip = mu * (squares + s1 * s2) + trace;
  return r;
}

Principal neohookean(double s1, double s2, double mu, double lambda) {
  const double area = std::max(s1 * s2, tiny), log_area = std::log(area);
  const double i1 = 1 / std::max(s1, tiny), i2 = 1 / std::max(s2, tiny);
  const double pressure = lambda * log_area - mu;
  Principal r;
  r.energy = s1 * s2 > 0 ? 0.5 * mu * (s1 * s1 + s2 * s2 - 2) + (0.5 * lambda * log_area - mu) * log_area
                         : std::numeric_limits<double>::infinity();
  r.p1 = mu * s1 + pressure * i1;
  r.p2 = mu * s2 + pressure * i2;
  r.bend1 = mu + pressure * i1 * i1;
  r.bend2 = mu + pressure * i2 * i2;
  r.p11 = mu + (lambda - pressure) * i1 * i1;
  r.p22 = mu + (lambda - pressure) * i2 * i2;
  r.p12 = lambda / area;
  r.twist = mu + pressure / area;
  r.flip = mu - pressure / area;
  return r;
}

Principal principal(Constitutive constitutive, double s1, double s2, const SheetLame& lame) {
  switch (constitutive) {
    case Constitutive::tri_arap:
      return corotated(s1, s2, lame.mu, 0.0);
    case Constitutive::tri_corotated:
      return corotated(s1, s2, lame.mu, lame.lambda);
    case Constitutive::tri_stvk:
      return stvk(s1, s2, lame.mu, lame.lambda);
    case Constitutive::tri_neohookean:
      return neohookean(s1, s2, lame.mu, lame.lambda);
    default:
      throw data::InputError(
          "constitutive: a sheet needs one of TRI_ARAP, TRI_COROTATED, TRI_STVK, TRI_NEOHOOKEAN");
  }
}

void clamp(Principal& r) {
  const double mean = 0.5 * (r.p11 + r.p22), half = 0.5 * (r.p11 - r.p22);
  const double radius = std::sqrt(half * half + r.p12 * r.p12);
  if (mean < radius) {
    // One eigenvalue at most stays: A+ = l1 (A - l2 I) / (l1 - l2).
    const double l1 = mean + radius, l2 = mean - radius;
    const double scale = l1 > 0 ? l1 / (l1 - l2) : 0.0;
    r.p11 = scale * (r.p11 - l2);
    r.p22 = scale * (r.p22 - l2);
    r.p12 = scale * r.p12;
  }
  r.twist = std::max(r.twist, 0.0);
  r.flip = std::max(r.flip, 0.0);
  r.bend1 = std::max(r.bend1, 0.0);
  r.bend2 = std::max(r.bend2, 0.0);
}

Matrix32 stress(const SingularValues& f, const Principal& r) {
  const Vector3d t1 = r.p1 * f.u1, t2 = r.p2 * f.u2;
  Matrix32 P;
  P.col(0) = f.c * t1 - f.s * t2;
  P.col(1) = f.s * t1 + f.c * t2;
  return P;
}

// H = sum_ij (v_i v_j^T) x B_ij with B_11 = p11 u1 u1^T + m u2 u2^T + bend1 n n^T, B_22 alike and
// B_12 = p12 u1 u2^T + k u2 u1^T, where m = (flip + twist)/2 and k = (flip - twist)/2.
Matrix66 hessian(const SingularValues& f, const Principal& r) {
  const double m = 0.5 * (r.flip + r.twist), k = 0.5 * (r.flip - r.twist);
  const double cc = f.c * f.c, ss = f.s * f.s, cs = f.c * f.s;
  const double sum = r.p12 + k;
  // Each block as u1 a u1^T + u1 b u2^T + u2 c u1^T + u2 d u2^T + n e n^T.
  const double a00 = cc * r.p11 + ss * m, d00 = cc * m + ss * r.p22, e00 = cc * r.bend1 + ss * r.bend2;
  const double a11 = ss * r.p11 + cc * m, d11 = ss * m + cc * r.p22, e11 = ss * r.bend1 + cc * r.bend2;
  const double b00 = -cs * sum, b11 = cs * sum;
  const double a01 = cs * (r.p11 - m), d01 = cs * (m - r.p22), e01 = cs * (r.bend1 - r.bend2);
  const double b01 = cc * r.p12 - ss * k, c01 = cc * k - ss * r.p12;
  Matrix66 H;
  for (int j = 0; j < 3; ++j) {
    const double x = f.u1[j], y = f.u2[j], z = f.n[j];
    H.col(j).head<3>() = (a00 * x + b00 * y) * f.u1 + (b00 * x + d00 * y) * f.u2 + (e00 * z) * f.n;
    H.col(j + 3).tail<3>() = (a11 * x + b11 * y) * f.u1 + (b11 * x + d11 * y) * f.u2 + (e11 * z) * f.n;
    const Vector3d upper = (a01 * x + b01 * y) * f.u1 + (c01 * x + d01 * y) * f.u2 + (e01 * z) * f.n;
    H.col(j + 3).head<3>() = upper;
    H.row(j + 3).head<3>() = upper;
  }
  return H;
}

}  // namespace

SheetLame sheet_lame(double membrane_stiffness, double poissons_ratio) {
  if (!(membrane_stiffness > 0) || !std::isfinite(membrane_stiffness))
    throw data::input_error("material", "young",
                            "membrane stiffness E t is " + std::to_string(membrane_stiffness) +
                                " N/m, expected a positive number");
  if (!(poissons_ratio > -1 && poissons_ratio < 1))
    throw data::input_error("material", "poisson",
                            std::to_string(poissons_ratio) + ", expected within (-1, 1)");
  return {membrane_stiffness / (2 * (1 + poissons_ratio)),
          membrane_stiffness * poissons_ratio / (1 - poissons_ratio * poissons_ratio)};
}

double membrane_energy_density(Constitutive constitutive, const Matrix32& F, const SheetLame& lame) {
  const SingularValues f = singular_values(F);
  return principal(constitutive, f.s1, f.s2, lame).energy;
}

Matrix32 membrane_stress(Constitutive constitutive, const Matrix32& F, const SheetLame& lame) {
  const SingularValues f = singular_values(F);
  return stress(f, principal(constitutive, f.s1, f.s2, lame));
}

Matrix66 membrane_hessian(Constitutive constitutive, const Matrix32& F, const SheetLame& lame) {
  const SingularValues f = singular_values(F);
  return hessian(f, principal(constitutive, f.s1, f.s2, lame));
}

Matrix66 membrane_hessian_projected(Constitutive constitutive, const Matrix32& F, const SheetLame& lame) {
  const SingularValues f = singular_values(F);
  Principal r = principal(constitutive, f.s1, f.s2, lame);
  clamp(r);
  return hessian(f, r);
}

void membrane_response(Constitutive constitutive, const Matrix32& F, const SheetLame& lame, double& energy,
                       Matrix32& P, Matrix66* response_hessian, Curvature curvature) {
  const SingularValues f = singular_values(F);
  Principal r = principal(constitutive, f.s1, f.s2, lame);
  energy = r.energy;
  P = stress(f, r);
  if (response_hessian) {
    if (curvature == Curvature::positive) clamp(r);
    *response_hessian = hessian(f, r);
  }
}

}  // namespace flash::sim
