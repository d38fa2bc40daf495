#pragma once
#include "sim/law/vertex_contact.h"

namespace flash::sim {
inline namespace FLASH_LEVEL {

/// Whether the vertex is to land on the surface that held it at the iterate. The step has to be long enough
/// to bring it down, and must not have taken it beyond the end of that surface.
FLASH_HOST_DEVICE inline bool lands(const VertexTouch& touch, const SurfaceGap<double>& gap) {
  constexpr double closed_share = 0.01;  // of the gap at the iterate that counts as closed
  constexpr double same_surface = 0.5;   // cosine between the normals of a surface, before its end
  return touch.holds && gap.distance > 0 && (touch.touches() || gap.distance <= closed_share * touch.gap) &&
         dot(gap.normal, touch.normal) > same_surface;
}

/// Whether a vertex may stay at `point`. `touches`: at the iterate, null where nothing holds it.
FLASH_HOST_DEVICE inline bool stays(const ObstacleStep<double>& step, const Vector3<double>& start,
                                    const Vector3<double>& point, const VertexTouch* touches) {
  for (int k = 0; k < step.count; ++k) {
    const bool held = touches != nullptr && touches[k].holds;
    if (!held && step.several && far_gap(step.obstacles[k], start, point) > 0) continue;
    const SurfaceGap<double> gap = gap_in_step(step, k, start, point);
    if (!(gap.distance >= 0) || (held && lands(touches[k], gap))) return false;
  }
  return true;
}

/// The shortest way that closes `count` gaps: solve_lcp of the room's normals and its right-hand side.
template <typename Room>
FLASH_HOST_DEVICE inline Vector3<double> way_out_of(int count, Room& room) {
  if constexpr (for_one_surface<Room>) {
    if (count == 0) return {};
    return solve_lcp_of_one(room.normals[0], room.normals[0], room.right[0]) * room.normals[0];
  } else {
    solve_lcp(count, &room.normals[0], &room.normals[0], &room.right[0], &room.solution[0]);
    Vector3<double> way{};
    for (int c = 0; c < count; ++c) way = way + room.solution[c] * room.normals[c];
    return way;
  }
}

/// The rounds of projected_out.
template <typename Room>
FLASH_HOST_DEVICE inline Vector3<double> project_in_rounds(const ObstacleStep<double>& step,
                                                           const Vector3<double>& start,
                                                           const VertexTouch* touches, Vector3<double> point,
                                                           Room& room) {
  constexpr int rounds = 40;
  for (int round = 0; round < rounds; ++round) {
    double moved = 0;
    bool outside = true;
    int count = 0;
    for (int k = 0; k < step.count; ++k) {
      const SurfaceGap<double> gap = gap_in_step(step, k, start, point);
      double depth = -gap.distance;
      if (touches != nullptr && lands(touches[k], gap)) {
        point = point - gap.distance * gap.normal;
        moved = larger_of(moved, gap.distance);
        depth = 0;
      }
      outside = outside && depth <= 0;
      // What is nearest of a box or a mesh that the way misses may be its far side.
      const ObstacleShape shape = step.planes ? ObstacleShape::plane : step.obstacles[k].shape;
      if ((shape == ObstacleShape::box || shape == ObstacleShape::mesh) && depth < -touching_gap) continue;
      room.normals[count] = gap.normal;
      room.right[count++] = depth;
    }
    if (moved == 0 && outside) break;
    const Vector3<double> way = way_out_of(count, room);
    point = point + way;
    if (larger_of(moved, norm(way)) <= resting_slip) break;
  }
  return point;
}

/// The same, called on a device: several surfaces take much code.
template <typename Room>
FLASH_CALLED_ON_DEVICE inline Vector3<double> project_by_call(const ObstacleStep<double>& step,
                                                              const Vector3<double>& start,
                                                              const VertexTouch* touches,
                                                              Vector3<double> point, Room& room) {
  return project_in_rounds(step, start, touches, point, room);
}

/// The nearest place out of all obstacles, and on those where the vertex is to land. Exact for planes at
/// once; round surfaces and faces that change take a few rounds.
template <typename Room>
FLASH_HOST_DEVICE inline Vector3<double> projected_out(const ObstacleStep<double>& step,
                                                       const Vector3<double>& start,
                                                       const VertexTouch* touches,
                                                       const Vector3<double>& point, Room& room) {
  if (stays(step, start, point, touches)) return point;
  if constexpr (for_one_surface<Room>)
    return project_in_rounds(step, start, touches, point, room);
  else
    return project_by_call(step, start, touches, point, room);
}

/// The feasible place nearest to a trial `point` of a vertex, by its contact in the linear problem. A slip
/// that turned against its direction is stopped: at a place near that, where the vertex stands on the
/// surfaces that hold it and has not slipped, it has to decide again.
template <typename Room>
FLASH_HOST_DEVICE inline Vector3<double> feasible_place(const ObstacleStep<double>& step,
                                                        const Vector3<double>& start,
                                                        const VertexContact& contact,
                                                        const VertexTouch* touches,
                                                        const Vector3<double>& point, Room& room) {
  constexpr double sliding = 0.999;  // squared length of the direction of what slides
  constexpr int rounds = 10;
  const bool slides =
      contact.freedom == Freedom::slip && dot(contact.slip_direction, contact.slip_direction) >= sliding;
  Vector3<double> place = point;
  for (int round = 0;; ++round) {
    place = projected_out(step, start, touches, place, room);
    if (!slides || round == rounds) return place;
    const Vector3<double> slip = slip_against(step, start, place, touches);
    if ((round == 0 && dot(slip, contact.slip_direction) >= 0) || !(norm(slip) > resting_slip)) return place;
    // The way back leaves a round surface: the vertex is projected on it, and the slip taken back again.
    place = place - slip;
  }
}

}  // namespace FLASH_LEVEL
}  // namespace flash::sim
