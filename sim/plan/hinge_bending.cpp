#include "sim/plan/hinge_bending.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "sim/plan/edge.h"

namespace flash::sim {
namespace {

using Eigen::Vector3d;

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

/// How far a triangle of `area` takes part, and its derivative by the area [1/m^2].
struct Presence {
  double share = 1, slope = 0;
};
Presence presence_of(double area, double rest_area) {
  const double full = collapsed_share * rest_area, u = area / full;
  if (u >= 1) return {};
  return {u * u * u * (10 - 15 * u + 6 * u * u), 30 * u * u * (1 - u) * (1 - u) / full};
}

/// Adds `factor` times the gradient of the area of the triangle (first, second, third).
void add_area_gradient(const HingePositions& x, std::array<int, 3> triangle, double factor,
                       HingePositions& gradient) {
  const auto [a, b, c] = triangle;
  const Vector3d normal = (x.col(b) - x.col(a)).cross(x.col(c) - x.col(a)).normalized();
  gradient.col(a) += 0.5 * factor * normal.cross(x.col(c) - x.col(b));
  gradient.col(b) += 0.5 * factor * normal.cross(x.col(a) - x.col(c));
  gradient.col(c) += 0.5 * factor * normal.cross(x.col(b) - x.col(a));
}

/// Of the triangles (0, 1, 2) and (1, 0, 3).
std::array<Presence, 2> presences(const Hinge& hinge, const HingePositions& x) {
  return {presence_of(0.5 * left_normal(x).norm(), hinge.rest_areas[0]),
          presence_of(0.5 * right_normal(x).norm(), hinge.rest_areas[1])};
}

double deviation(const Hinge& hinge, const HingePositions& x) {
  return std::remainder(hinge_angle(x) - hinge.rest_angle, 2 * M_PI);
}

/// Of the triangles that bend [m^2]. Between two stiff ones nothing does, whatever the weight.
double bent_area(const Hinge& hinge) {
  const auto [left, right] = hinge.rest_areas;
  if (hinge.stiff[0] == hinge.stiff[1]) return left + right;
  return hinge.stiff[0] ? right : left;
}

}  // namespace

std::vector<Hinge> sheet_hinges(const Sheet& sheet) {
  std::vector<Hinge> hinges;
  for (const Edge& e : sheet_edges(sheet)) {
    if (e.right < 0) continue;
    Hinge hinge{{e.a, e.b, e.opposite_left, e.opposite_right},
                0.0,
                0.0,
                {sheet.triangles[e.left].area, sheet.triangles[e.right].area},
                {sheet.triangles[e.left].stiff, sheet.triangles[e.right].stiff}};
    HingePositions x;
    for (int i = 0; i < 4; ++i) x.col(i) = sheet.rest.vertices.row(hinge.vertices[i]);
    hinge.weight = (x.col(1) - x.col(0)).squaredNorm() / bent_area(hinge);
    hinge.rest_angle = hinge_angle(x);
    hinges.push_back(hinge);
  }
  return hinges;
}

double hinge_angle(const HingePositions& x) {
  const Vector3d left = left_normal(x), right = right_normal(x);
  return std::atan2(left.cross(right).dot((x.col(1) - x.col(0)).normalized()), left.dot(right));
}

void hinge_response(const Hinge& hinge, const HingePositions& x, double& energy, HingePositions& gradient,
                    Matrix12* hessian, double yield_angle) {
  const auto [left, right] = presences(hinge, x);
  const double weight = left.share * right.share * hinge.weight;
  energy = 0;
  gradient.setZero();
  if (hessian) hessian->setZero();
  if (weight == 0) return;
  const double angle = deviation(hinge, x), bent = std::clamp(angle, -yield_angle, yield_angle);
  const bool yields = bent != angle;
  const HingePositions g = angle_gradient(x);
  energy = yields ? weight * bent * (angle - 0.5 * bent) : 0.5 * weight * angle * angle;
  gradient = weight * bent * g;
  const double energy_of_angle =
      yields ? hinge.weight * bent * (angle - 0.5 * bent) : 0.5 * hinge.weight * angle * angle;
  if (left.slope > 0) add_area_gradient(x, {0, 1, 2}, energy_of_angle * left.slope * right.share, gradient);
  if (right.slope > 0) add_area_gradient(x, {1, 0, 3}, energy_of_angle * left.share * right.slope, gradient);
  if (hessian && !yields) {
    const Eigen::Map<const Eigen::Matrix<double, 12, 1>> flat(g.data());
    hessian->noalias() = weight * flat * flat.transpose();
  }
}

double yield_angle(const Hinge& hinge, double yield_curvature) {
  return yield_curvature * std::sqrt(bent_area(hinge) / hinge.weight);
}

double flow_of(const Hinge& hinge, const HingePositions& x, double yield_angle) {
  const auto [left, right] = presences(hinge, x);
  if (left.share * right.share == 0) return 0;
  const double angle = deviation(hinge, x);
  return angle - std::clamp(angle, -yield_angle, yield_angle);
}

}  // namespace flash::sim
