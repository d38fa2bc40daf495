#pragma once
#include "sim/law/vertex_contact.h"

namespace flash::sim {
inline namespace FLASH_LEVEL {

// How a vertex changes sides in the linear problem of an iterate.

/// Frees a vertex from the touches that would have to pull, where it needs `force` [N]. Returns whether any
/// touch was released.
template <typename Room>
FLASH_HOST_DEVICE inline bool release(const ObstacleStep<double>& step, const Vector3<double>& force,
                                      VertexContact& contact, VertexTouch* touches, Room& room) {
  int held = 0, still_held = 0;
  for (int k = 0; k < step.count; ++k) {
    held += touches[k].holds;
    touches[k].released = touches[k].released || touches[k].holds;
  }
  share_force(
      step, force, false, [](const VertexTouch& touch) { return touch.holds; }, touches, room);
  for (int k = 0; k < step.count; ++k) {
    touches[k].released = touches[k].released && !touches[k].holds;
    still_held += touches[k].holds;
  }
  if (still_held == held) return false;
  contact.freedom = still_held > 0 ? Freedom::slip : Freedom::free;
  contact.free = along_surfaces(step.count, touches);
  contact.correction = contact.correction - contact.free * contact.correction;
  return true;
}

/// Holds a vertex on the touches up to `reach` away that `way` drives it into. Returns whether any touch was
/// added.
FLASH_HOST_DEVICE inline bool hold(const ObstacleStep<double>& step, const Vector3<double>& way, double reach,
                                   VertexContact& contact, VertexTouch* touches) {
  constexpr double least_depth = 1e-12;  // above rounding [m]
  constexpr double least_inward = 1e-6;  // squared length of the part of a normal that is free
  bool any = false;
  for (int k = 0; k < step.count; ++k) {
    VertexTouch& touch = touches[k];
    if (touch.holds || touch.released || touch.gap > reach ||
        touch.gap + dot(touch.normal, way) >= -least_depth)
      continue;
    // The correction stays within the surfaces that hold already.
    const Vector3<double> inward = contact.free * touch.normal;
    const double squared = dot(inward, inward);
    if (squared < least_inward) continue;
    contact.correction =
        contact.correction + ((-touch.gap - dot(touch.normal, contact.correction)) / squared) * inward;
    touch.holds = true;
    contact.freedom = Freedom::slip;
    contact.free = along_surfaces(step.count, touches);
    any = true;
  }
  return any;
}

}  // namespace FLASH_LEVEL
}  // namespace flash::sim
