#pragma once
#include "sim/law/membrane_law.h"

namespace flash::sim::cuda {

/// What the matrix of an environment depends on besides positions.
struct EnvironmentNumbers {
  MembraneLaw law = MembraneLaw::corotated;
  SheetLame lame{};
  double rigidity = 0;         ///< D [N m]
  double inertia_density = 0;  ///< areal density over h^2 [kg/m^2/s^2]
};

/// How the numbers of a factor are stored. Half of them cost less to read, and change a preconditioner alone.
enum class FactorPrecision { single, half };

/// A vertex that may not move in every direction, by its place in the elimination.
struct VertexRestriction {
  int place;
  float free[9];        ///< projector on what it may do, column-major
  float correction[3];  ///< its move in the other directions [m]
};

struct ElasticEnergies {
  double membrane, bending;  ///< [J]
};

}  // namespace flash::sim::cuda
