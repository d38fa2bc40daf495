#pragma once
#include <vector>

#include "sim/oracle/constraint_newton.h"
#include "sim/oracle/projective_system.h"
#include "sim/scene/environment.h"

namespace flash::sim {

/// A vertex near an obstacle at the current iterate. The rows of its directions are (normal, tangent,
/// tangent).
struct ProjectiveContact {
  int vertex;
  int obstacle;
  Eigen::Matrix3d directions;  ///< rows, orthonormal
  Eigen::Vector3d gap;         ///< gap, and slip since the start of the step against the surface [m]
  double friction;
};

/// Contacts nearer than `reach` [m] (one a vertex), sorted by (vertex, obstacle). Vertices held along all
/// axes take no part, nor do contacts whose normal runs along held axes.
std::vector<ProjectiveContact> find_contacts(const Sheet& sheet, const Environment& environment, double time,
                                             double time_step, const data::Points& positions,
                                             const Eigen::VectorXd& reach,
                                             const std::vector<Eigen::Vector3d>& free_axes,
                                             double tangent_angle);

/// H^T lambda [N], vertices x 3.
data::Points contact_forces(const std::vector<ProjectiveContact>& contacts, const Eigen::VectorXd& multiplier,
                            Eigen::Index vertices);

/// H u, three rows a contact.
Eigen::VectorXd along_contacts(const std::vector<ProjectiveContact>& contacts, const data::Points& u);

/// Potential of contact and friction at other positions, with the normal forces frozen: sum mu lambda_n
/// |slip| - lambda_n gap [J].
double contact_potential(const Environment& environment, double time, double time_step,
                         const std::vector<ProjectiveContact>& contacts, const Eigen::VectorXd& multiplier,
                         const data::Points& positions);

/// W = H A^-1 H^T, dense.
Eigen::MatrixXd full_metric(const std::vector<ProjectiveContact>& contacts, const ProjectiveSystem& system);

/// The diagonal of W alone.
Eigen::VectorXd full_metric_diagonal(const std::vector<ProjectiveContact>& contacts,
                                     const ProjectiveSystem& system);

}  // namespace flash::sim
