#pragma once
#include "sim/law/host_device.h"
#include "sim/law/membrane_law.h"
#include "sim/law/symmetric3.h"

namespace flash::sim::cuda {

/// What the matrix of an environment depends on besides positions.
struct EnvironmentNumbers {
  MembraneLaw law = MembraneLaw::corotated;
  SheetLame lame{};
  double rigidity = 0;                ///< D [N m]
  double inertia_density = 0;         ///< areal density over h^2, and what air drag adds [kg/m^2/s^2]
  SheetLame damping{};                ///< moduli of the damped membrane times b / h
  double damping_share = 0;           ///< b / h
  const float* own_blocks = nullptr;  ///< added to the diagonal, nine numbers a vertex; null: nothing

  /// What the stiffness of bending enters the matrix with.
  FLASH_HOST_DEVICE double effective_rigidity() const { return rigidity * (1 + damping_share); }
};

/// How the numbers of a factor are stored: in half precision, which changes a preconditioner alone, or each
/// as the sum of two such numbers.
enum class FactorPrecision { single, half };

/// Strains and angles at the start of a step, for damping; null without.
struct StepStart {
  const double* metrics = nullptr;  ///< F^T F: three numbers a triangle, triangle_count apart
  const double* angles = nullptr;   ///< of hinges [rad]
};

/// A vertex that may not move in every direction, by its place in the elimination.
struct VertexRestriction {
  int place;
  float free[9];        ///< projector on what it may do, column-major
  float correction[3];  ///< its move in the other directions [m]
};

/// Restrictions of one environment, and which of them a vertex has.
struct Restrictions {
  const VertexRestriction* list = nullptr;
  int count = 0;
  const int* of_place = nullptr;  ///< by place, -1 for none; null where there are none
  /// The projectors of all vertices, so that a warp reads whole lines and looks nothing up: by place, their
  /// xx, xy, xz, yy, yz and zz, `size` apart. Null: they are those of the list.
  float* projectors = nullptr;
  int size = 0;

  /// Sets the projector of a place.
  FLASH_HOST_DEVICE void set_projector(int place, const Symmetric3& free) const {
    float* own = projectors + place;
    const long step = size;
    own[0] = static_cast<float>(free.xx);
    own[step] = static_cast<float>(free.xy);
    own[2 * step] = static_cast<float>(free.xz);
    own[3 * step] = static_cast<float>(free.yy);
    own[4 * step] = static_cast<float>(free.yz);
    own[5 * step] = static_cast<float>(free.zz);
  }
};

struct ElasticEnergies {
  double membrane, bending;  ///< [J]
  double damping;            ///< potential of damping over a step, turns apart [J]
};

}  // namespace flash::sim::cuda
