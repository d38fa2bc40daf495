#pragma once
#include <Eigen/Core>
#include <array>
#include <limits>
#include <vector>

#include "data/mesh/mesh.h"
#include "sim/law/membrane_law.h"
#include "sim/scene/sheet.h"

namespace flash::sim {

/// Two triangles over a common edge. Vertices 0 and 1 are the edge, 2 and 3 opposite; triangle (0, 1, 2) runs
/// as the mesh does.
struct Hinge {
  std::array<int, 4> vertices;
  double weight;      ///< |e|^2 / (A_0 + A_1) of the rest shape; beside a stiff one of the other's area
  double rest_angle;  ///< dihedral angle without moment, 0 where flat [rad]
  std::array<double, 2> rest_areas;  ///< of triangles (0, 1, 2) and (1, 0, 3) [m^2]
  std::array<bool, 2> stiff = {};    ///< of them: one that is leaves all bending to the other
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
///
/// Beyond `yield_angle` from the rest angle the moment stays what it is there (elastic, perfectly plastic),
/// and the energy grows linearly with the angle: what is stored and what flows, together. So a step in which
/// hinges yield is a minimization still (the incremental potential of Ortiz, Stainier 1999). A hinge that
/// yields has no Hessian.
void hinge_response(const Hinge& hinge, const HingePositions& x, double& energy, HingePositions& gradient,
                    Matrix12* hessian, double yield_angle = std::numeric_limits<double>::infinity());

/// The angle from rest at which a hinge bends by `yield_curvature` [1/m]: that times (A_0 + A_1) / |e|, as
/// its energy is that of the curvature angle |e| / (A_0 + A_1) over its two triangles (over one, where the
/// other is stiff).
double yield_angle(const Hinge& hinge, double yield_curvature);

/// How far the rest angle flows at the end of a step, so that the hinge is bent by `yield_angle` at most
/// [rad].
double flow_of(const Hinge& hinge, const HingePositions& x, double yield_angle);

}  // namespace flash::sim
