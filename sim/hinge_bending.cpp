#include "sim/hinge_bending.h"

#include <Eigen/Geometry>
#include <cmath>

#include "sim/edge.h"

namespace flash::sim {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

Matrix3d cross_matrix(const Vector3d& a) {
  Matrix3d A;
  A << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
  return A;
}

// Normals (twice the area long) of the triangles (0, 1, 2) and (1, 0, 3).
Vector3d left_normal(const HingePositions& x) { return (x.col(1) - x.col(0)).cross(x.col(2) - x.col(0)); }
Vector3d right_normal(const HingePositions& x) { return (x.col(0) - x.col(1)).cross(x.col(3) - x.col(1)); }

// One triangle's part of dtheta: with e = x1 - x0, opposite vertex c, q = m/|m|^2 of its normal m,
//   dtheta/dx0 = ((c - x1).e/|e|) q,  dtheta/dx1 = -((c - x0).e/|e|) q,  dtheta/dc = |e| q
// up to the overall sign. The parts of both triangles add up.
struct Part {
  Vector3d e, to_c0, to_c1, q;
  double length;
};

Part part(const HingePositions& x, int opposite, const Vector3d& normal) {
  const Vector3d e = x.col(1) - x.col(0);
  return {e, x.col(opposite) - x.col(0), x.col(opposite) - x.col(1), normal / normal.squaredNorm(), e.norm()};
}

HingePositions angle_gradient(const HingePositions& x) {
  HingePositions g = HingePositions::Zero();
  for (int opposite : {2, 3}) {
    const Part p = part(x, opposite, opposite == 2 ? left_normal(x) : right_normal(x));
    g.col(0) -= p.to_c1.dot(p.e) / p.length * p.q;
    g.col(1) += p.to_c0.dot(p.e) / p.length * p.q;
    g.col(opposite) -= p.length * p.q;
  }
  return g;
}

Matrix12 angle_hessian(const HingePositions& x) {
  Matrix12 H = Matrix12::Zero();
  for (int opposite : {2, 3}) {
    const Vector3d normal = opposite == 2 ? left_normal(x) : right_normal(x);
    const Part p = part(x, opposite, normal);
    // dq = (I - 2 m m^T/|m|^2)/|m|^2 dm; the right normal is the left one of (1, 0, 3).
    const Matrix3d dq_dm = (Matrix3d::Identity() - 2 * normal * normal.transpose() / normal.squaredNorm()) /
                           normal.squaredNorm();
    const double turn = opposite == 2 ? 1.0 : -1.0;  // m = turn * (x1 - x0) x (c - x0)
    const Matrix3d dm[3] = {turn * cross_matrix(p.to_c1), -turn * cross_matrix(p.to_c0),
                            turn * cross_matrix(p.e)};
    const Vector3d direction = p.e / p.length;
    // Derivatives of the scalars (c - x1).e/|e|, (c - x0).e/|e| and |e| by x0, x1, c.
    const Vector3d normal1 = (p.to_c1 - p.to_c1.dot(direction) * direction) / p.length;
    const Vector3d normal0 = (p.to_c0 - p.to_c0.dot(direction) * direction) / p.length;
    const Vector3d ds1[3] = {-normal1, normal1 - direction, direction};
    const Vector3d ds0[3] = {-normal0 - direction, normal0, direction};
    const Vector3d dlength[3] = {-direction, direction, Vector3d::Zero()};
    const int block[3] = {0, 1, opposite};
    for (int j = 0; j < 3; ++j) {
      const Matrix3d dq = dq_dm * dm[j];
      const int column = 3 * block[j];
      H.block<3, 3>(0, column) -= p.to_c1.dot(direction) * dq + p.q * ds1[j].transpose();
      H.block<3, 3>(3, column) += p.to_c0.dot(direction) * dq + p.q * ds0[j].transpose();
      H.block<3, 3>(3 * opposite, column) -= p.length * dq + p.q * dlength[j].transpose();
    }
  }
  return 0.5 * (H + H.transpose());
}

double deviation(const Hinge& hinge, const HingePositions& x) {
  return std::remainder(hinge_angle(x) - hinge.rest_angle, 2 * M_PI);
}

}  // namespace

std::vector<Hinge> sheet_hinges(const Sheet& sheet) {
  std::vector<Hinge> hinges;
  for (const Edge& e : sheet_edges(sheet)) {
    if (e.right < 0) continue;
    Hinge hinge{{e.a, e.b, e.opposite_left, e.opposite_right}, 0.0, 0.0};
    HingePositions x;
    for (int i = 0; i < 4; ++i) x.col(i) = sheet.rest.vertices.row(hinge.vertices[i]);
    hinge.weight =
        (x.col(1) - x.col(0)).squaredNorm() / (sheet.triangles[e.left].area + sheet.triangles[e.right].area);
    hinge.rest_angle = hinge_angle(x);
    hinges.push_back(hinge);
  }
  return hinges;
}

double hinge_angle(const HingePositions& x) {
  const Vector3d left = left_normal(x), right = right_normal(x);
  return std::atan2(left.cross(right).dot((x.col(1) - x.col(0)).normalized()), left.dot(right));
}

double hinge_energy(const Hinge& hinge, const HingePositions& x) {
  const double angle = deviation(hinge, x);
  return 0.5 * hinge.weight * angle * angle;
}

HingePositions hinge_gradient(const Hinge& hinge, const HingePositions& x) {
  return hinge.weight * deviation(hinge, x) * angle_gradient(x);
}

Matrix12 hinge_hessian(const Hinge& hinge, const HingePositions& x) {
  const HingePositions g = angle_gradient(x);
  const Eigen::Map<const Eigen::Matrix<double, 12, 1>> flat(g.data());
  return hinge.weight * (flat * flat.transpose() + deviation(hinge, x) * angle_hessian(x));
}

void hinge_response(const Hinge& hinge, const HingePositions& x, double& energy, HingePositions& gradient,
                    Matrix12* hessian) {
  const double angle = deviation(hinge, x);
  const HingePositions g = angle_gradient(x);
  energy = 0.5 * hinge.weight * angle * angle;
  gradient = hinge.weight * angle * g;
  if (hessian) {
    const Eigen::Map<const Eigen::Matrix<double, 12, 1>> flat(g.data());
    hessian->noalias() = hinge.weight * flat * flat.transpose();
  }
}

}  // namespace flash::sim
