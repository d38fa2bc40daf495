#pragma once
#include <Eigen/Core>

#include "data/asset/material.h"

namespace flash::sim {

/// Plane stress of a sheet that may be woven: second Piola-Kirchhoff stress (S_11, S_22, S_12) of Green's
/// strain (E_11, E_22, 2 E_12). Along warp and weft, with r = young_ratio and q = shear_ratio,
///
///   E_1 t / (1 - nu^2) [1, nu sqrt(r), 0; nu sqrt(r), r, 0; 0, 0, (1 - nu) / 2 q sqrt(r)] [N/m],
///
/// so that nu_12 = nu / sqrt(r), nu_21 = nu sqrt(r), and all is positive for |nu| < 1.
class SheetStiffness {
 public:
  /// Throws data::InputError unless E t > 0 and -1 < nu < 1. Of tri_arap lambda is 0.
  explicit SheetStiffness(const data::SheetMaterial& material);

  SheetStiffness operator*(double factor) const;

  /// The matrix in axes of which `x_axis` is the base frame's x.
  Eigen::Matrix3d in(const Eigen::Vector2d& x_axis) const;

 private:
  Eigen::Matrix3d along_warp_;
  Eigen::Vector2d warp_;  ///< from the base frame's x axis
  bool turns_;            ///< whether it depends on the axes
};

}  // namespace flash::sim
