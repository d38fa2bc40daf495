#pragma once
#include <Eigen/Core>

#include "data/asset/material.h"
#include "sim/law/membrane.h"

namespace flash::sim {

/// Lame parameters of a solid [Pa].
struct SolidLame {
  double mu;      ///< shear modulus
  double lambda;  ///< first parameter
};

/// mu = E / (2 (1 + nu)), lambda = E nu / ((1 + nu) (1 - 2 nu)).
/// Throws data::InputError unless E > 0 and -1 < nu < 1/2.
SolidLame solid_lame(double youngs_modulus, double poissons_ratio);

// Solids are isotropic. With the singular values s1 >= s2 >= |s3| of the 3 x 3 deformation gradient F, s3
// negative where a tetrahedron is inverted, e_i = s_i - 1, I = s1^2 + s2^2 + s3^2 and J = s1 s2 s3 = det F:
//   tet_arap            mu sum e_i^2
//   tet_corotated       mu sum e_i^2 + lambda/2 (sum e_i)^2
//   tet_neohookean      mu/2 (I - 3) - mu (J - 1) + (lambda + mu)/2 (J - 1)^2
//   tet_neohookean_log  m/2 (I - 3) - m/2 log((I + 1)/4) + l/2 ((J - a)^2 - (1 - a)^2),
//                       m = 4/3 mu, l = lambda + 5/6 mu, a = 1 + 3 m / (4 l)
// The last two are the stable neo-Hookean energy (Smith, de Goes, Kim 2018, "Stable neo-Hookean flesh
// simulation", eq. 13 and 14), without and with its barrier term. Their parameters are mapped so that E and
// nu at small strains are those of the material (sec. 3.4). They are smooth at every F. The first two have a
// kink where s2 + s3 = 0, in an inverted tetrahedron. All are per rest volume [Pa].

/// The formulas; tet_arap is `corotated` with lambda = 0.
enum class SolidLaw { corotated, neo_hookean, neo_hookean_log };

/// A law with the parameters that it takes.
struct Solid {
  SolidLaw law;
  SolidLame lame;
};

/// Throws data::InputError on a tri_* model and on a material out of range.
Solid solid_of(const data::SolidMaterial& material);

using Matrix99 = Eigen::Matrix<double, 9, 9>;

/// F = U diag(s) V^T with rotations U and V, s1 >= s2 >= |s3|.
struct SolidFrame {
  Eigen::Matrix3d U, V;
  Eigen::Vector3d s;
};
SolidFrame solid_frame(const Eigen::Matrix3d& F);

/// The energy and its derivatives by the singular values. Of the pair of axes other than k,
/// twist_k = (p_i + p_j)/(s_i + s_j) and flip_k = (p_i - p_j)/(s_i - s_j), written so that nothing cancels.
/// These and the eigenvalues of `stretch` are those of the Hessian (Smith, de Goes, Kim 2019, "Analytic
/// eigensystems for isotropic distortion energies", sec. 4).
struct SolidResponse {
  double energy;            ///< [Pa]
  Eigen::Vector3d p;        ///< dPsi/ds [Pa]
  Eigen::Matrix3d stretch;  ///< d p_i / d s_j [Pa]
  Eigen::Vector3d twist, flip;
};
SolidResponse solid_response(const Solid& solid, const Eigen::Vector3d& s);

/// Sets negative eigenvalues of the Hessian to zero.
void clamp(SolidResponse& response);

/// The first Piola-Kirchhoff stress, U diag(p) V^T.
Eigen::Matrix3d solid_stress(const SolidFrame& frame, const SolidResponse& response);

/// What the motion of a vertex with the shape gradient w_j adds to the force that the stress exerts on one
/// with w_i, per volume: sum_cd w_ic w_jd d P_.c / d F_.d. `wi` and `wj` are turned: V^T w.
Eigen::Matrix3d solid_block(const SolidFrame& frame, const SolidResponse& response, const Eigen::Vector3d& wi,
                            const Eigen::Vector3d& wj);

/// d vec(P) / d vec(F) by columns, for the law alone [Pa].
Matrix99 solid_hessian(const SolidFrame& frame, const SolidResponse& response);

}  // namespace flash::sim
