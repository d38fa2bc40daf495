#pragma once
#include <Eigen/Core>
#include <array>
#include <vector>

#include "data/mesh.h"
#include "sim/sheet.h"

namespace flash::sim {

/// Two triangles over a common edge. Vertices 0 and 1 are the edge, 2 and 3 opposite; triangle (0, 1, 2) runs
/// as the mesh does.
struct Hinge {
  std::array<int, 4> vertices;
  double weight;      ///< |e|^2 / (A_0 + A_1) of the rest shape
  double rest_angle;  ///< dihedral angle of the rest shape, 0 where flat [rad]
};

/// Hinges of the interior edges, with the rest angles of sheet.rest.
std::vector<Hinge> sheet_hinges(const Sheet& sheet);

/// Columns are the positions of the four vertices of a hinge [m].
using HingePositions = Eigen::Matrix<double, 3, 4>;
using Matrix12 = Eigen::Matrix<double, 12, 12>;

/// Signed angle between the normals in (-pi, pi], positive where the edge is a ridge seen from the normal
/// side.
double hinge_angle(const HingePositions& x);

/// Energy 1/2 weight (theta - rest_angle)^2 for D = 1, the difference taken the short way round
/// (Grinspun et al. 2003, "Discrete shells"; derivatives after Tamstorf, Grinspun 2013).
double hinge_energy(const Hinge& hinge, const HingePositions& x);

/// Gradient by the four positions.
HingePositions hinge_gradient(const Hinge& hinge, const HingePositions& x);

/// Exact Hessian by the stacked positions (vertex 0, 1, 2, 3); indefinite away from the rest angle.
Matrix12 hinge_hessian(const Hinge& hinge, const HingePositions& x);

/// Energy, gradient and (unless null) the Gauss-Newton Hessian weight (dtheta)(dtheta)^T: positive
/// semi-definite, exact at the rest angle.
void hinge_response(const Hinge& hinge, const HingePositions& x, double& energy, HingePositions& gradient,
                    Matrix12* hessian);

}  // namespace flash::sim
