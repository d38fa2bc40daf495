#pragma once
#include <Eigen/Core>
#include <array>
#include <vector>

#include "data/mesh.h"
#include "sim/law/membrane_law.h"
#include "sim/scene/sheet.h"

namespace flash::sim {

/// Two triangles over a common edge. Vertices 0 and 1 are the edge, 2 and 3 opposite; triangle (0, 1, 2) runs
/// as the mesh does.
struct Hinge {
  std::array<int, 4> vertices;
  double weight;                     ///< |e|^2 / (A_0 + A_1) of the rest shape
  double rest_angle;                 ///< dihedral angle of the rest shape, 0 where flat [rad]
  std::array<double, 2> rest_areas;  ///< of triangles (0, 1, 2) and (1, 0, 3) [m^2]
};

/// Hinges of the interior edges, with the rest angles of sheet.rest.
std::vector<Hinge> sheet_hinges(const Sheet& sheet);

/// Columns are the positions of the four vertices of a hinge [m].
using HingePositions = Eigen::Matrix<double, 3, 4>;
using Matrix12 = Eigen::Matrix<double, 12, 12>;

/// Signed angle between the normals in (-pi, pi], positive where the edge is a ridge seen from the normal
/// side.
double hinge_angle(const HingePositions& x);

/// Energy 1/2 s_0 s_1 weight (theta - rest_angle)^2 for D = 1, the difference taken the short way round, and
/// its gradient by the four positions (Grinspun et al. 2003, "Discrete shells"; Tamstorf, Grinspun 2013). The
/// Hessian by the stacked positions (unless null) is Gauss-Newton's, s_0 s_1 weight (dtheta)(dtheta)^T:
/// positive semi-definite, exact at the rest angle. A triangle without area has no normal, so that the force
/// of the angle alone would grow without bound. So s = u^3 (10 - 15 u + 6 u^2) at u = area / (collapsed_share
/// rest area) takes it out smoothly; s is 1 for u >= 1.
void hinge_response(const Hinge& hinge, const HingePositions& x, double& energy, HingePositions& gradient,
                    Matrix12* hessian);

}  // namespace flash::sim
