#include "sim/law/sheet_stiffness.h"

#include <cmath>

#include "sim/law/membrane.h"

namespace flash::sim {

SheetStiffness::SheetStiffness(const data::SheetMaterial& material)
    : warp_(std::cos(material.weave.warp_direction), std::sin(material.weave.warp_direction)),
      turns_(material.weave.is_of_membrane()) {
  const SheetLame lame = sheet_lame(material.membrane_stiffness, material.poissons_ratio);
  const double lambda = material.constitutive == data::Constitutive::tri_arap ? 0 : lame.lambda;
  const double weft = material.weave.young_ratio, mean = std::sqrt(weft), along = 2 * lame.mu + lambda;
  along_warp_ << along, mean * lambda, 0, mean * lambda, weft * along, 0, 0, 0,
      material.weave.shear_ratio * mean * lame.mu;
}

SheetStiffness SheetStiffness::operator*(double factor) const {
  SheetStiffness result = *this;
  result.along_warp_ *= factor;
  return result;
}

Eigen::Matrix3d SheetStiffness::in(const Eigen::Vector2d& x_axis) const {
  if (!turns_) return along_warp_;
  const double c = warp_.x() * x_axis.x() - warp_.y() * x_axis.y(),
               s = warp_.x() * x_axis.y() + warp_.y() * x_axis.x();
  Eigen::Matrix3d turn;  // strains along warp and weft from those in the axes
  turn << c * c, s * s, c * s, s * s, c * c, -c * s, -2 * c * s, 2 * c * s, c * c - s * s;
  return turn.transpose() * along_warp_ * turn;
}

}  // namespace flash::sim
