#pragma once
#include "sim/law/contact_law.h"
#include "sim/law/freedom.h"
#include "sim/law/obstacle_step.h"
#include "sim/law/symmetric3.h"

namespace flash::sim {
inline namespace FLASH_LEVEL {

// What one vertex does against the obstacles of a step: the formulas of sim/step for a vertex alone, in plain
// numbers, for kernels. `start` is its place at the start of the step, `point` that at its end [m]. `touches`
// are those with every obstacle of the step.

/// Obstacles of a step that these formulas have room for.
inline constexpr int most_obstacles = 8;

/// As Touch of sim/step/touch.h.
struct VertexTouch {
  bool holds = false, released = false, starts_inside = false;
  double gap = 0;           ///< [m]
  double normal_force = 0;  ///< [N]
  double slip = 0;          ///< [m]
  Vector3<double> normal{}, curvature_direction{}, surface_moved{}, slip_direction{};
  Vector3<double> friction{};  ///< [N]

  FLASH_HOST_DEVICE bool touches() const { return gap <= touching_gap; }
};

/// As VertexConstraint of sim/step/contact_set.h.
struct VertexContact {
  Freedom freedom = Freedom::free;
  double friction_bound = 0;                                   ///< [N]
  Vector3<double> correction{}, reaction{}, slip_direction{};  ///< [m], [N]
  Symmetric3 free = identity3(), slip_stiffness{};             ///< slip_stiffness [N/m]
};

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

FLASH_HOST_DEVICE inline void find_touches(const ObstacleStep<double>& step, const Vector3<double>& start,
                                           const Vector3<double>& point, VertexTouch* touches) {
  for (int k = 0; k < step.count; ++k) {
    const SurfaceGap<double> gap = gap_in_step(step, k, start, point);
    VertexTouch touch;
    touch.gap = gap.distance;
    touch.starts_inside = gap.starts_inside;
    touch.normal = gap.normal;
    touch.curvature_direction = gap.curvature_direction;
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

/// Length of a slip as friction takes it, smooth where it starts [m].
FLASH_HOST_DEVICE inline double smooth_length(double length) {
  return square_root(length * length + slip_smoothing * slip_smoothing);
}

/// Sets `normal_force` and `holds` of touches that are `eligible` (a bit each) to what solves the
/// complementarity problem for `needed` [N]. `rubbing`: each surface rubs against the vertex's own slip.
FLASH_HOST_DEVICE inline void share_force(const ObstacleStep<double>& step, const Vector3<double>& needed,
                                          unsigned eligible, bool rubbing, VertexTouch* touches) {
  if (step.count == 1) {
    const double push = eligible != 0 ? larger_of(0.0, dot(touches[0].normal, needed)) : 0.0;
    touches[0].normal_force = push;
    touches[0].holds = push > 0;
    return;
  }
  Vector3<double> normals[most_obstacles], directions[most_obstacles];
  double along[most_obstacles], forces[most_obstacles];
  int those[most_obstacles], count = 0;
  for (int k = 0; k < step.count; ++k) {
    VertexTouch& touch = touches[k];
    touch.holds = false;
    touch.normal_force = 0;
    if ((eligible >> k & 1) == 0) continue;
    normals[count] = directions[count] = touch.normal;
    if (rubbing) directions[count] = touch.normal - step.obstacles[k].friction * touch.slip_direction;
    along[count] = dot(touch.normal, needed);
    those[count++] = k;
  }
  solve_lcp(count, normals, directions, along, forces);
  for (int c = 0; c < count; ++c) {
    touches[those[c]].normal_force = forces[c];
    touches[those[c]].holds = forces[c] > 0;
  }
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
  const Vector3<double> edge = cross(first, second), unit = (1 / norm(edge)) * edge;
  return dot(unit, against) * unit;
}

/// Decides what holds a vertex at `point` that needs the force `needed` [N], as update_contacts says, from
/// its touches there; fills in their forces and slips.
FLASH_HOST_DEVICE inline VertexContact decide_contact(const ObstacleStep<double>& step,
                                                      const Vector3<double>& start,
                                                      const Vector3<double>& point,
                                                      const Vector3<double>& needed, VertexTouch* touches) {
  VertexContact contact;
  unsigned touching = 0;
  int count = 0;
  double longest = 0;
  for (int k = 0; k < step.count; ++k) {
    VertexTouch& touch = touches[k];
    if (!touch.touches()) continue;
    touching |= 1u << k;
    ++count;
    const Vector3<double> slip = along_plane(touch.normal, point - start - touch.surface_moved);
    const double length = norm(slip);
    longest = larger_of(longest, length);
    touch.slip = smooth_length(length);
    touch.slip_direction = (1 / touch.slip) * slip;
  }
  const bool slipped = longest > resting_slip;
  share_force(step, needed, touching, slipped && count > 1, touches);
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
    contact.slip_direction = (1 / smooth_length(norm(slip))) * slip;
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
                 (is_zero(contact.slip_stiffness) ? slip : smooth_length(slip));
  }
  return potential;
}

/// Frees a vertex from the touches that would have to pull, where it needs `force` [N]. Returns whether any
/// touch was released.
FLASH_HOST_DEVICE inline bool release(const ObstacleStep<double>& step, const Vector3<double>& force,
                                      VertexContact& contact, VertexTouch* touches) {
  unsigned held = 0;
  for (int k = 0; k < step.count; ++k) held |= touches[k].holds ? 1u << k : 0;
  share_force(step, force, held, false, touches);
  bool any = false, still_held = false;
  for (int k = 0; k < step.count; ++k) {
    VertexTouch& touch = touches[k];
    const bool gone = (held >> k & 1) != 0 && !touch.holds;
    touch.released = (touch.released || gone) && !touch.holds;
    any = any || gone;
    still_held = still_held || touch.holds;
  }
  if (!any) return false;
  contact.freedom = still_held ? Freedom::slip : Freedom::free;
  contact.free = along_surfaces(step.count, touches);
  contact.correction = contact.correction - contact.free * contact.correction;
  return true;
}

/// Holds a vertex on the touches up to `reach` away that `way` drives it into. Returns whether any touch was
/// added.
FLASH_HOST_DEVICE inline bool hold(int count, const Vector3<double>& way, double reach,
                                   VertexContact& contact, VertexTouch* touches) {
  constexpr double least_depth = 1e-12;  // above rounding [m]
  constexpr double least_inward = 1e-6;  // squared length of the part of a normal that is free
  bool any = false;
  for (int k = 0; k < count; ++k) {
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
    contact.free = along_surfaces(count, touches);
    any = true;
  }
  return any;
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

/// The nearest place out of all obstacles, and on those where the vertex is to land. Exact for planes at
/// once; round surfaces and faces that change take a few rounds.
FLASH_HOST_DEVICE inline Vector3<double> projected_out(const ObstacleStep<double>& step,
                                                       const Vector3<double>& start,
                                                       const VertexTouch* touches, Vector3<double> point) {
  constexpr int rounds = 40;
  if (stays(step, start, point, touches)) return point;
  Vector3<double> normals[most_obstacles];
  double depths[most_obstacles], shares[most_obstacles];
  for (int round = 0; round < rounds; ++round) {
    double moved = 0;
    bool outside = true;
    for (int k = 0; k < step.count; ++k) {
      const SurfaceGap<double> gap = gap_in_step(step, k, start, point);
      normals[k] = gap.normal;
      depths[k] = -gap.distance;
      if (touches != nullptr && lands(touches[k], gap)) {
        point = point - gap.distance * gap.normal;
        moved = larger_of(moved, gap.distance);
        depths[k] = 0;
      }
      outside = outside && depths[k] <= 0;
    }
    if (moved == 0 && outside) break;
    solve_lcp(step.count, normals, normals, depths, shares);
    Vector3<double> way{};
    for (int k = 0; k < step.count; ++k) way = way + shares[k] * normals[k];
    point = point + way;
    if (larger_of(moved, norm(way)) <= resting_slip) break;
  }
  return point;
}

/// The feasible place nearest to a trial `point` of a vertex, by its contact in the linear problem. A slip
/// that turned against its direction is stopped at no slip, where it has to decide again.
FLASH_HOST_DEVICE inline Vector3<double> feasible_place(const ObstacleStep<double>& step,
                                                        const Vector3<double>& start,
                                                        const VertexContact& contact,
                                                        const VertexTouch* touches,
                                                        const Vector3<double>& point) {
  constexpr int rounds = 10;
  Vector3<double> place = projected_out(step, start, touches, point);
  if (contact.freedom != Freedom::slip) return place;
  Vector3<double> slip = slip_against(step, start, place, touches);
  if (dot(slip, contact.slip_direction) >= 0) return place;
  // The way back leaves a round surface: the vertex is projected on it, and the slip taken back again.
  for (int round = 0; round < rounds && norm(slip) > resting_slip; ++round) {
    place = projected_out(step, start, touches, place - slip);
    slip = slip_against(step, start, place, touches);
  }
  return place;
}

}  // namespace FLASH_LEVEL
}  // namespace flash::sim
