#pragma once
#include <Eigen/Core>
#include <vector>

#include "sim/scene/environment.h"

namespace flash::sim {

/// The spring between a vertex and its place in a soft hold over one step. Pads of fingers press on a sheet
/// as a Winkler foundation: each vertex has the foundation's modulus [N/m^3] times the area of pad that it
/// carries [m^2]. The energy k |x - p|^2 / 2, with the place p at the end of the step, is part of its
/// incremental potential.
struct Spring {
  int vertex, hold;
  int entry;               ///< which of the hold's vertices it is
  double stiffness;        ///< k [N/m]
  Eigen::Array3d acts;     ///< 1 along the axes in which it acts, 0 where a hold carries the vertex rigidly
  Eigen::Vector3d before;  ///< its place at the start of the step [m]
  Eigen::Vector3d place;   ///< p [m]

  /// On the vertex at x [N].
  Eigen::Vector3d force(const Eigen::Vector3d& x) const {
    return (stiffness * acts * (place - x).array()).matrix();
  }
  /// With the vertex at x [J].
  double energy(const Eigen::Vector3d& x) const { return 0.5 * force(x).dot(place - x); }
};

/// The springs of the closed holds of an environment over the step that ends at `time` [s].
std::vector<Spring> springs_of(const Environment& environment, double time);

/// The first hold that has a stiffness; null where all are rigid.
const Hold* first_soft_hold(const Environment& environment);

}  // namespace flash::sim
