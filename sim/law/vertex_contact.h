#pragma once
#include "sim/law/vertex_touch.h"

namespace flash::sim {
inline namespace FLASH_LEVEL {

/// What holds a vertex at the current iterate of a step.
struct VertexContact {
  Freedom freedom = Freedom::free;
  double friction_bound = 0;         ///< sum of mu lambda_n [N]
  Vector3<double> correction{};      ///< displacement that a held direction must make [m]
  Vector3<double> reaction{};        ///< force on the vertex, always admissible [N]
  Vector3<double> slip_direction{};  ///< free part of the slip, divided by its length
  Symmetric3 free = identity3();     ///< projector on the directions it may move in
  Symmetric3
      slip_stiffness{};  ///< how friction turns with the slip: sum of mu lambda_n / |slip| across it [N/m]
};

/// Slip over a step of `time_step` [s] at which friction is 0.7 of its bound, for a smooth start of sliding
/// [m]. It is that of an acceleration far below gravity, so that it is small beside any motion in the step.
FLASH_HOST_DEVICE inline double slip_smoothing(double time_step) {
  constexpr double acceleration = 1e-3;           // [m/s^2]
  constexpr double longest = 1e-8;                // [m]
  constexpr double shortest = 10 * resting_slip;  // above the rounding of positions [m]
  const double length = larger_of(shortest, acceleration * time_step * time_step);
  return length < longest ? length : longest;
}

/// Length of a slip over a step as friction takes it, smooth where it starts [m].
FLASH_HOST_DEVICE inline double smooth_length(double length, double time_step) {
  const double smoothing = slip_smoothing(time_step);
  return square_root(length * length + smoothing * smoothing);
}

/// Displacement of a vertex since the start of the step along and against the surfaces that hold it [m].
/// Where there are several, it is against their mean, weighted by mu lambda_n.
FLASH_HOST_DEVICE inline Vector3<double> slip_against(const ObstacleStep<double>& step,
                                                      const Vector3<double>& start,
                                                      const Vector3<double>& point,
                                                      const VertexTouch* touches) {
  constexpr double least_weight = 1e-300;  // surfaces without friction count alike
  Vector3<double> moved{}, first{}, second{};
  double weights = 0;
  int held = 0;
  for (int k = 0; k < step.count; ++k) {
    if (!touches[k].holds) continue;
    const SurfaceGap<double> gap = gap_in_step(step, k, start, point);
    const double weight = step.obstacles[k].friction * touches[k].normal_force + least_weight;
    moved = moved + weight * gap.surface_moved;
    weights += weight;
    (held == 0 ? first : second) = gap.normal;
    ++held;
  }
  const Vector3<double> against = point - start - (1 / weights) * moved;
  if (held == 1) return along_plane(first, against);
  if (held > 2) return {};
  const Vector3<double> edge = cross(first, second);
  const double squared = dot(edge, edge);
  // Beyond the ends of both, the surfaces may be parallel.
  if (squared == 0) return {};
  return (dot(edge, against) / squared) * edge;
}

/// Decides what holds a vertex that needs `needed` from outside to obey its equation of motion [N], from its
/// touches; fills in their forces and slips. On a surface it is held while it needs a push. It sticks where
/// it has not slipped in this step and needs a friction force inside the cone. Else the force is on the rim,
/// against the slip. Of several surfaces each rubs against its own slip, which enters the normal forces of
/// the others. Between two the vertex moves along their edge alone, between three not at all.
template <typename Room>
FLASH_HOST_DEVICE inline VertexContact decide_contact(const ObstacleStep<double>& step,
                                                      const Vector3<double>& start,
                                                      const Vector3<double>& point,
                                                      const Vector3<double>& needed, VertexTouch* touches,
                                                      Room& room) {
  VertexContact contact;
  int touching = 0;
  double longest = 0;
  for (int k = 0; k < step.count; ++k) {
    VertexTouch& touch = touches[k];
    if (!touch.touches()) continue;
    ++touching;
    const Vector3<double> slip = along_plane(touch.normal, point - start - touch.surface_moved);
    const double length = norm(slip);
    longest = larger_of(longest, length);
    touch.slip = smooth_length(length, step.time_step);
    touch.slip_direction = (1 / touch.slip) * slip;
  }
  const bool slipped = longest > resting_slip;
  share_force(
      step, needed, slipped && touching > 1, [](const VertexTouch& touch) { return touch.touches(); },
      touches, room);
  int held = 0;
  for (int k = 0; k < step.count; ++k) {
    if (!touches[k].holds) continue;
    contact.friction_bound += step.obstacles[k].friction * touches[k].normal_force;
    contact.slip_direction = touches[k].slip_direction;
    ++held;
  }
  if (held == 0) return contact;

  const double bound = contact.friction_bound;
  const Symmetric3 along = along_surfaces(step.count, touches);
  const Vector3<double> tangential = along * needed;
  if (!slipped && norm(tangential) <= bound) {
    contact.freedom = Freedom::stick;
    contact.free = {};
    contact.reaction = needed;
    for (int k = 0; k < step.count; ++k)
      if (touches[k].holds && bound > 0)
        touches[k].friction = (step.obstacles[k].friction * touches[k].normal_force / bound) * tangential;
    return contact;
  }
  contact.freedom = Freedom::slip;
  contact.free = along;
  if (!slipped) {
    contact.slip_direction = (-1 / norm(tangential)) * tangential;
  } else if (held > 1) {
    const Vector3<double> slip = slip_against(step, start, point, touches);
    contact.slip_direction = (1 / smooth_length(norm(slip), step.time_step)) * slip;
  }
  for (int k = 0; k < step.count; ++k) {
    VertexTouch& touch = touches[k];
    if (!touch.holds) continue;
    const double own_bound = step.obstacles[k].friction * touch.normal_force;
    const Vector3<double> direction = slipped ? touch.slip_direction : contact.slip_direction;
    touch.friction = -own_bound * direction;
    contact.reaction = contact.reaction + touch.normal_force * touch.normal + touch.friction;
    if (slipped)
      contact.slip_stiffness =
          contact.slip_stiffness +
          (own_bound / touch.slip) * (identity3() - square(touch.normal) - square(direction));
  }
  return contact;
}

/// sum mu lambda_n |slip| of a vertex at `point`, at the normal forces of its contact [J].
FLASH_HOST_DEVICE inline double friction_potential_of(const ObstacleStep<double>& step,
                                                      const Vector3<double>& start,
                                                      const Vector3<double>& point,
                                                      const VertexContact& contact,
                                                      const VertexTouch* touches) {
  if (contact.friction_bound == 0) return 0;
  double potential = 0;
  for (int k = 0; k < step.count; ++k) {
    if (!touches[k].holds) continue;
    const SurfaceGap<double> gap = gap_in_step(step, k, start, point);
    const double slip = norm(along_plane(gap.normal, point - start - gap.surface_moved));
    potential += step.obstacles[k].friction * touches[k].normal_force *
                 (is_zero(contact.slip_stiffness) ? slip : smooth_length(slip, step.time_step));
  }
  return potential;
}

/// How the friction force of a slipping vertex changes with the force on it: the sum of mu_k d_k l_k^T, where
/// d_k is the direction of slip and l_k . f the normal force of surface k under the force f. Returns its
/// column `axis`; zero for all other vertices.
FLASH_HOST_DEVICE inline Vector3<double> friction_coupling(const ObstacleStep<double>& step,
                                                           const VertexContact& contact,
                                                           const VertexTouch* touches, int axis) {
  if (contact.freedom != Freedom::slip) return {};
  Vector3<double> normals[3], rubs[3];
  int count = 0;
  for (int k = 0; k < step.count && count < 3; ++k) {
    if (!touches[k].holds) continue;
    normals[count] = touches[k].normal;
    rubs[count++] = step.obstacles[k].friction * touches[k].slip_direction;
  }
  FewEquations<double> equations;
  equations.size = count;
  for (int r = 0; r < count; ++r) {
    equations.right[r] = normals[r][axis];
    for (int c = 0; c < count; ++c) equations.matrix[r][c] = dot(normals[r], normals[c] - rubs[c]);
  }
  double forces[3];
  if (!solve(equations, 0.0, forces)) return {};
  Vector3<double> sum{};
  for (int k = 0; k < count; ++k) sum = sum + forces[k] * rubs[k];
  return sum;
}

}  // namespace FLASH_LEVEL
}  // namespace flash::sim
