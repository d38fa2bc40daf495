#include "sim/step/rigid_turn.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>

namespace flash::sim {

using data::Points;
using Eigen::Matrix3d;
using Eigen::Vector3d;

RigidTurn::RigidTurn(const Eigen::VectorXd& mass, const Points& from, const Points& to) : mass_(mass) {
  const Eigen::RowVector3d from_centre = mass.transpose() * from / mass.sum(),
                           to_centre = mass.transpose() * to / mass.sum();
  const Points centred = from.rowwise() - from_centre;
  const Matrix3d moments = (to.rowwise() - to_centre).transpose() * mass.asDiagonal() * centred;
  const Eigen::JacobiSVD<Matrix3d> svd(moments, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Vector3d signs(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1);
  rotation_ = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
  turned_ = centred * rotation_.transpose();
  // (tr S - S) w = sum_i m_i turned_i x d(to_i), with S = moments R^T symmetric.
  const Matrix3d S =
      svd.matrixU() * signs.cwiseProduct(svd.singularValues()).asDiagonal() * svd.matrixU().transpose();
  inverse_inertia_ = (S.trace() * Matrix3d::Identity() - S).inverse();
}

Points RigidTurn::gradient(const Vector3d& torque) const {
  const Vector3d w = inverse_inertia_ * torque;
  Points gradient(turned_.rows(), 3);
  for (Eigen::Index i = 0; i < turned_.rows(); ++i)
    gradient.row(i) = mass_[i] * w.cross(turned_.row(i).transpose()).transpose();
  return gradient;
}

}  // namespace flash::sim
