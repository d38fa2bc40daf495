#pragma once
#include "sim/law/contact_way.h"

namespace flash::sim {
inline namespace FLASH_LEVEL {

/// The obstacles of one step, and how vertices that start inside leave them.
template <typename Real>
struct ObstacleStep {
  const MovingObstacle<Real>* obstacles = nullptr;
  int count = 0;
  bool several = false;  ///< whether a box stands beside another obstacle, so that one may continue the other
  Real time_step{};      ///< [s]
  WayOut<Real> way_out{};
  bool planes = false;  ///< whether all obstacles are planes, where the caller looked

  FLASH_HOST_DEVICE OtherObstacles<Real> others(int own) const { return {obstacles, count, own}; }
};

/// A lower bound of the gap to a box that the way of a vertex from `start` to `point`, or one that slides as
/// far, cannot meet: by the sphere around it [m]. Where it may meet the obstacle, minus no_such_side.
template <typename Real>
FLASH_HOST_DEVICE inline Real far_gap(const MovingObstacle<Real>& obstacle, const Vector3<Real>& start,
                                      const Vector3<Real>& point) {
  constexpr Real may_meet = -no_such_side;
  if (obstacle.shape != ObstacleShape::box) return may_meet;
  const Vector3<Real> carried =
      obstacle.moves ? place_from(obstacle.end, place_in(obstacle.start, start)) : start;
  const Real radius = norm(obstacle.half_extents);
  if (norm(carried - obstacle.end.origin) <= radius + norm(point - carried)) return may_meet;
  return norm(point - obstacle.end.origin) - radius;
}

/// Where the way of a vertex from `start` to `point` would end along the surfaces of other obstacles that it
/// meets before obstacle `own`. It slides along eight of them at most.
template <typename Real>
FLASH_HOST_DEVICE inline Vector3<Real> slid_place(const ObstacleStep<Real>& step, int own,
                                                  const Vector3<Real>& start, const Vector3<Real>& point) {
  constexpr int most = 8;
  int along[most] = {};
  Vector3<Real> end = point;
  for (int met = 0; met < most; ++met) {
    const MetSurface<Real> own_surface = met_surface(step.obstacles[own], step.others(own), start, end);
    MetSurface<Real> first;
    for (int k = 0; k < step.count; ++k) {
      bool candidate = k != own && far_gap(step.obstacles[k], start, point) < 0;
      for (int m = 0; m < met; ++m) candidate = candidate && along[m] != k;
      if (!candidate) continue;
      const MetSurface<Real> surface = met_surface(step.obstacles[k], step.others(k), start, end);
      if (!surface.met || (first.met && first.entry <= surface.entry) ||
          (own_surface.met && own_surface.entry < surface.entry))
        continue;
      first = surface;
      along[met] = k;
    }
    if (!first.met) return end;
    end = end + larger_of(Real(0), first.offset - dot(first.normal, end)) * first.normal;
  }
  return end;
}

/// gap_in_step of an obstacle that is no plane. It takes values: what a kernel gives away the address of
/// stays in memory.
template <typename Real>
FLASH_CALLED_ON_DEVICE inline SurfaceGap<Real> gap_of_solid_in_step(ObstacleStep<Real> step, int obstacle,
                                                                    Vector3<Real> start,
                                                                    Vector3<Real> point) {
  const MovingObstacle<Real>& own = step.obstacles[obstacle];
  const OtherObstacles<Real> none;
  if (!step.several || own.shape != ObstacleShape::box)
    return gap_after(own, none, start, point, point, step.time_step, step.way_out);
  if (far_gap(own, start, point) > 0) return gap_to(own, point);
  // A vertex that starts inside goes straight out.
  if (distance_at_start(own, start) < -inside_depth)
    return gap_after(own, none, start, point, point, step.time_step, step.way_out);
  return gap_after(own, step.others(obstacle), start, point, slid_place(step, obstacle, start, point),
                   step.time_step, step.way_out);
}

/// How a vertex that comes from `start` stands against an obstacle, were it at `point` at the end of the
/// step.
template <typename Real>
FLASH_HOST_DEVICE inline SurfaceGap<Real> gap_in_step(const ObstacleStep<Real>& step, int obstacle,
                                                      const Vector3<Real>& start,
                                                      const Vector3<Real>& point) {
  const MovingObstacle<Real>& own = step.obstacles[obstacle];
  if (step.planes || own.shape == ObstacleShape::plane)
    return gap_after_plane(own, start, point, step.time_step, step.way_out);
  return gap_of_solid_in_step(step, obstacle, start, point);
}

/// The distance of gap_in_step alone, fast where the obstacle is a plane.
template <typename Real>
FLASH_HOST_DEVICE inline Real distance_in_step(const ObstacleStep<Real>& step, int obstacle,
                                               const Vector3<Real>& start, const Vector3<Real>& point) {
  const MovingObstacle<Real>& own = step.obstacles[obstacle];
  if (!step.planes && own.shape != ObstacleShape::plane)
    return gap_in_step(step, obstacle, start, point).distance;
  const Real depth = -dot(own.start.z, start - own.start.origin);
  return dot(own.end.z, point - own.end.origin) + sunk_of(depth, step.time_step, step.way_out);
}

}  // namespace FLASH_LEVEL
}  // namespace flash::sim
