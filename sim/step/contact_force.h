#pragma once
#include <Eigen/Core>
#include <array>
#include <vector>

#include "sim/scene/environment.h"
#include "sim/scene/sheet.h"

namespace flash::sim {

struct ContactSet;
struct LayerContact;

enum class ContactKind { vertex_obstacle, vertex_face, edge_edge };

/// Two features that press each other at the end of a step, and with what force. The second feature is an
/// obstacle, or part of the same surface as the first. All forces are those on the first; the second feels
/// the opposite ones at its own point. Against an obstacle that is the same point, between layers the nearest
/// one of each feature.
struct ContactForce {
  ContactKind kind = ContactKind::vertex_obstacle;
  int body = 0;   ///< number of the sheet's body that has the first feature
  int other = 0;  ///< of the body that has the second one, or of the obstacle of the environment
  /// Of the sheet: those of the first feature, then those of the second: 1, 1 + 3 or 2 + 2, then -1.
  std::array<int, 4> vertices = {-1, -1, -1, -1};
  Eigen::Vector3d point = Eigen::Vector3d::Zero();        ///< where the first feature feels it [m]
  Eigen::Vector3d other_point = Eigen::Vector3d::Zero();  ///< where the second one does [m]
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();       ///< unit, from the second to the first
  double normal_force = 0;                                ///< along the normal [N]
  Eigen::Vector3d friction = Eigen::Vector3d::Zero();     ///< across the normal [N]
  /// Torque that turns nearly parallel edges apart (LayerStep); else zero [N m].
  Eigen::Vector3d couple = Eigen::Vector3d::Zero();

  Eigen::Vector3d force() const { return normal_force * normal + friction; }
};

/// The contacts at an iterate with these `positions`: vertices in the order in which they are held, each
/// against its obstacles in their order, then pairs of layers by kind and vertices. A vertex may meet a mesh
/// by up to three surfaces, a contact each. Vertices that holds carry meet no obstacle.
std::vector<ContactForce> contacts_of(const Sheet& sheet, const Environment& environment,
                                      const data::Points& positions, const ContactSet& contacts,
                                      const LayerContact& layers);

}  // namespace flash::sim
