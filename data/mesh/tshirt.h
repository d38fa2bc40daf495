#pragma once
#include "data/mesh/mesh.h"

namespace flash::data {

/// A T-shirt that lies flat: two layers of one outline, sewn along the sides, the sleeves and the shoulders.
/// Hem, cuffs and neck are open. The middle of the hem is at the origin, y points to the neck, the front up.
struct TshirtMesh {
  double width = 0.48;          ///< from side to side [m]
  double length = 0.64;         ///< from the hem to the side of the neck [m]
  double sleeve = 0.17;         ///< from the side to the cuff [m]
  double armhole = 0.2;         ///< height of a sleeve [m]
  double sleeve_slope = 0.4;    ///< by which a sleeve falls on the way outwards
  double shoulder_drop = 0.03;  ///< of the shoulder between the neck and the sleeve [m]
  double neck = 0.18;           ///< width of the neck [m]
  double neck_depth = 0.07;     ///< of its front; its back is a third as deep [m]
  double apart = 1.1e-3;        ///< distance of the layers; seams lie half-way [m]
  double cell = 0.014;          ///< edge length that is wanted [m]; at most a quarter of the sleeve
};

/// Triangles face outwards. A seam has one row of vertices, which both layers share. Throws data::InputError
/// where a size is not above zero or the cell is too large.
TriangleMesh tshirt(const TshirtMesh& settings = {});

}  // namespace flash::data
