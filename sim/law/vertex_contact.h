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
  Symmetric3 slip_stiffness{};       ///< how friction changes with the slip [N/m]
};

/// Friction as bristles that bend before they slide (Haessig and Friedland 1991), solved by return mapping
/// (Simo and Laursen 1992): a spring up to its bound. A vertex that comes to rest stays where it is, since
/// the bristles keep their deflection from one step to the next.
///
/// Slip over which bristles bend before they slide [m]. It is small beside any motion in a step. A step is
/// long beside their oscillation, which implicit Euler damps then: mu g / acceleration = (omega h)^2.
FLASH_HOST_DEVICE inline double bristle_length(double time_step) {
  constexpr double acceleration = 1e-2;           // [m/s^2]
  constexpr double longest = 1e-6;                // [m]
  constexpr double shortest = 10 * resting_slip;  // above the rounding of positions [m]
  const double length = larger_of(shortest, acceleration * time_step * time_step);
  return length < longest ? length : longest;
}

/// What a slip is divided by to give friction as a share of its bound [m].
FLASH_HOST_DEVICE inline double friction_length(double slip, double time_step) {
  return larger_of(slip, bristle_length(time_step));
}

/// Energy of friction whose bound is one newton: that of the bristles, and what sliding takes [J/N].
FLASH_HOST_DEVICE inline double friction_energy(double slip, double time_step) {
  const double length = bristle_length(time_step);
  return slip <= length ? slip * slip / (2 * length) : slip - 0.5 * length;
}

/// Fills in the bristles of the touches of a vertex. Each obstacle has its own, which turn with it.
/// `bristle_of(k)`: those of obstacle k as in State.
template <typename BristleOf>
FLASH_HOST_DEVICE inline void carry_bristles(const ObstacleStep<double>& step, const BristleOf& bristle_of,
                                             VertexTouch* touches) {
  for (int k = 0; k < step.count; ++k)
    touches[k].bristle = bristle_length(step.time_step) * turned_with(step.obstacles[k], bristle_of(k));
}

/// Slip of a vertex along and against the surfaces that hold it [m]: the deflection of their bristles at the
/// start of the step, and its displacement since. Where there are several surfaces, it is the mean of that
/// against each, weighted by mu lambda_n.
FLASH_HOST_DEVICE inline Vector3<double> slip_against(const ObstacleStep<double>& step,
                                                      const Vector3<double>& start,
                                                      const Vector3<double>& point,
                                                      const VertexTouch* touches) {
  constexpr double least_weight = 1e-300;  // surfaces without friction count alike
  Vector3<double> gone{}, first{}, second{};
  double weights = 0;
  int held = 0;
  for (int k = 0; k < step.count; ++k) {
    if (!touches[k].holds) continue;
    const SurfaceGap<double> gap = gap_in_step(step, k, start, point);
    const double weight = step.obstacles[k].friction * touches[k].normal_force + least_weight;
    gone = gone + weight * (touches[k].bristle - gap.surface_moved);
    weights += weight;
    (held == 0 ? first : second) = gap.normal;
    ++held;
  }
  const Vector3<double> against = point - start + (1 / weights) * gone;
  if (held == 1) return along_plane(first, against);
  if (held > 2) return {};
  const Vector3<double> edge = cross(first, second);
  const double squared = dot(edge, edge);
  // Beyond the ends of both, the surfaces may be parallel.
  if (squared == 0) return {};
  return (dot(edge, against) / squared) * edge;
}

/// Sum of mu lambda_n over the surfaces that hold a vertex [N].
FLASH_HOST_DEVICE inline double friction_bound_of(const ObstacleStep<double>& step,
                                                  const VertexTouch* touches) {
  double bound = 0;
  for (int k = 0; k < step.count; ++k)
    if (touches[k].holds) bound += step.obstacles[k].friction * touches[k].normal_force;
  return bound;
}

