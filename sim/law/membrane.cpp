#include "sim/law/membrane.h"

#include <cmath>
#include <string>

#include "data/files/error.h"
#include "sim/law/membrane_response.h"

namespace flash::sim {
namespace {

Vector3<double> column(const Matrix32& F, int j) { return {F(0, j), F(1, j), F(2, j)}; }

Eigen::Vector3d eigen(const Vector3<double>& v) { return {v.x, v.y, v.z}; }

SingularFrame<double> frame_of(const Matrix32& F) { return singular_frame(column(F, 0), column(F, 1)); }

PrincipalResponse<double> principal(data::Constitutive constitutive, const SingularFrame<double>& frame,
                                    const SheetLame& lame) {
  const Membrane membrane = membrane_of(constitutive, lame);
  return with_membrane_law(membrane.law, [&](auto law) {
    return decltype(law)::at(frame.s1, frame.s2, membrane.lame.mu, membrane.lame.lambda);
  });
}

Matrix32 stress(const SingularFrame<double>& frame, const PrincipalResponse<double>& response) {
  const StressColumns<double> columns = stress_of(frame, response);
  Matrix32 P;
  P << eigen(columns.p1), eigen(columns.p2);
  return P;
}

Matrix66 hessian(const SingularFrame<double>& frame, const PrincipalResponse<double>& response) {
  const HessianBlocks<double> blocks = hessian_of(frame, response);
  Matrix66 H;
  for (int j = 0; j < 3; ++j) {
    H.col(j).head<3>() = eigen(blocks.h00[j]);
    H.col(j + 3).head<3>() = eigen(blocks.h01[j]);
    H.row(j + 3).head<3>() = eigen(blocks.h01[j]);
    H.col(j + 3).tail<3>() = eigen(blocks.h11[j]);
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

Membrane membrane_of(data::Constitutive constitutive, const SheetLame& lame) {
  switch (constitutive) {
    case data::Constitutive::tri_arap:
      return {MembraneLaw::corotated, {lame.mu, 0.0}};
    case data::Constitutive::tri_corotated:
      return {MembraneLaw::corotated, lame};
    case data::Constitutive::tri_stvk:
      return {MembraneLaw::saint_venant_kirchhoff, lame};
    case data::Constitutive::tri_neohookean:
      return {MembraneLaw::neo_hookean, lame};
    default:
      throw data::InputError(
          "constitutive: a sheet needs one of TRI_ARAP, TRI_COROTATED, TRI_STVK, TRI_NEOHOOKEAN");
  }
}

void membrane_response(data::Constitutive constitutive, const Matrix32& F, const SheetLame& lame,
                       double& energy, Matrix32& P, Matrix66* response_hessian, Curvature curvature) {
  const SingularFrame<double> frame = frame_of(F);
  PrincipalResponse<double> response = principal(constitutive, frame, lame);
  energy = response.energy;
  P = stress(frame, response);
  if (response_hessian) {
    if (curvature == Curvature::positive) clamp(response);
    *response_hessian = hessian(frame, response);
  }
}

}  // namespace flash::sim
