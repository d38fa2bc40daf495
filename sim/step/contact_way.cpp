#include "sim/step/contact_way.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace flash::sim {

namespace {

using Eigen::Vector3d;

constexpr double least_facing = 0.1;  ///< cosine between a way and a surface that faces it: 84 degrees

/// Lowers the surface of a vertex that starts `depth` inside.
Gap let_out(Gap gap, double depth, double time_step, const Exit& exit) {
  gap.starts_inside = depth > inside_depth;
  gap.sunk = std::max(0.0, depth - exit.speed * time_step);
  gap.distance += gap.sunk;
  return gap;
}

/// The unit normal of a cylinder's side that faces `way`; zero where none does.
Vector3d side_facing(const Cylinder& cylinder, const Vector3d& way) {
  const Vector3d across = way - cylinder.axis * cylinder.axis.dot(way);
  const double length = across.norm();
  return length > least_facing ? Vector3d(across / length) : Vector3d::Zero();
}

/// The face of a box that faces `way`, given in the frame of the box.
void face_facing(const Vector3d& way, int& axis, double& sign) {
  way.cwiseAbs().maxCoeff(&axis);
  sign = std::copysign(1.0, way[axis]);
}

Gap gap_after_way(const Plane& plane, const ObstacleMotion& motion, const OtherObstacles&,
                  const Vector3d& start, const Vector3d& point, const Vector3d&, double time_step,
                  const Exit& exit) {
  return let_out(gap_to(plane, motion, point), -plane.normal.dot(start - plane.point), time_step, exit);
}

Gap gap_after_way(const Cylinder& cylinder, const ObstacleMotion& motion, const OtherObstacles&,
                  const Vector3d& start, const Vector3d& point, const Vector3d&, double time_step,
                  const Exit& exit) {
  Gap gap = gap_to(cylinder, motion, point);
  const Vector3d from = radial_of(cylinder, start), to = radial_of(cylinder, point), way = to - from;
  // The way enters the circle at the first s with from + s way on its rim, or at once where it starts inside.
  const double a = way.squaredNorm(), b = from.dot(way),
               c = from.squaredNorm() - cylinder.radius * cylinder.radius;
  double entry = 0;
  if (c > 0) {
    const double root = b * b - a * c;
    if (root > 0 && b < 0) entry = (-b - std::sqrt(root)) / a;
    if (!(root > 0 && b < 0) || entry > 1) return gap;
  }
  const Vector3d side = side_facing(cylinder, exit.way);
  if (cylinder.radius - from.norm() > inside_depth && !side.isZero(0)) {
    if (to.norm() >= cylinder.radius) return gap;
    gap.normal = side;
    gap.distance = side.dot(to) - cylinder.radius;
    gap.curvature_direction.setZero();
    return let_out(gap, cylinder.radius - side.dot(from), time_step, exit);
  }
  const Vector3d entered = from + entry * way;
  if (entered.norm() > 0 && entered.dot(to) <= 0) {
    gap.normal = entered.normalized();
    gap.distance = gap.normal.dot(to) - cylinder.radius;
    gap.curvature_direction.setZero();
  }
  return let_out(gap, cylinder.radius - from.norm(), time_step, exit);
}

/// The faces through which a way from `from` to `to` in the frame of a box enters and leaves it.
struct Passage {
  bool enters = false;
  int entry_axis = 0, exit_axis = 0;
  double entry_sign = 1;
  double entry = 0;  ///< share of the way before it
};

/// What starts inside came in by the nearest face, or by the one that faces `way_out` where that is not zero.
/// This direction is in the frame of the box at the start of the step, as in depth_along.
Passage passage_through(const Box& box, const Vector3d& from, const Vector3d& to, const Vector3d& way_out) {
  Passage passage;
  const Vector3d excess = from.cwiseAbs() - box.half_extents;
  double enters = -std::numeric_limits<double>::infinity(), leaves = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    const double way = to[axis] - from[axis];
    if (way == 0) {
      if (excess[axis] > 0) return passage;
      continue;
    }
    const double sign = way > 0 ? -1 : 1;  // of the face that it meets first
    const double in = (sign * box.half_extents[axis] - from[axis]) / way,
                 out = (-sign * box.half_extents[axis] - from[axis]) / way;
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
  if (excess.maxCoeff() <= 0) {
    // A way that starts inside or on a face came in there.
    excess.maxCoeff(&passage.entry_axis);
    passage.entry_sign = std::copysign(1.0, from[passage.entry_axis]);
    if (!way_out.isZero(0) && excess.maxCoeff() < -inside_depth)
      face_facing(way_out, passage.entry_axis, passage.entry_sign);
    enters = 0;
  }
  passage.enters = enters >= 0 && enters <= 1 && enters < leaves;
  passage.entry = enters;
  return passage;
}

/// Distance up to which a way lies in the plane of a face: rounding of poses in files [m].
constexpr double grazing = 1e-6;

/// A way in the frame of a box.
struct LocalWay {
  Vector3d from, to;
  int grazed_axis = -1;  ///< of an open face in whose plane it lies; -1: there is none
};

/// Whether another obstacle covers the face of a box across `axis` where the way comes upon it. The point
/// asked for lies just beyond that face and inside all others.
bool face_is_covered(const Box& box, const ObstacleMotion& motion, const OtherObstacles& others,
                     const LocalWay& way, int axis) {
  const Vector3d inner = (box.half_extents.array() - 2 * grazing).cwiseMax(0.0);
  const Vector3d first = way.from.cwiseMax(-inner).cwiseMin(inner),
                 last = way.to.cwiseMax(-inner).cwiseMin(inner);
  Vector3d beyond = first + 1e-3 * (last - first);
  beyond[axis] = std::copysign(box.half_extents[axis] + grazing, way.from[axis]);
  return others.cover(motion.end * beyond);
}

/// A way in the plane of an open face is taken out of the box there. One that comes from beside a covered
/// face is taken to the middle of the box, where that face does not count. Of two covered faces one counts:
/// the way lies in their edge, not in the box.
LocalWay local_way(const Box& box, const ObstacleMotion& motion, const OtherObstacles& others,
                   const Vector3d& start, const Vector3d& end) {
  LocalWay way{motion.start.inverse(Eigen::Isometry) * start, motion.end.inverse(Eigen::Isometry) * end};
  const LocalWay straight = way;
  bool covered = false;
  const Vector3d excess = way.from.cwiseAbs() - box.half_extents;
  for (int axis = 0; axis < 3; ++axis) {
    const double side = std::copysign(1.0, straight.from[axis]), half = box.half_extents[axis];
    if (std::abs(side * straight.from[axis] - half) > grazing ||
        std::abs(side * straight.to[axis] - half) > grazing)
      continue;
    const bool from_beside = std::max(excess[(axis + 1) % 3], excess[(axis + 2) % 3]) >= -grazing;
    if (!covered && from_beside && face_is_covered(box, motion, others, straight, axis)) {
      covered = true;
      way.from[axis] = way.to[axis] = 0;
    } else {
      way.grazed_axis = axis;
      way.from[axis] = way.to[axis] = side * (half + 2 * grazing);
    }
  }
  return way;
}

/// Whether the way ends over the face that it grazes, or in the box below.
bool ends_at_grazed_face(const Box& box, const LocalWay& way) {
  if (way.grazed_axis < 0) return false;
  Vector3d excess = way.to.cwiseAbs() - box.half_extents;
  excess[way.grazed_axis] = 0;
  return excess.maxCoeff() <= 0;
}

/// The passage of a way through a box that stands beside others. A way that comes by a covered face at the
/// edge of an open one enters by that.
Passage passage_beside(const Box& box, const ObstacleMotion& motion, const OtherObstacles& others,
                       const LocalWay& way, const Vector3d& way_out) {
  if (others.obstacles == nullptr) return passage_through(box, way.from, way.to, way_out);
  // A way along the surface of a neighbour ends on the box, not above it by rounding.
  const Box reached{.half_extents = box.half_extents.array() + 0.5 * grazing};
  const bool starts_inside = (way.from.cwiseAbs() - box.half_extents).maxCoeff() < -inside_depth;
  Passage passage =
      passage_through(reached, way.from, way.to, starts_inside ? way_out : Vector3d(Vector3d::Zero()));
  if (!passage.enters) return passage;
  const Vector3d entered = way.from + passage.entry * (way.to - way.from);
  for (int axis = 0; axis < 3; ++axis) {
    const double side = std::copysign(1.0, entered[axis]), half = box.half_extents[axis];
    if (axis == passage.entry_axis || std::abs(side * entered[axis] - half) > grazing ||
        side * way.from[axis] < half - grazing ||
        !face_is_covered(box, motion, others, way, passage.entry_axis) ||
        face_is_covered(box, motion, others, way, axis))
      continue;
    passage.entry_axis = axis;
    passage.entry_sign = side;
    break;
  }
  return passage;
}

/// Whether a way that enters a box ends in it or behind it.
bool ends_behind_its_entry(const Box& box, const LocalWay& way, const Passage& passage) {
  if (!passage.enters) return false;
  const bool ends_inside = ((way.to.cwiseAbs() - box.half_extents).array() <= 0.5 * grazing).all();
  return ends_inside ||
         (passage.exit_axis == passage.entry_axis &&
          passage.entry_sign * way.to[passage.entry_axis] < -box.half_extents[passage.entry_axis]);
}

Gap gap_after_way(const Box& box, const ObstacleMotion& motion, const OtherObstacles& others,
                  const Vector3d& start, const Vector3d& point, const Vector3d& slid, double time_step,
                  const Exit& exit) {
  const Vector3d local = motion.end.inverse(Eigen::Isometry) * point;
  LocalWay way = local_way(box, motion, others, start, slid);
  if (ends_at_grazed_face(box, way)) {
    const double side = std::copysign(1.0, way.from[way.grazed_axis]);
    const Vector3d from = motion.start.inverse(Eigen::Isometry) * start;
    return let_out(gap_to_face(box, motion, point, way.grazed_axis, side),
                   box.half_extents[way.grazed_axis] - side * from[way.grazed_axis], time_step, exit);
  }
  const Vector3d way_out = motion.start.linear().transpose() * exit.way;
  Passage passage = passage_beside(box, motion, others, way, way_out);
  if (!passage.enters && slid != point) {
    // Beyond the end of the surface that it slid along.
    way = {motion.end.inverse(Eigen::Isometry) * slid, local};
    passage = passage_beside(box, motion, others, way, way_out);
  }
  if (!ends_behind_its_entry(box, way, passage)) return gap_to(box, motion, point);
  const Gap gap = gap_to_face(box, motion, point, passage.entry_axis, passage.entry_sign);
  const double depth =
      box.half_extents[passage.entry_axis] - passage.entry_sign * way.from[passage.entry_axis];
  return let_out(gap, depth, time_step, exit);
}

std::optional<MetSurface> surface_of(const Plane& plane, const ObstacleMotion&, const OtherObstacles&,
                                     const Vector3d& start, const Vector3d& end) {
  const double from = plane.normal.dot(start - plane.point), to = plane.normal.dot(end - plane.point);
  if (from < -inside_depth || to > inside_depth) return {};
  return MetSurface{from <= inside_depth ? 0 : std::min(1.0, from / (from - to)), plane.normal,
                    plane.normal.dot(plane.point)};
}

std::optional<MetSurface> surface_of(const Cylinder&, const ObstacleMotion&, const OtherObstacles&,
                                     const Vector3d&, const Vector3d&) {
  return {};
}

std::optional<MetSurface> surface_of(const Box& box, const ObstacleMotion& motion,
                                     const OtherObstacles& others, const Vector3d& start,
                                     const Vector3d& end) {
  const LocalWay way = local_way(box, motion, others, start, end);
  int axis = way.grazed_axis;
  double sign = axis < 0 ? 0 : std::copysign(1.0, way.from[axis]), entry = 0;
  if (axis < 0) {
    if ((way.from.cwiseAbs() - box.half_extents).maxCoeff() < -inside_depth) return {};
    const Passage passage = passage_beside(box, motion, others, way, Vector3d::Zero());
    if (!passage.enters) return {};
    axis = passage.entry_axis;
    sign = passage.entry_sign;
    entry = passage.entry;
  }
  const Vector3d normal = sign * motion.end.linear().col(axis);
  return MetSurface{entry, normal, normal.dot(motion.end.translation()) + box.half_extents[axis]};
}

}  // namespace

