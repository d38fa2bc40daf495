#pragma once
#include "data/mesh/mesh.h"

namespace flash::data {

/// Shorts that lie flat: two layers of one outline, sewn along the sides, the inner seams and the crotch. The
/// waist and both hems are open. The middle between the hems is at the origin, y points to the waist, the
/// front up.
struct ShortsMesh {
  double leg = 0.2;         ///< width of a leg [m]
  double length = 0.46;     ///< from the hem to the waist [m]
  double rise = 0.28;       ///< from the crotch to the waist [m]
  double splay = 0.15;      ///< by which a leg goes outwards on the way down
  double waist_dip = 0.02;  ///< of the front in the middle [m]; that of the back is a third as deep
  double apart = 1.1e-3;    ///< distance of the layers; seams lie half-way [m]
  double cell = 0.014;      ///< edge length that is wanted [m]; at most a quarter of a leg
};

/// As tshirt. Between the legs are two cells. Throws data::InputError where a size is not above zero or the
/// cell is too large.
TriangleMesh shorts(const ShortsMesh& settings = {});

}  // namespace flash::data
