#pragma once
#include "sim/law/vector3.h"

namespace flash::sim {

/// Where a moving surface is nearest to a point.
struct SurfaceFoot {
  double distance = 0;          ///< [m]
  Vector3<double> direction{};  ///< unit, from the foot to the point; on the surface its normal
  double speed = 0;             ///< of the surface at the foot, along the direction [m/s]
};

}  // namespace flash::sim
