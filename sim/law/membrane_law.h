#pragma once

namespace flash::sim {

/// Plane-stress Lame parameters of a thin sheet, force per length.
struct SheetLame {
  double mu;      ///< shear modulus times thickness [N/m]
  double lambda;  ///< first parameter, plane stress, times thickness [N/m]
};

/// Share of its rest area below which a triangle counts as collapsed: laws that have a kink where it becomes
/// a line are smooth from there.
inline constexpr double collapsed_share = 0.1;

/// Laws of a membrane, as in sim/law/membrane.h; tri_arap is `corotated` with lambda = 0.
enum class MembraneLaw { corotated, saint_venant_kirchhoff, neo_hookean };

}  // namespace flash::sim
