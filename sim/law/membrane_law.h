#pragma once

namespace flash::sim {

/// Plane-stress Lame parameters of a thin sheet, force per length.
struct SheetLame {
  double mu;      ///< shear modulus times thickness [N/m]
  double lambda;  ///< first parameter, plane stress, times thickness [N/m]
};

/// Laws of a membrane, as in sim/law/membrane.h; tri_arap is `corotated` with lambda = 0.
enum class MembraneLaw { corotated, saint_venant_kirchhoff, neo_hookean };

}  // namespace flash::sim
