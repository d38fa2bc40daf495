#pragma once
#include "sim/law/contact_law.h"
#include "sim/law/freedom.h"
#include "sim/law/obstacle_step.h"
#include "sim/law/symmetric3.h"

namespace flash::sim {
inline namespace FLASH_LEVEL {

/// A vertex against an obstacle.
struct VertexTouch {
  bool holds = false;     ///< the vertex stays on it
  bool released = false;  ///< in this iterate's linear problem, where the surface would have had to pull
  bool starts_inside = false;
  double gap = 0;           ///< [m]
  double normal_force = 0;  ///< lambda_n of an obstacle that holds [N]
  double slip = 0;          ///< length of the slip against it, as slip_against says [m]
  Vector3<double> normal{};
  Vector3<double> curvature_direction{};  ///< as in SurfaceGap [m^-1/2]
  double ball_curvature = 0;              ///< as in SurfaceGap [1/m]
  Vector3<double> surface_moved{};        ///< motion of the surface over the step [m]
  Vector3<double> bristle{};              ///< deflection at the start of the step, as carry_bristles says [m]
  Vector3<double> slip_direction{};       ///< the slip over its friction_length
  Vector3<double> friction{};             ///< friction force of the surface on the vertex [N]

  FLASH_HOST_DEVICE bool touches() const { return gap <= touching_gap; }
};

/// Second derivative of the gap to a surface that a vertex touches [1/m].
FLASH_HOST_DEVICE inline Symmetric3 curvature_of(const VertexTouch& touch) {
  return square(touch.curvature_direction) + touch.ball_curvature * (identity3() - square(touch.normal));
}

/// Room for the problems of one vertex with at most so many surfaces. What has no such bound gives arrays of
/// another kind the same names.
template <int most>
struct SurfaceRoom {
  Vector3<double> normals[most], directions[most];
  double right[most], solution[most];
  int those[most];
};

/// Whether a room is for one surface, so that a kernel can keep all of its problem in registers.
template <typename Room>
inline constexpr bool for_one_surface = false;
template <>
inline constexpr bool for_one_surface<SurfaceRoom<1>> = true;

/// The smallest gap of a vertex [m].
FLASH_HOST_DEVICE inline double clearance_of(const ObstacleStep<double>& step, const Vector3<double>& start,
                                             const Vector3<double>& point) {
  double clearance = no_such_side;
  for (int k = 0; k < step.count; ++k) {
    if (step.several && clearance <= far_gap(step.obstacles[k], start, point)) continue;
    const double distance = distance_in_step(step, k, start, point);
    // What is not a number is closer than anything.
    if (!(distance >= clearance)) clearance = distance;
  }
  return clearance;
}

/// Fills in the touches of a vertex with every obstacle of the step. `start` is its place at the start of the
/// step, `point` that at its end [m]; so everywhere here.
FLASH_HOST_DEVICE inline void find_touches(const ObstacleStep<double>& step, const Vector3<double>& start,
                                           const Vector3<double>& point, VertexTouch* touches) {
  for (int k = 0; k < step.count; ++k) {
    const SurfaceGap<double> gap = gap_in_step(step, k, start, point);
    VertexTouch touch;
    touch.gap = gap.distance;
    touch.starts_inside = gap.starts_inside;
    touch.normal = gap.normal;
    touch.curvature_direction = gap.curvature_direction;
    touch.ball_curvature = gap.ball_curvature;
    touch.surface_moved = gap.surface_moved;
    touches[k] = touch;
  }
}

/// The part of a vector along a plane.
FLASH_HOST_DEVICE inline Vector3<double> along_plane(const Vector3<double>& normal,
                                                     const Vector3<double>& v) {
  return v - dot(normal, v) * normal;
}

/// Projector on the directions along all surfaces that hold the vertex: space without any, a plane, the edge
/// of two, or nothing.
FLASH_HOST_DEVICE inline Symmetric3 along_surfaces(int count, const VertexTouch* touches) {
  Vector3<double> first{}, second{};
  int held = 0;
  for (int k = 0; k < count; ++k) {
    if (!touches[k].holds) continue;
    (held == 0 ? first : second) = touches[k].normal;
    ++held;
  }
  if (held == 0) return identity3();
  if (held == 1) return identity3() - square(first);
  if (held > 2) return {};
  const Vector3<double> edge = cross(first, second);
  return square((1 / norm(edge)) * edge);
}

/// Sets `normal_force` and `holds` of the touches that are `eligible` to what solves the complementarity
/// problem for `needed` [N], those of all others to zero. `rubbing`: each surface rubs against the vertex's
/// own slip, and the reaction is the sum of lambda_k (n_k - mu_k d_k).
template <typename Room, typename Eligible>
FLASH_HOST_DEVICE inline void share_force(const ObstacleStep<double>& step, const Vector3<double>& needed,
                                          bool rubbing, const Eligible& eligible, VertexTouch* touches,
                                          Room& room) {
  if (step.count == 1) {
    // Most sheets meet one table.
    const double push = eligible(touches[0]) ? larger_of(0.0, dot(touches[0].normal, needed)) : 0.0;
    touches[0].normal_force = push;
    touches[0].holds = push > 0;
    return;
  }
  int count = 0;
  for (int k = 0; k < step.count; ++k) {
    VertexTouch& touch = touches[k];
    const bool takes_part = eligible(touch);
    touch.holds = false;
    touch.normal_force = 0;
    if (!takes_part) continue;
    room.normals[count] = room.directions[count] = touch.normal;
    if (rubbing) room.directions[count] = touch.normal - step.obstacles[k].friction * touch.slip_direction;
    room.right[count] = dot(touch.normal, needed);
    room.those[count++] = k;
  }
  solve_lcp(count, &room.normals[0], &room.directions[0], &room.right[0], &room.solution[0]);
  for (int c = 0; c < count; ++c) {
    VertexTouch& touch = touches[room.those[c]];
    touch.normal_force = room.solution[c];
    touch.holds = room.solution[c] > 0;
  }
}

}  // namespace FLASH_LEVEL
}  // namespace flash::sim
