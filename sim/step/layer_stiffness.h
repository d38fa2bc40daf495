#pragma once
#include <Eigen/Core>

#include "sim/law/membrane.h"
#include "sim/step/layer_contact.h"

namespace flash::sim {

/// The Hessian of the pressure of a touch by its four vertices, x, y and z of one after the other [N/m]. It
/// includes how the normal and the nearest points turn. Exact but for the twist of edges that are nearly
/// parallel, which it has by Gauss and Newton. `positive`: its nearest positive semidefinite matrix.
Eigen::Matrix<double, 12, 12> pressure_stiffness(const LayerTouch& touch, const data::Points& positions,
                                                 Curvature curvature);

}  // namespace flash::sim
