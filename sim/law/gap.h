#pragma once
#include <type_traits>

#include "sim/law/vector3.h"

namespace flash::sim {

struct SurfaceMesh;

inline namespace FLASH_LEVEL {

enum class ObstacleShape { plane, box, cylinder, capsule, mesh };

/// Surfaces of a mesh that a vertex can touch at once. Each is an obstacle by itself in a step.
inline constexpr int most_mesh_surfaces = 3;

struct MeshMemory;

/// An obstacle over one step. A plane stands across the third axis of its frame, through the origin, and its
/// solid is below. A box stands about the origin, along the axes. A cylinder has its axis along the third. A
/// capsule is all within `radius` of a stretch of the third axis, `half_length` to either side of the origin;
/// without length it is a sphere. A mesh has a frame of its own.
template <typename Real>
struct MovingObstacle {
  ObstacleShape shape = ObstacleShape::plane;
  Vector3<Real> half_extents{};  ///< of a box [m]
  Real radius{};                 ///< of a cylinder or a capsule; margin of a mesh [m]
  Real half_length{};            ///< of the axis of a capsule [m]
  Frame<Real> start{}, end{};    ///< at the start and at the end of the step
  bool moves = false;            ///< whether the two differ
  Real friction{};               ///< Coulomb coefficient on the body at hand
  const SurfaceMesh* mesh = nullptr;
  int surface = 0;               ///< which of those of a mesh that meet at a vertex
  MeshMemory* memory = nullptr;  ///< of a mesh, for the surfaces of a step; none: each is found anew
};

/// How a point stands against an obstacle.
template <typename Real>
struct SurfaceGap {
  Real distance{};                ///< to the surface, negative inside [m]
  Vector3<Real> normal{};         ///< unit, out of the obstacle
  Vector3<Real> surface_moved{};  ///< motion of the obstacle's material at the contact over the step [m]
  Vector3<Real> curvature_direction{};  ///< sqrt(curvature) times the direction of the curvature [m^-1/2]
  Real ball_curvature{};                ///< curvature in all directions along the surface [1/m]
  bool starts_inside = false;           ///< whether the vertex starts the step inside
  Real sunk{};  ///< how far the surface that `distance` is to lies below the obstacle's own [m]
};

/// Meshes are met on the host alone, in double precision (sim/law/mesh_gap).
template <typename Real>
inline constexpr bool meets_meshes = std::is_same_v<Real, double> && !on_device;

SurfaceGap<double> gap_to_mesh(const MovingObstacle<double>& obstacle, const Vector3<double>& point);

/// Motion over the step of the obstacle's material that is at `place` at its end.
template <typename Real>
FLASH_HOST_DEVICE inline Vector3<Real> material_motion(const MovingObstacle<Real>& obstacle,
                                                       const Vector3<Real>& place) {
  if (!obstacle.moves) return {};
  return place - place_from(obstacle.start, place_in(obstacle.end, place));
}

/// Where a direction that is fixed to the obstacle at the start of the step points at its end.
template <typename Real>
FLASH_HOST_DEVICE inline Vector3<Real> turned_with(const MovingObstacle<Real>& obstacle,
                                                   const Vector3<Real>& direction) {
  return obstacle.moves ? direction_from(obstacle.end, direction_in(obstacle.start, direction)) : direction;
}

/// By how much a point in the frame of a box exceeds its half extents along each axis.
template <typename Real>
FLASH_HOST_DEVICE inline Vector3<Real> excess_over(const Vector3<Real>& half_extents,
                                                   const Vector3<Real>& local) {
  return {magnitude(local.x) - half_extents.x, magnitude(local.y) - half_extents.y,
          magnitude(local.z) - half_extents.z};
}

/// The axis of the largest component, the first of equal ones.
template <typename Real>
FLASH_HOST_DEVICE inline int largest_axis(const Vector3<Real>& v) {
  int axis = v.y > v.x ? 1 : 0;
  if (v.z > v[axis]) axis = 2;
  return axis;
}

template <typename Real>
FLASH_HOST_DEVICE inline Real largest(const Vector3<Real>& v) {
  return v[largest_axis(v)];
}

/// The point of a capsule's axis nearest to a place in its frame.
template <typename Real>
FLASH_HOST_DEVICE inline Vector3<Real> nearest_on_axis(const MovingObstacle<Real>& capsule,
                                                       const Vector3<Real>& local) {
  const Real end = capsule.half_length;
  return {Real(0), Real(0), local.z > end ? end : local.z < -end ? -end : local.z};
}

/// Signed distance to a capsule, without the motion of its material.
template <typename Real>
FLASH_HOST_DEVICE inline SurfaceGap<Real> gap_to_capsule(const MovingObstacle<Real>& capsule,
                                                         const Vector3<Real>& local) {
  const Frame<Real>& frame = capsule.end;
  const Vector3<Real> nearest = nearest_on_axis(capsule, local), out = local - nearest;
  const Real length = norm(out);
  SurfaceGap<Real> gap;
  gap.distance = length - capsule.radius;
  gap.normal = frame.x;
  if (length == 0) return gap;
  gap.normal = direction_from(frame, (1 / length) * out);
  if (nearest.z == local.z)
    gap.curvature_direction = (1 / square_root(length)) * cross(frame.z, gap.normal);
  else
    gap.ball_curvature = 1 / length;
  return gap;
}

/// Gap at the end of the step to the face of a box across `axis`, on the side of `sign`, as if it had no end.
template <typename Real>
FLASH_HOST_DEVICE inline SurfaceGap<Real> gap_to_face(const MovingObstacle<Real>& box,
                                                      const Vector3<Real>& point, int axis, Real sign) {
  SurfaceGap<Real> gap;
  gap.distance = sign * place_in(box.end, point)[axis] - box.half_extents[axis];
  gap.normal = sign * box.end.axis(axis);
  gap.surface_moved = material_motion(box, point);
  return gap;
}

template <typename Real>
FLASH_HOST_DEVICE inline SurfaceGap<Real> gap_to_plane(const MovingObstacle<Real>& plane,
                                                       const Vector3<Real>& point) {
  return {.distance = dot(plane.end.z, point - plane.end.origin),
          .normal = plane.end.z,
          .surface_moved = material_motion(plane, point)};
}

/// Signed distance of `point` [m] to the obstacle where it stands at the end of the step. Exact outside;
/// inside a box the nearest face decides.
template <typename Real>
FLASH_HOST_DEVICE inline SurfaceGap<Real> gap_to(const MovingObstacle<Real>& obstacle,
                                                 const Vector3<Real>& point) {
  const Frame<Real>& frame = obstacle.end;
  if (obstacle.shape == ObstacleShape::plane) return gap_to_plane(obstacle, point);
  SurfaceGap<Real> gap;
  if constexpr (meets_meshes<Real>)
    if (obstacle.shape == ObstacleShape::mesh) {
      gap = gap_to_mesh(obstacle, point);
      gap.surface_moved = material_motion(obstacle, point);
      return gap;
    }
  if (obstacle.shape == ObstacleShape::cylinder) {
    const Vector3<Real> local = place_in(frame, point);
    const Real length = square_root(local.x * local.x + local.y * local.y);
    gap.distance = length - obstacle.radius;
    gap.normal = frame.x;
    if (length > 0) {
      gap.normal = (local.x / length) * frame.x + (local.y / length) * frame.y;
      gap.curvature_direction = (1 / square_root(length)) * cross(frame.z, gap.normal);
    }
  } else if (obstacle.shape == ObstacleShape::capsule) {
    gap = gap_to_capsule(obstacle, place_in(frame, point));
  } else {
    const Vector3<Real> local = place_in(frame, point), excess = excess_over(obstacle.half_extents, local);
    const int axis = largest_axis(excess);
    if (excess[axis] <= 0) return gap_to_face(obstacle, point, axis, with_sign(Real(1), local[axis]));
    Vector3<Real> outside{};
    for (int k = 0; k < 3; ++k)
      if (excess[k] > 0) outside[k] = with_sign(excess[k], local[k]);
    gap.distance = norm(outside);
    gap.normal = direction_from(frame, (1 / gap.distance) * outside);
  }
  gap.surface_moved = material_motion(obstacle, point);
  return gap;
}

/// Signed distance of `point` [m] to the obstacle where it stands at the start of the step.
template <typename Real>
FLASH_HOST_DEVICE inline Real distance_at_start(const MovingObstacle<Real>& obstacle,
                                                const Vector3<Real>& point) {
  MovingObstacle<Real> still = obstacle;
  still.end = obstacle.start;
  still.moves = false;
  return gap_to(still, point).distance;
}

}  // namespace FLASH_LEVEL
}  // namespace flash::sim
