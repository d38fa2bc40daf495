#include "sim/step/contact_force.h"

#include "sim/step/contact_set.h"
#include "sim/step/layer_contact.h"

namespace flash::sim {

using data::Points;
using Eigen::Vector3d;

namespace {

/// The obstacle that each touch of a vertex belongs to, as ContactStep::owners.
std::vector<int> owners_of(const std::vector<Obstacle>& obstacles) {
  std::vector<int> owners;
  for (std::size_t k = 0; k < obstacles.size(); ++k)
    owners.insert(owners.end(), static_cast<std::size_t>(surfaces_of(obstacles[k])), static_cast<int>(k));
  return owners;
}

ContactForce contact_of(const Sheet& sheet, const Points& positions, const VertexTouch& touch, int vertex,
                        int obstacle) {
  ContactForce contact{.body = body_of(sheet, vertex), .other = obstacle, .vertices = {vertex, -1, -1, -1}};
  contact.point = contact.other_point = positions.row(vertex).transpose();
  contact.normal = vector3d(touch.normal);
  contact.normal_force = touch.normal_force;
  contact.friction = vector3d(touch.friction);
  return contact;
}

ContactForce contact_of(const Sheet& sheet, const Points& positions, const LayerTouch& touch,
                        double friction) {
  const bool edges = touch.kind == PairKind::edge_edge;
  ContactForce contact{.kind = edges ? ContactKind::edge_edge : ContactKind::vertex_face,
                       .body = body_of(sheet, touch.vertices[0]),
                       .other = body_of(sheet, touch.vertices[3]),
                       .vertices = touch.vertices};
  for (int k = 0; k < 4; ++k) {
    const Vector3d part = touch.weights[k] * positions.row(touch.vertices[k]).transpose();
    if (k < (edges ? 2 : 1))
      contact.point += part;
    else
      contact.other_point -= part;
  }
  contact.normal = vector3d(touch.normal);
  contact.normal_force = touch.normal_force;
  contact.friction = -friction * touch.normal_force * vector3d(touch.slip_direction);
  contact.couple = vector3d(touch.couple);
  return contact;
}

}  // namespace

std::vector<ContactForce> contacts_of(const Sheet& sheet, const Environment& environment,
                                      const Points& positions, const ContactSet& contacts,
                                      const LayerContact& layers) {
  std::vector<ContactForce> all;
  const std::vector<int> owners = owners_of(environment.obstacles);
  for (std::size_t k = contacts.held; k < contacts.constraints.size(); ++k) {
    const std::span<const VertexTouch> touches = contacts.touches_of(k);
    for (std::size_t t = 0; t < touches.size(); ++t)
      if (touches[t].holds)
        all.push_back(contact_of(sheet, positions, touches[t], contacts.constraints[k].vertex, owners[t]));
  }
  if (!environment.self_contact) return all;
  for (const LayerTouch& touch : layers.touches)
    all.push_back(contact_of(sheet, positions, touch, environment.self_contact->friction));
  return all;
}

}  // namespace flash::sim
