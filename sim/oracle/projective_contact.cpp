#include "sim/oracle/projective_contact.h"

#include <cmath>

#include "sim/step/moving_obstacles.h"

namespace flash::sim {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector3d;

/// A direction along held axes only has no compliance of its own: the system stays regular with that of the
/// vertex.
double regular(double compliance, double inverse_mass) {
  return compliance > 1e-9 * inverse_mass ? compliance : inverse_mass;
}

/// Displacement of a vertex since the start of the step against the surface [m].
Vector3d moved_against(const Environment& environment, const Gap& gap, const data::Points& positions,
                       Index vertex) {
  return (positions.row(vertex) - environment.state.positions.row(vertex)).transpose() - gap.surface_moved;
}

}  // namespace

std::vector<ProjectiveContact> find_contacts(const Sheet& sheet, const Environment& environment, double time,
                                             double time_step, const data::Points& positions,
                                             const Eigen::VectorXd& reach,
                                             const std::vector<Vector3d>& free_axes, double tangent_angle) {
  const std::vector<MovingObstacle<double>> obstacles = moving_obstacles(environment, time - time_step, time);
  std::vector<ProjectiveContact> contacts;
  for (Index i = 0; i < positions.rows(); ++i) {
    if (free_axes[i].isZero()) continue;
    for (std::size_t k = 0; k < obstacles.size(); ++k) {
      const Gap gap = gap_of(gap_to(obstacles[k], vector3(positions, i)));
      if (!(gap.distance < reach[i]) || gap.normal.cwiseProduct(free_axes[i]).norm() < 1e-6) continue;
      ProjectiveContact contact{static_cast<int>(i), static_cast<int>(k), {}, {}, 0};
      const Vector3d first = gap.normal.unitOrthogonal(), second = gap.normal.cross(first);
      contact.directions.row(0) = gap.normal;
      contact.directions.row(1) = std::cos(tangent_angle) * first + std::sin(tangent_angle) * second;
      contact.directions.row(2) = std::cos(tangent_angle) * second - std::sin(tangent_angle) * first;
      contact.gap = contact.directions * moved_against(environment, gap, positions, i);
      contact.gap[0] = gap.distance;
      contact.friction =
          friction_between(environment, environment.obstacles[k], body_of(sheet, contact.vertex));
      contacts.push_back(contact);
    }
  }
  return contacts;
}

data::Points contact_forces(const std::vector<ProjectiveContact>& contacts, const Eigen::VectorXd& multiplier,
                            Index vertices) {
  data::Points force = data::Points::Zero(vertices, 3);
  for (std::size_t k = 0; k < contacts.size(); ++k)
    force.row(contacts[k].vertex) += multiplier.segment<3>(3 * k).transpose() * contacts[k].directions;
  return force;
}

Eigen::VectorXd along_contacts(const std::vector<ProjectiveContact>& contacts, const data::Points& u) {
  Eigen::VectorXd along(3 * contacts.size());
  for (std::size_t k = 0; k < contacts.size(); ++k)
    along.segment<3>(3 * k) = contacts[k].directions * u.row(contacts[k].vertex).transpose();
  return along;
}

double contact_potential(const Environment& environment, double time, double time_step,
                         const std::vector<ProjectiveContact>& contacts, const Eigen::VectorXd& multiplier,
                         const data::Points& positions) {
  const std::vector<MovingObstacle<double>> obstacles = moving_obstacles(environment, time - time_step, time);
  double potential = 0;
  for (std::size_t k = 0; k < contacts.size(); ++k) {
    const double normal = multiplier[3 * k];
    if (normal == 0) continue;
    const ProjectiveContact& contact = contacts[k];
    const Gap gap = gap_of(gap_to(obstacles[contact.obstacle], vector3(positions, contact.vertex)));
    const Vector3d moved = moved_against(environment, gap, positions, contact.vertex);
    const double slip = (moved - gap.normal * gap.normal.dot(moved)).norm();
    potential += normal * (contact.friction * slip - gap.distance);
  }
  return potential;
}

Eigen::MatrixXd full_metric(const std::vector<ProjectiveContact>& contacts, const ProjectiveSystem& system) {
  const Index n = static_cast<Index>(contacts.size());
  Eigen::MatrixXd W(3 * n, 3 * n);
  for (Index j = 0; j < n; ++j)
    for (Index i = j; i < n; ++i) {
      const Vector3d inverse = system.inverse(contacts[i].vertex, contacts[j].vertex);
      const Matrix3d block =
          contacts[i].directions * inverse.asDiagonal() * contacts[j].directions.transpose();
      W.block<3, 3>(3 * i, 3 * j) = block;
      W.block<3, 3>(3 * j, 3 * i) = block.transpose();
    }
  for (Index i = 0; i < 3 * n; ++i) W(i, i) = regular(W(i, i), 1 / system.mass()[contacts[i / 3].vertex]);
  return W;
}

Eigen::VectorXd full_metric_diagonal(const std::vector<ProjectiveContact>& contacts,
                                     const ProjectiveSystem& system) {
  Eigen::VectorXd diagonal(3 * contacts.size());
  for (std::size_t k = 0; k < contacts.size(); ++k) {
    const Vector3d inverse = system.inverse(contacts[k].vertex, contacts[k].vertex);
    for (int a = 0; a < 3; ++a)
      diagonal[3 * k + a] =
          regular(contacts[k].directions.row(a).cwiseAbs2() * inverse, 1 / system.mass()[contacts[k].vertex]);
  }
  return diagonal;
}

}  // namespace flash::sim
