#include "sim/scene/grasp.h"

#include <Eigen/Geometry>

namespace flash::sim {

using data::Points;
using Eigen::Vector3d;

Vector3d towards_middle(const Points& positions, const std::vector<int>& patch, const Vector3d& up) {
  Eigen::RowVector3d centre = Eigen::RowVector3d::Zero();
  for (const int vertex : patch) centre += positions.row(vertex);
  centre /= static_cast<double>(patch.size());
  Vector3d direction = (positions.colwise().mean() - centre).transpose();
  direction -= direction.dot(up) * up;
  return direction.norm() > 1e-9 ? Vector3d(direction.normalized()) : up.unitOrthogonal();
}

Points pinch_targets(const Points& flat, const Vector3d& ridge, const Vector3d& up, double pitch,
                     double apart) {
  const Vector3d centre = flat.colwise().mean();
  const Vector3d across = up.cross(ridge).normalized();
  const Vector3d along = across.cross(up);
  const Eigen::VectorXd b = (flat.rowwise() - centre.transpose()) * across;
  const Eigen::VectorXd aside = b.cwiseMin(0.5 * apart).cwiseMax(-0.5 * apart), down = (b - aside).cwiseAbs();
  const double height = down.maxCoeff();
  const Eigen::Matrix3d tilt = Eigen::AngleAxisd(pitch, across).toRotationMatrix();
  Points targets(flat.rows(), 3);
  for (Eigen::Index i = 0; i < flat.rows(); ++i) {
    const double a = (flat.row(i).transpose() - centre).dot(along);
    targets.row(i) = (centre + tilt * (a * along + aside[i] * across + (height - down[i]) * up)).transpose();
  }
  return targets;
}

void raise_above(const Vector3d& point, const Vector3d& normal, Points& targets) {
  const double deepest = ((targets.rowwise() - point.transpose()) * normal).minCoeff();
  if (deepest < 0) targets.rowwise() -= deepest * normal.transpose();
}

}  // namespace flash::sim
