#pragma once
#include <Eigen/Core>

#include "data/asset/material.h"
#include "sim/law/membrane_law.h"

namespace flash::sim {

using Matrix32 = Eigen::Matrix<double, 3, 2>;
using Matrix66 = Eigen::Matrix<double, 6, 6>;

/// mu = E t / (2 (1 + nu)), lambda = E t nu / (1 - nu^2), from E t [N/m].
/// Throws data::InputError unless E t > 0 and -1 < nu < 1.
SheetLame sheet_lame(double membrane_stiffness, double poissons_ratio);

// Membranes are isotropic: with s1 >= s2 >= 0 the singular values of the 3 x 2 deformation gradient F,
//   tri_arap        mu (e1^2 + e2^2),  e_i = s_i - 1
//   tri_corotated   mu (e1^2 + e2^2) + lambda/2 (e1 + e2)^2
//   tri_stvk        mu |S|^2 + lambda/2 tr(S)^2,  S = (F^T F - I)/2
//   tri_neohookean  mu/2 (s1^2 + s2^2 - 2) - mu ln J + lambda/2 ln(J)^2,  J = s1 s2 (infinite at J = 0)
// s1 + s2, in the first two laws, is sqrt(s1^2 + s2^2 + 2 J), and has a kink where a triangle becomes a line.
// There J is made smooth: below collapsed_share of the rest area. All are per rest area [N/m]; a derivative
// by F is taken by vec(F) = (first column, second column). The functions throw data::InputError on a tet_*
// model.

/// A law with the parameters that it takes.
struct Membrane {
  MembraneLaw law;
  SheetLame lame;
};
Membrane membrane_of(data::Constitutive constitutive, const SheetLame& lame);

/// Whether a Hessian is exact or has its negative eigenvalues set to zero.
enum class Curvature { exact, positive };

/// Energy Psi per rest area [N/m], stress P = dPsi/dF (first Piola-Kirchhoff) and (unless null) the Hessian
/// d vec(P) / d vec(F), from one singular value decomposition. The exact Hessian is undefined at s2 = 0 for
/// tri_neohookean; the positive one is semi-definite at every F. The eigenvectors of an isotropic energy are
/// known from the singular vectors of F (Smith, de Goes, Kim 2019, "Analytic eigensystems for isotropic
/// distortion energies", sec. 4): a 2 x 2 scaling block, twist, flip, and one rotation out of the plane for
/// each singular value.
void membrane_response(data::Constitutive constitutive, const Matrix32& F, const SheetLame& lame,
                       double& energy, Matrix32& stress, Matrix66* response_hessian,
                       Curvature curvature = Curvature::positive);

}  // namespace flash::sim
