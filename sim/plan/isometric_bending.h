#pragma once
#include <Eigen/SparseCore>

#include "sim/scene/sheet.h"

namespace flash::sim {

/// Stiffness K (vertices x vertices, symmetric, D = 1, [1/m^2]) of the isometric bending energy
/// 1/2 D sum_e |sum_a K_ea x_a|^2 / (A_0 + A_1) = 1/2 D tr(x^T K x), e over interior edges, K_ea the
/// cotangent stencil of Bergou et al. 2006 ("A quadratic bending model for inextensible surfaces"), whose
/// literal energy is three times this one. Metric of the rest shape, flat natural state; free edges are
/// natural. Where one of the triangles is stiff, the other's area alone counts.
Eigen::SparseMatrix<double> isometric_bending_stiffness(const Sheet& sheet);

}  // namespace flash::sim
