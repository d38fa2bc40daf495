#pragma once
#include "sim/law/vertex_contact.h"

namespace flash::sim::cuda {

/// What is kept of a VertexTouch; the rest follows from it or from the place of the vertex.
struct TouchRecord {
  long long flags;  ///< bit 1: it holds, 2: released, 4: starts inside
  double gap, normal_force, slip;
  Vector3<double> normal, slip_direction;
};

/// What is kept of a VertexContact; the rest follows from its touches.
struct ContactRecord {
  long long freedom;
  Vector3<double> correction, slip_direction;
};

FLASH_HOST_DEVICE inline TouchRecord record_of(const VertexTouch& touch) {
  return {(touch.holds ? 1 : 0) + (touch.released ? 2 : 0) + (touch.starts_inside ? 4 : 0),
          touch.gap,
          touch.normal_force,
          touch.slip,
          touch.normal,
          touch.slip_direction};
}

FLASH_HOST_DEVICE inline ContactRecord record_of(const VertexContact& contact) {
  return {static_cast<long long>(contact.freedom), contact.correction, contact.slip_direction};
}

/// A touch without what its obstacle's surface does at the place of the vertex.
FLASH_HOST_DEVICE inline VertexTouch touch_of(const TouchRecord& record) {
  VertexTouch touch;
  touch.holds = (record.flags & 1) != 0;
  touch.released = (record.flags & 2) != 0;
  touch.starts_inside = (record.flags & 4) != 0;
  touch.gap = record.gap;
  touch.normal_force = record.normal_force;
  touch.slip = record.slip;
  touch.normal = record.normal;
  touch.slip_direction = record.slip_direction;
  return touch;
}

/// A contact without its reaction and the stiffness of its slip.
FLASH_HOST_DEVICE inline VertexContact contact_of(const ObstacleStep<double>& step,
                                                  const ContactRecord& record, const VertexTouch* touches) {
  VertexContact contact;
  contact.freedom = static_cast<Freedom>(record.freedom);
  contact.correction = record.correction;
  contact.slip_direction = record.slip_direction;
  contact.friction_bound = friction_bound_of(step, touches);
  contact.free = along_surfaces(step.count, touches);
  return contact;
}

}  // namespace flash::sim::cuda
