#pragma once
#include <algorithm>
#include <limits>

namespace flash::data {

enum class Constitutive {
  tri_arap,
  tri_corotated,
  tri_stvk,
  tri_neohookean,
  tet_arap,
  tet_corotated,
  tet_neohookean,
  tet_neohookean_log
};

/// How curvature is measured; `plate` (Morley) gives D and nu on any flat mesh, the others are for parity.
enum class BendingModel { plate, isometric, hinge };

/// How a woven sheet stretches and bends along its warp, its weft and between. Isotropic by default.
struct Weave {
  double bending_ratio = 1.0;   ///< D_2 / D_1, weft over warp
  double twisting_ratio = 1.0;  ///< D_66 over that of Huber's plate, (1 - nu) / 2 sqrt(D_1 D_2)
  double warp_direction =
      0.0;  ///< from the x axis of the rest shape, counter-clockwise seen from its normals [rad]
  double young_ratio = 1.0;  ///< E_2 / E_1, weft over warp
  double shear_ratio = 1.0;  ///< G over sqrt(E_1 E_2) / (2 (1 + nu)), with nu^2 = nu_12 nu_21

  bool operator==(const Weave&) const = default;

  bool is_of_bending() const { return bending_ratio != 1 || twisting_ratio != 1; }
  bool is_of_membrane() const { return young_ratio != 1 || shear_ratio != 1; }
  /// What bending knows of it.
  Weave of_bending() const {
    return is_of_bending() ? Weave{bending_ratio, twisting_ratio, warp_direction} : Weave{};
  }
};

/// A thin sheet as the simulation sees it. Motion depends on E t / rho_A, D / rho_A, nu and friction only.
struct SheetMaterial {
  Constitutive constitutive = Constitutive::tri_corotated;
  BendingModel bending_model = BendingModel::plate;
  double membrane_stiffness = 100.0;  ///< E t, of a woven sheet E_1 t, along its warp [N/m]
  double poissons_ratio = 0.3;        ///< in (-1, 1/2]; of a woven sheet sqrt(nu_12 nu_21)
  double areal_density = 0.2;         ///< rho_A [kg/m^2]
  double bending_rigidity = 1e-5;     ///< D, of a woven sheet D_1, along its warp [N m]
  double friction = 0.3;              ///< Coulomb coefficient against the table
  double air_drag = 0.0;              ///< mass-proportional damping [1/s]
  double stiffness_damping = 0.0;     ///< Rayleigh, stiffness-proportional [s]
  Weave weave = {};                   ///< in bending `plate` alone, in the membrane tri_stvk alone
  double yield_curvature =
      std::numeric_limits<double>::infinity();  ///< at which bending begins to yield; `hinge` alone [1/m]

  bool operator==(const SheetMaterial&) const = default;

  /// E t along warp or weft, the larger [N/m].
  double largest_stiffness() const { return membrane_stiffness * std::max(1.0, weave.young_ratio); }
};

/// A body of tetrahedra as the simulation sees it.
struct SolidMaterial {
  Constitutive constitutive = Constitutive::tet_neohookean;
  double youngs_modulus = 1e5;     ///< E at small strains [Pa]
  double poissons_ratio = 0.3;     ///< at small strains, in (-1, 1/2)
  double density = 1000.0;         ///< [kg/m^3]
  double friction = 0.3;           ///< Coulomb coefficient against the table
  double air_drag = 0.0;           ///< mass-proportional damping [1/s]
  double stiffness_damping = 0.0;  ///< Rayleigh, stiffness-proportional [s]

  bool operator==(const SolidMaterial&) const = default;
};

}  // namespace flash::data