/// How the friction of a vertex changes with its slip at the normal forces of its touches [N/m].
FLASH_HOST_DEVICE inline Symmetric3 slip_stiffness_of(const ObstacleStep<double>& step,
                                                      const VertexTouch* touches) {
  Symmetric3 stiffness;
  for (int k = 0; k < step.count; ++k) {
    const VertexTouch& touch = touches[k];
    if (!touch.holds) continue;
    Symmetric3 turns = identity3() - square(touch.normal);
    if (touch.slip > bristle_length(step.time_step)) turns = turns - square(touch.slip_direction);
    stiffness = stiffness + (step.obstacles[k].friction * touch.normal_force /
                             friction_length(touch.slip, step.time_step)) *
                                turns;
  }
  return stiffness;
}

/// Decides what holds a vertex that needs `needed` from outside to obey its equation of motion [N], from its
/// touches; fills in their forces and slips. On a surface it is held while it needs a push. Friction is
/// against the slip: in proportion to it up to bristle_length, of the size of its bound beyond. Of several
/// surfaces each rubs against its own slip, which enters the normal forces of the others. Between two the
/// vertex moves along their edge alone, between three not at all.
template <typename Room>
FLASH_HOST_DEVICE inline VertexContact decide_contact(const ObstacleStep<double>& step,
                                                      const Vector3<double>& start,
                                                      const Vector3<double>& point,
                                                      const Vector3<double>& needed, VertexTouch* touches,
                                                      Room& room) {
  VertexContact contact;
  int touching = 0;
  for (int k = 0; k < step.count; ++k) {
    VertexTouch& touch = touches[k];
    if (!touch.touches()) continue;
    ++touching;
    const Vector3<double> slip =
        along_plane(touch.normal, touch.bristle + point - start - touch.surface_moved);
    touch.slip = norm(slip);
    touch.slip_direction = (1 / friction_length(touch.slip, step.time_step)) * slip;
  }
  share_force(
      step, needed, touching > 1, [](const VertexTouch& touch) { return touch.touches(); }, touches, room);
  int held = 0;
  for (int k = 0; k < step.count; ++k) {
    if (!touches[k].holds) continue;
    contact.slip_direction = touches[k].slip_direction;
    ++held;
  }
  if (held == 0) return contact;

  contact.freedom = Freedom::slip;
  contact.friction_bound = friction_bound_of(step, touches);
  contact.slip_stiffness = slip_stiffness_of(step, touches);
  contact.free = along_surfaces(step.count, touches);
  if (held > 1) {
    const Vector3<double> slip = slip_against(step, start, point, touches);
    contact.slip_direction = (1 / friction_length(norm(slip), step.time_step)) * slip;
  }
  for (int k = 0; k < step.count; ++k) {
    VertexTouch& touch = touches[k];
    if (!touch.holds) continue;
    touch.friction = -(step.obstacles[k].friction * touch.normal_force) * touch.slip_direction;
    contact.reaction = contact.reaction + touch.normal_force * touch.normal + touch.friction;
  }
  return contact;
}

/// Energy of friction of a vertex at `point`, at the normal forces of its contact [J].
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
    const double slip = norm(along_plane(gap.normal, touches[k].bristle + point - start - gap.surface_moved));
    potential += step.obstacles[k].friction * touches[k].normal_force * friction_energy(slip, step.time_step);
  }
  return potential;
}

/// The bristles of an obstacle on a vertex at the end of a step, as in State.
FLASH_HOST_DEVICE inline Vector3<double> bristle_at_end(const MovingObstacle<double>& obstacle,
                                                        const VertexTouch& touch) {
  return touch.holds && obstacle.friction > 0 ? touch.slip_direction : Vector3<double>{};
}

/// Energy of the bristles of a vertex's touches at the start of a step, at the normal forces of its end [J].
FLASH_HOST_DEVICE inline double bristle_energy(const ObstacleStep<double>& step, const VertexTouch* touches) {
  double energy = 0;
  for (int k = 0; k < step.count; ++k)
    if (touches[k].holds)
      energy += step.obstacles[k].friction * touches[k].normal_force *
                friction_energy(norm(touches[k].bristle), step.time_step);
  return energy;
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
