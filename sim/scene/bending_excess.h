#pragma once
#include "data/asset/asset.h"
#include "sim/scene/sheet.h"

namespace flash::sim {

/// By what share the mesh of a solid is stiffer in pure bending than its material, at most: the energy of
/// linear tetrahedra whose vertices move as the exact solution does,
///   u = k (-x z, nu y z, (x^2 + nu (z^2 - y^2)) / 2),
/// over the exact one, E k^2 / 2 times the integral of z^2, less 1 (Timoshenko and Goodier, Theory of
/// Elasticity, art. 102). The true share is smaller, as the mesh is free to take less energy: by little up to
/// nu = 0.4, by much near 1/2. x runs along the longest principal axis of the body at rest, z along the
/// shortest. TET_ARAP has nu = 0. Quadratic elements have that solution among theirs: 0.
double bending_excess(const Sheet& sheet, const Body& body, data::Constitutive constitutive,
                      double poissons_ratio);

/// Of a body at rest, its length over its thickness: the square root of its largest second moment over its
/// least.
double slenderness(const Sheet& sheet, const Body& body);

}  // namespace flash::sim
