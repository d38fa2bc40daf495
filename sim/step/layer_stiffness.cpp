#include "sim/step/layer_stiffness.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include "sim/law/edge_crossing.h"
#include "sim/step/moving_obstacles.h"

namespace flash::sim {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Matrix12 = Eigen::Matrix<double, 12, 12>;
using Vector12 = Eigen::Matrix<double, 12, 1>;

Vector12 spread(const double* weights, const Vector3<double>& v) {
  Vector12 all;
  for (int i = 0; i < 4; ++i) all.segment<3>(3L * i) << weights[i] * v.x, weights[i] * v.y, weights[i] * v.z;
  return all;
}

/// Adds that of the distance times -force (PairTurns).
void add_turns(const LayerTouch& touch, const Vector3<double>* x, double force, Matrix12& hessian) {
  const NearestPoints& nearest = touch.nearest;
  const PairTurns turns = turns_of(touch.kind, x, nearest);
  Matrix3d across = Matrix3d::Identity() - vector3d(nearest.normal) * vector3d(nearest.normal).transpose();
  for (int a = 0; a < turns.count; ++a) {
    const Vector12 between = spread(nearest.weights, turns.along[a]),
                   turn = spread(turns.turns[a], nearest.normal);
    hessian += force * (between * turn.transpose() + turn * between.transpose() +
                        nearest.distance * turn * turn.transpose());
    across -= vector3d(turns.along[a]) * vector3d(turns.along[a]).transpose();
  }
  if (turns.count == 2) return;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j)
      hessian.block<3, 3>(3L * i, 3L * j) -=
          force / nearest.distance * nearest.weights[i] * nearest.weights[j] * across;
}

/// Adds that of the crossing of edges that are nearly parallel.
void add_crossing(const LayerTouch& touch, const Vector3<double>* x, const Crossing& crossing,
                  const Vector12& toward, Matrix12& hessian) {
  const double energy = touch.area * touch.response.energy, force = touch.area * touch.response.force;
  constexpr double first[4] = {-1, 1, 0, 0}, second[4] = {0, 0, -1, 1};
  const Vector12 slope = spread(first, crossing.by_first) + spread(second, crossing.by_second);
  hessian -= force * (slope * toward.transpose() + toward * slope.transpose());
  // The squared sine is that of the cross product of the edges' directions.
  const Vector3d u = vector3d(x[1] - x[0]), v = vector3d(x[3] - x[2]), a = u.normalized(), b = v.normalized();
  const auto cross_matrix = [](const Vector3d& w) {
    Matrix3d m;
    m << 0, -w.z(), w.y(), w.z(), 0, -w.x(), -w.y(), w.x(), 0;
    return m;
  };
  const Matrix3d by_u = -cross_matrix(b) * (Matrix3d::Identity() - a * a.transpose()) / u.norm(),
                 by_v = cross_matrix(a) * (Matrix3d::Identity() - b * b.transpose()) / v.norm();
  Eigen::Matrix<double, 3, 12> sine;
  sine << -by_u, by_u, -by_v, by_v;
  const Vector12 by_q = 2 / crossing_squared_sine * sine.transpose() * a.cross(b);
  hessian += energy * (2 * crossing.slope / crossing_squared_sine * sine.transpose() * sine -
                       2 * by_q * by_q.transpose());
}

}  // namespace

Eigen::Matrix<double, 12, 12> pressure_stiffness(const LayerTouch& touch, const data::Points& positions,
                                                 Curvature curvature) {
  Vector3<double> x[4];
  for (int k = 0; k < 4; ++k) x[k] = vector3(positions, touch.vertices[k]);
  const Vector12 toward = spread(touch.nearest.weights, touch.nearest.normal);
  Matrix12 hessian = touch.area * touch.crossing * touch.response.stiffness * toward * toward.transpose();
  add_turns(touch, x, touch.normal_force, hessian);
  if (touch.crossing < 1) add_crossing(touch, x, crossing_of(x), toward, hessian);
  if (curvature == Curvature::exact) return hessian;
  Eigen::SelfAdjointEigenSolver<Matrix12> eigen(hessian);
  return eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).asDiagonal() *
         eigen.eigenvectors().transpose();
}

}  // namespace flash::sim