bool OtherObstacles::cover(const Vector3d& point) const {
  if (obstacles == nullptr) return false;
  for (int k = 0; k < static_cast<int>(obstacles->size()); ++k)
    if (k != own && gap_to((*obstacles)[k], (*motions)[k], point).distance < 0) return true;
  return false;
}

std::optional<MetSurface> met_surface(const Obstacle& obstacle, const ObstacleMotion& motion,
                                      const OtherObstacles& others, const Vector3d& start,
                                      const Vector3d& end) {
  return std::visit([&](const auto& shape) { return surface_of(shape, motion, others, start, end); },
                    obstacle.shape);
}

Gap gap_after(const Obstacle& obstacle, const ObstacleMotion& motion, const OtherObstacles& others,
              const Vector3d& start, const Vector3d& point, const Vector3d& slid, double time_step,
              const Exit& exit) {
  return std::visit(
      [&](const auto& shape) {
        return gap_after_way(shape, motion, others, start, point, slid, time_step, exit);
      },
      obstacle.shape);
}

double depth_along(const Obstacle& obstacle, const ObstacleMotion& motion, const Vector3d& start,
                   const Vector3d& way) {
  constexpr double never = std::numeric_limits<double>::infinity();
  if (const auto* plane = std::get_if<Plane>(&obstacle.shape))
    return way.dot(plane->normal) > least_facing ? -plane->normal.dot(start - plane->point) : never;
  if (const auto* cylinder = std::get_if<Cylinder>(&obstacle.shape)) {
    const Vector3d side = side_facing(*cylinder, way);
    return side.isZero(0) ? never : cylinder->radius - side.dot(start - cylinder->point);
  }
  const Box& box = std::get<Box>(obstacle.shape);
  int axis;
  double sign;
  face_facing(motion.start.linear().transpose() * way, axis, sign);
  return box.half_extents[axis] - sign * (motion.start.inverse(Eigen::Isometry) * start)[axis];
}

void lower_to_gaps(const Obstacle& obstacle, const ObstacleMotion& motion, const data::Points& starts,
                   const data::Points& points, double time_step, const Exit& exit,
                   std::vector<double>& distances) {
  std::visit(
      [&](const auto& shape) {
        for (Eigen::Index i = 0; i < points.rows(); ++i)
          distances[i] = std::min(distances[i], gap_after_way(shape, motion, {}, starts.row(i), points.row(i),
                                                              points.row(i), time_step, exit)
                                                    .distance);
      },
      obstacle.shape);
}

}  // namespace flash::sim
