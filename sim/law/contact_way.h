#pragma once
#include "sim/law/gap.h"

namespace flash::sim {
inline namespace FLASH_LEVEL {

/// Depth from which a vertex counts as inside an obstacle at the start of a step, above rounding [m].
inline constexpr double inside_depth = 1e-9;

/// Cosine between a way and a surface that faces it: 84 degrees.
inline constexpr double least_facing = 0.1;

/// Distance up to which a way lies in the plane of a face: rounding of poses in files [m].
inline constexpr double grazing = 1e-6;

/// Stands for a side that is not there, and for a way that is never met [m].
inline constexpr double no_such_side = 1e300;

/// How vertices that start a step inside an obstacle come out of it.
template <typename Real>
struct WayOut {
  Real speed{};  ///< greatest speed [m/s]; 0: vertices may stay, no deeper
  /// Unit direction in which vertices leave each obstacle; zero: each leaves by the side nearest to it.
  Vector3<Real> direction{};
};

template <typename Real>
FLASH_HOST_DEVICE inline bool is_zero(const Vector3<Real>& v) {
  return v.x == 0 && v.y == 0 && v.z == 0;
}

/// The other obstacles of a step, as one of them sees them; none by default.
template <typename Real>
struct OtherObstacles {
  const MovingObstacle<Real>* obstacles = nullptr;
  int count = 0;
  int own = -1;

  /// Whether one of them covers `point` at the end of the step, or comes so close that a seam of two of them
  /// is covered [m].
  FLASH_HOST_DEVICE bool cover(const Vector3<Real>& point) const {
    for (int k = 0; k < count; ++k)
      if (k != own && gap_to(obstacles[k], point).distance < Real(0.5 * grazing)) return true;
    return false;
  }
};

/// How far the surface of a vertex that starts `depth` inside is lowered [m].
template <typename Real>
FLASH_HOST_DEVICE inline Real sunk_of(Real depth, Real time_step, const WayOut<Real>& way_out) {
  return larger_of(depth - way_out.speed * time_step, Real(0));
}

/// Lowers the surface of a vertex that starts `depth` inside.
template <typename Real>
FLASH_HOST_DEVICE inline SurfaceGap<Real> let_out(SurfaceGap<Real> gap, Real depth, Real time_step,
                                                  const WayOut<Real>& way_out) {
  gap.starts_inside = depth > inside_depth;
  gap.sunk = sunk_of(depth, time_step, way_out);
  gap.distance += gap.sunk;
  return gap;
}

/// The unit normal of a cylinder's side that faces `way`, both in its frame; zero where none does.
template <typename Real>
FLASH_HOST_DEVICE inline Vector3<Real> side_facing(const Vector3<Real>& way) {
  const Vector3<Real> across{way.x, way.y, 0};
  const Real length = norm(across);
  return length > least_facing ? (1 / length) * across : Vector3<Real>{};
}

/// The faces through which a way in the frame of a box enters and leaves it.
template <typename Real>
struct Passage {
  bool enters = false;
  int entry_axis = 0, exit_axis = 0;
  Real entry_sign = 1;
  Real entry = 0;  ///< share of the way before it
};

/// The passage of a way from `from` to `to`. What starts inside came in by the nearest face, or by the one
/// that faces `way_out` where that is not zero; it is in the frame of the box at the start of the step.
template <typename Real>
FLASH_HOST_DEVICE inline Passage<Real> passage_through(const Vector3<Real>& half_extents,
                                                       const Vector3<Real>& from, const Vector3<Real>& to,
                                                       const Vector3<Real>& way_out) {
  Passage<Real> passage;
  const Vector3<Real> excess = excess_over(half_extents, from);
  Real enters = -no_such_side, leaves = no_such_side;
  for (int axis = 0; axis < 3; ++axis) {
    const Real way = to[axis] - from[axis];
    if (way == 0) {
      if (excess[axis] > 0) return passage;
      continue;
    }
    const Real sign = way > 0 ? -1 : 1;  // of the face that it meets first
    const Real in = (sign * half_extents[axis] - from[axis]) / way,
               out = (-sign * half_extents[axis] - from[axis]) / way;
    if (in > enters) {
      enters = in;
      passage.entry_axis = axis;
      passage.entry_sign = sign;
    }
    if (out < leaves) {
      leaves = out;
      passage.exit_axis = axis;
    }
  }
  const int nearest = largest_axis(excess);
  if (excess[nearest] <= 0) {
    // A way that starts inside or on a face came in there.
    const bool leaves_by_way_out = !is_zero(way_out) && excess[nearest] < -inside_depth;
    const Vector3<Real>& by = leaves_by_way_out ? way_out : from;
    passage.entry_axis = leaves_by_way_out
                             ? largest_axis(Vector3<Real>{magnitude(by.x), magnitude(by.y), magnitude(by.z)})
                             : nearest;
    passage.entry_sign = with_sign(Real(1), by[passage.entry_axis]);
    enters = 0;
  }
  passage.enters = enters >= 0 && enters <= 1 && enters < leaves;
  passage.entry = enters;
  return passage;
}

/// A way in the frame of a box.
template <typename Real>
struct LocalWay {
  Vector3<Real> from, to;
  int grazed_axis = -1;  ///< of an open face in whose plane it lies; -1: there is none
};

/// Axes of a box, or of its faces that a way meets.
struct Axes {
  bool in[3] = {false, false, false};

  FLASH_HOST_DEVICE Axes with(int axis) const {
    Axes more = *this;
    more.in[axis] = true;
    return more;
  }
};

/// Whether another obstacle covers what lies just beyond the faces of a box across `axes`, on the side of the
/// start of the way, where the way comes upon them.
template <typename Real>
FLASH_HOST_DEVICE inline bool is_covered_beyond(const MovingObstacle<Real>& box,
                                                const OtherObstacles<Real>& others, const LocalWay<Real>& way,
                                                const Axes& axes) {
  Vector3<Real> beyond{};
  for (int k = 0; k < 3; ++k) {
    const Real inner = larger_of(Real(0), box.half_extents[k] - 2 * grazing);
    const auto inside = [&](Real x) { return x > inner ? inner : x < -inner ? -inner : x; };
    const Real first = inside(way.from[k]);
    beyond[k] = axes.in[k] ? with_sign(box.half_extents[k] + Real(grazing), way.from[k])
                           : first + Real(1e-3) * (inside(way.to[k]) - first);
  }
  return others.cover(place_from(box.end, beyond));
}

template <typename Real>
FLASH_HOST_DEVICE inline bool face_is_covered(const MovingObstacle<Real>& box,
                                              const OtherObstacles<Real>& others, const LocalWay<Real>& way,
                                              int axis) {
  return is_covered_beyond(box, others, way, Axes{}.with(axis));
}

/// Whether others fill all that is about the corner between the box and the faces across `covered` and
/// `axis`; they do without `axis`.
template <typename Real>
FLASH_HOST_DEVICE inline bool is_filled_about(const MovingObstacle<Real>& box,
                                              const OtherObstacles<Real>& others, const LocalWay<Real>& way,
                                              const Axes& covered, int axis) {
  const int a = (axis + 1) % 3, b = (axis + 2) % 3;
  const Axes alone = Axes{}.with(axis);
  return is_covered_beyond(box, others, way, alone) &&
         (!covered.in[a] || is_covered_beyond(box, others, way, alone.with(a))) &&
         (!covered.in[b] || is_covered_beyond(box, others, way, alone.with(b)));
}

/// The way of a vertex in the frame of a box. One in the plane of an open face is taken out of the box there.
/// One that comes from beside covered faces is taken to the middle of the box, where they do not count. Where
/// the corner between two of them is open, one counts: the way lies in their edge, not in the boxes.
template <typename Real>
FLASH_HOST_DEVICE inline LocalWay<Real> local_way(const MovingObstacle<Real>& box,
                                                  const OtherObstacles<Real>& others,
                                                  const Vector3<Real>& start, const Vector3<Real>& end) {
  LocalWay<Real> way{place_in(box.start, start), place_in(box.end, end)};
  const LocalWay<Real> straight = way;
  Axes covered;
  const Vector3<Real> excess = excess_over(box.half_extents, way.from);
  for (int axis = 0; axis < 3; ++axis) {
    const Real side = with_sign(Real(1), straight.from[axis]), half = box.half_extents[axis];
    if (magnitude(side * straight.from[axis] - half) > grazing ||
        magnitude(side * straight.to[axis] - half) > grazing)
      continue;
    const int a = (axis + 1) % 3, b = (axis + 2) % 3;
    const bool from_beside =
        (!covered.in[a] && excess[a] >= -grazing) || (!covered.in[b] && excess[b] >= -grazing);
    if (from_beside && is_filled_about(box, others, straight, covered, axis)) {
      covered = covered.with(axis);
      way.from[axis] = way.to[axis] = 0;
    } else {
      way.grazed_axis = axis;
      way.from[axis] = way.to[axis] = side * (half + 2 * Real(grazing));
    }
  }
  return way;
}

/// Whether the way ends over the face that it grazes, or in the box below.
template <typename Real>
FLASH_HOST_DEVICE inline bool ends_at_grazed_face(const MovingObstacle<Real>& box,
                                                  const LocalWay<Real>& way) {
  if (way.grazed_axis < 0) return false;
  Vector3<Real> excess = excess_over(box.half_extents, way.to);
  excess[way.grazed_axis] = 0;
  return largest(excess) <= 0;
}

/// The passage of a way through a box that stands beside others. A way that comes by a covered face at the
/// edge of an open one enters by that.
template <typename Real>
FLASH_HOST_DEVICE inline Passage<Real> passage_beside(const MovingObstacle<Real>& box,
                                                      const OtherObstacles<Real>& others,
                                                      const LocalWay<Real>& way,
                                                      const Vector3<Real>& way_out) {
  if (others.obstacles == nullptr) return passage_through(box.half_extents, way.from, way.to, way_out);
  // A way along the surface of a neighbour ends on the box, not above it by rounding.
  const Real room = Real(0.5 * grazing);
  const Vector3<Real> reached = box.half_extents + Vector3<Real>{room, room, room};
  const bool starts_inside = largest(excess_over(box.half_extents, way.from)) < -inside_depth;
  Passage<Real> passage =
      passage_through(reached, way.from, way.to, starts_inside ? way_out : Vector3<Real>{});
  if (!passage.enters) return passage;
  const Vector3<Real> entered = way.from + passage.entry * (way.to - way.from);
  for (int axis = 0; axis < 3; ++axis) {
    const Real side = with_sign(Real(1), entered[axis]), half = box.half_extents[axis];
    if (axis == passage.entry_axis || magnitude(side * entered[axis] - half) > grazing ||
        side * way.from[axis] < half - grazing || !face_is_covered(box, others, way, passage.entry_axis) ||
        face_is_covered(box, others, way, axis))
      continue;
    passage.entry_axis = axis;
    passage.entry_sign = side;
    break;
  }
  return passage;
}

/// Whether a way that enters a box ends in it or behind it.
template <typename Real>
FLASH_HOST_DEVICE inline bool ends_behind_its_entry(const MovingObstacle<Real>& box,
                                                    const LocalWay<Real>& way, const Passage<Real>& passage) {
  if (!passage.enters) return false;
  const bool ends_inside = largest(excess_over(box.half_extents, way.to)) <= Real(0.5 * grazing);
  return ends_inside ||
         (passage.exit_axis == passage.entry_axis &&
          passage.entry_sign * way.to[passage.entry_axis] < -box.half_extents[passage.entry_axis]);
}

// The parts of gap_after for each shape.

template <typename Real>
FLASH_HOST_DEVICE inline SurfaceGap<Real> gap_after_plane(const MovingObstacle<Real>& plane,
                                                          const Vector3<Real>& start,
                                                          const Vector3<Real>& point, Real time_step,
                                                          const WayOut<Real>& way_out) {
  const SurfaceGap<Real> gap = gap_to_plane(plane, point);
  return let_out(gap, -dot(plane.start.z, start - plane.start.origin), time_step, way_out);
}

/// The share of a way after which it first comes within `radius` of the origin: 0 where it starts there,
/// no_such_side where it never does. `from`, `way`: across the axis for a cylinder.
template <typename Real>
FLASH_HOST_DEVICE inline Real entry_into_round(const Vector3<Real>& from, const Vector3<Real>& way,
                                               const Real& radius) {
  const Real a = dot(way, way), b = dot(from, way), c = dot(from, from) - radius * radius;
  if (!(c > 0)) return 0;
  const Real root = b * b - a * c;
  if (!(root > 0 && b < 0)) return no_such_side;
  return (-b - square_root(root)) / a;
}

template <typename Real>
FLASH_CALLED_ON_DEVICE inline SurfaceGap<Real> gap_after_cylinder(const MovingObstacle<Real>& cylinder,
                                                                  const Vector3<Real>& start,
                                                                  const Vector3<Real>& point, Real time_step,
                                                                  const WayOut<Real>& way_out) {
  SurfaceGap<Real> gap = gap_to(cylinder, point);
  Vector3<Real> from = place_in(cylinder.start, start), to = place_in(cylinder.end, point);
  from.z = to.z = 0;
  const Vector3<Real> way = to - from;
  const Real radius = cylinder.radius;
  const Real entry = entry_into_round(from, way, radius);
  if (entry > 1) return gap;
  const auto stand_against = [&](const Vector3<Real>& normal) {
    gap.normal = direction_from(cylinder.end, normal);
    gap.distance = dot(normal, to) - radius;
    gap.curvature_direction = {};
  };
  const Vector3<Real> side = side_facing(direction_in(cylinder.start, way_out.direction));
  if (radius - norm(from) > inside_depth && !is_zero(side)) {
    if (norm(to) >= radius) return gap;
    stand_against(side);
    return let_out(gap, radius - dot(side, from), time_step, way_out);
  }
  const Vector3<Real> entered = from + entry * way;
  const Real length = norm(entered);
  if (length > 0 && dot(entered, to) <= 0) stand_against((1 / length) * entered);
  return let_out(gap, radius - norm(from), time_step, way_out);
}

/// The share of a way in the frame of a capsule after which it enters its side or one of its ends: 0 where it
/// starts inside, no_such_side where it does not enter.
template <typename Real>
FLASH_HOST_DEVICE inline Real entry_into_capsule(const MovingObstacle<Real>& capsule,
                                                 const Vector3<Real>& from, const Vector3<Real>& way) {
  const Real end = capsule.half_length, radius = capsule.radius;
  Real entry = entry_into_round(Vector3<Real>{from.x, from.y, 0}, Vector3<Real>{way.x, way.y, 0}, radius);
  if (magnitude(from.z + entry * way.z) > end) entry = no_such_side;
  for (int side = -1; side <= 1; side += 2) {
    const Real own = entry_into_round(from - Vector3<Real>{0, 0, side * end}, way, radius);
    if (own < entry) entry = own;
  }
  return entry;
}

/// Distance of a capsule's tangent plane across `normal` from its middle, both in its frame.
template <typename Real>
FLASH_HOST_DEVICE inline Real tangent_offset(const MovingObstacle<Real>& capsule,
                                             const Vector3<Real>& normal) {
  return capsule.half_length * magnitude(normal.z) + capsule.radius;
}

template <typename Real>
FLASH_CALLED_ON_DEVICE inline SurfaceGap<Real> gap_after_capsule(const MovingObstacle<Real>& capsule,
                                                                 const Vector3<Real>& start,
                                                                 const Vector3<Real>& point, Real time_step,
                                                                 const WayOut<Real>& way_out) {
  SurfaceGap<Real> gap = gap_to(capsule, point);
  const Vector3<Real> from = place_in(capsule.start, start), to = place_in(capsule.end, point),
                      way = to - from;
  const Real entry = entry_into_capsule(capsule, from, way);
  if (entry > 1) return gap;
  const auto stand_against = [&](const Vector3<Real>& normal, Real distance) {
    gap.normal = direction_from(capsule.end, normal);
    gap.distance = distance;
    gap.curvature_direction = {};
    gap.ball_curvature = 0;
  };
  const Real depth = capsule.radius - norm(from - nearest_on_axis(capsule, from));
  if (depth > inside_depth && !is_zero(way_out.direction)) {
    if (gap.distance >= 0) return gap;
    const Vector3<Real> side = direction_in(capsule.start, way_out.direction);
    const Real offset = tangent_offset(capsule, side);
    stand_against(side, dot(side, to) - offset);
    return let_out(gap, offset - dot(side, from), time_step, way_out);
  }
  const Vector3<Real> entered = from + entry * way, middle = nearest_on_axis(capsule, entered),
                      out = entered - middle;
  const Real length = norm(out), height = dot(out, to - middle);
  if (length > 0 && height <= 0) stand_against((1 / length) * out, height / length - capsule.radius);
  return let_out(gap, depth, time_step, way_out);
}

template <typename Real>
FLASH_CALLED_ON_DEVICE inline SurfaceGap<Real> gap_after_box(
    const MovingObstacle<Real>& box, const OtherObstacles<Real>& others, const Vector3<Real>& start,
    const Vector3<Real>& point, const Vector3<Real>& slid, Real time_step, const WayOut<Real>& way_out) {
  LocalWay<Real> way = local_way(box, others, start, slid);
  if (ends_at_grazed_face(box, way)) {
    const int axis = way.grazed_axis;
    const Real side = with_sign(Real(1), way.from[axis]);
    return let_out(gap_to_face(box, point, axis, side),
                   box.half_extents[axis] - side * place_in(box.start, start)[axis], time_step, way_out);
  }
  const Vector3<Real> out = direction_in(box.start, way_out.direction);
  Passage<Real> passage = passage_beside(box, others, way, out);
  if (!passage.enters && !is_zero(slid - point)) {
    // Beyond the end of the surface that it slid along.
    way = {place_in(box.end, slid), place_in(box.end, point)};
    passage = passage_beside(box, others, way, out);
  }
  if (!ends_behind_its_entry(box, way, passage)) return gap_to(box, point);
  const SurfaceGap<Real> gap = gap_to_face(box, point, passage.entry_axis, passage.entry_sign);
  const Real depth = box.half_extents[passage.entry_axis] - passage.entry_sign * way.from[passage.entry_axis];
  return let_out(gap, depth, time_step, way_out);
}

/// Those of meshes stand in sim/law/mesh_gap.
SurfaceGap<double> gap_after_mesh(const MovingObstacle<double>& obstacle, const Vector3<double>& start,
                                  const Vector3<double>& point, double time_step,
                                  const WayOut<double>& way_out);
double depth_along_mesh(const MovingObstacle<double>& obstacle, const Vector3<double>& start,
                        const Vector3<double>& way);

/// How a vertex that comes from `start` [m] at the start of the step stands at `point` at its end. The way
/// between them is straight, seen from the obstacle:
/// - a point in a box, or behind it, stands against the face through which its way entered; one behind the
///   axis of a cylinder or a capsule against the tangent plane where its way entered. So nothing passes
///   through, however thin. A way that leaves a box by a face beside rounds its edge and is released.
/// - a way in the plane of a face, to within a micrometre, belongs to that face. Where another obstacle
///   covers it, it is no surface: the way enters by the face that it crosses.
/// - a vertex that meets other surfaces before slides along them: `slid` is where its way would end so,
///   `point` where it meets none. That way decides which face of a box it meets, so that it slides over boxes
///   that stand flush.
/// - a vertex that starts inside stands against a surface below the obstacle's own (`sunk`), so that it comes
///   out as `way_out` says.
template <typename Real>
FLASH_HOST_DEVICE inline SurfaceGap<Real> gap_after(const MovingObstacle<Real>& obstacle,
                                                    const OtherObstacles<Real>& others,
                                                    const Vector3<Real>& start, const Vector3<Real>& point,
                                                    const Vector3<Real>& slid, Real time_step,
                                                    const WayOut<Real>& way_out) {
  if (obstacle.shape == ObstacleShape::plane)
    return gap_after_plane(obstacle, start, point, time_step, way_out);
  if (obstacle.shape == ObstacleShape::cylinder)
    return gap_after_cylinder(obstacle, start, point, time_step, way_out);
  if (obstacle.shape == ObstacleShape::capsule)
    return gap_after_capsule(obstacle, start, point, time_step, way_out);
  if constexpr (meets_meshes<Real>)
    if (obstacle.shape == ObstacleShape::mesh)
      return gap_after_mesh(obstacle, start, point, time_step, way_out);
  return gap_after_box(obstacle, others, start, point, slid, time_step, way_out);
}

/// A flat surface that the way of a vertex meets: normal . x >= offset outside, at the end of the step.
template <typename Real>
struct MetSurface {
  bool met = false;
  Real entry{};  ///< share of the way before it; 0: the vertex starts on it
  Vector3<Real> normal{};
  Real offset{};  ///< [m]
};

/// The surface of a plane or a box that the straight way from `start` to `end`, seen from the obstacle,
/// meets, also where it ends on it or leaves it by an edge beside. None for all others, and where the way
/// starts inside.
template <typename Real>
FLASH_HOST_DEVICE inline MetSurface<Real> met_surface(const MovingObstacle<Real>& obstacle,
                                                      const OtherObstacles<Real>& others,
                                                      const Vector3<Real>& start, const Vector3<Real>& end) {
  if (obstacle.shape != ObstacleShape::plane && obstacle.shape != ObstacleShape::box) return {};
  if (obstacle.shape == ObstacleShape::plane) {
    const Real from = dot(obstacle.start.z, start - obstacle.start.origin),
               to = dot(obstacle.end.z, end - obstacle.end.origin);
    if (from < -inside_depth || to > inside_depth) return {};
    const Real share = from / (from - to);
    return {true,
            from <= inside_depth ? Real(0)
            : share < 1          ? share
                                 : Real(1),
            obstacle.end.z, dot(obstacle.end.z, obstacle.end.origin)};
  }
  const LocalWay<Real> way = local_way(obstacle, others, start, end);
  int axis = way.grazed_axis;
  Real sign = axis < 0 ? Real(0) : with_sign(Real(1), way.from[axis]), entry = 0;
  if (axis < 0) {
    if (largest(excess_over(obstacle.half_extents, way.from)) < -inside_depth) return {};
    const Passage<Real> passage = passage_beside(obstacle, others, way, Vector3<Real>{});
    if (!passage.enters) return {};
    axis = passage.entry_axis;
    sign = passage.entry_sign;
    entry = passage.entry;
  }
  const Vector3<Real> normal = sign * obstacle.end.axis(axis);
  return {true, entry, normal, dot(normal, obstacle.end.origin) + obstacle.half_extents[axis]};
}

/// How far a vertex at `start` is inside the obstacle below the side that faces `way`, at the start of the
/// step [m]; no_such_side where there is none.
template <typename Real>
FLASH_HOST_DEVICE inline Real depth_along(const MovingObstacle<Real>& obstacle, const Vector3<Real>& start,
                                          const Vector3<Real>& way) {
  if constexpr (meets_meshes<Real>)
    if (obstacle.shape == ObstacleShape::mesh) return depth_along_mesh(obstacle, start, way);
  const Vector3<Real> local = place_in(obstacle.start, start),
                      local_direction = direction_in(obstacle.start, way);
  if (obstacle.shape == ObstacleShape::plane)
    return local_direction.z > least_facing ? -local.z : Real(no_such_side);
  if (obstacle.shape == ObstacleShape::cylinder) {
    const Vector3<Real> side = side_facing(local_direction);
    return is_zero(side) ? Real(no_such_side) : obstacle.radius - dot(side, local);
  }
  if (obstacle.shape == ObstacleShape::capsule)
    return tangent_offset(obstacle, local_direction) - dot(local_direction, local);
  const int axis = largest_axis(Vector3<Real>{magnitude(local_direction.x), magnitude(local_direction.y),
                                              magnitude(local_direction.z)});
  return obstacle.half_extents[axis] - with_sign(Real(1), local_direction[axis]) * local[axis];
}

}  // namespace FLASH_LEVEL
}  // namespace flash::sim
