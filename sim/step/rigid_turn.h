#pragma once
#include <Eigen/Core>

#include "data/mesh/mesh.h"

namespace flash::sim {

/// The rotation R that takes `from` nearest to `to`, both about their centres: the minimum of
/// sum_i m_i |R (from_i - c_from) - (to_i - c_to)|^2 (Kabsch 1976), and what is needed for its derivative.
class RigidTurn {
 public:
  RigidTurn(const Eigen::VectorXd& mass, const data::Points& from, const data::Points& to);

  const Eigen::Matrix3d& rotation() const { return rotation_; }

  /// R (from_i - c_from), one row a point.
  const data::Points& turned() const { return turned_; }

  /// Gradient by `to` of a function of R alone that changes by torque . w when R turns by the small rotation
  /// vector w. Its rows sum to zero.
  data::Points gradient(const Eigen::Vector3d& torque) const;

 private:
  Eigen::VectorXd mass_;
  Eigen::Matrix3d rotation_, inverse_inertia_;
  data::Points turned_;
};

}  // namespace flash::sim
