#include "sim/step/contact_geometry.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace flash::sim {

namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr double least_facing = 0.1;  ///< cosine between a way and a surface that faces it: 84 degrees

Gap gap_of(const Plane& plane, const ObstacleMotion&, const Vector3d& point) {
  return {plane.normal.dot(point - plane.point), plane.normal, Vector3d::Zero(), Vector3d::Zero()};
}

/// Vector from the axis to the point, perpendicular to the axis.
Vector3d radial_of(const Cylinder& cylinder, const Vector3d& point) {
  const Vector3d radial = point - cylinder.point;
  return radial - cylinder.axis * cylinder.axis.dot(radial);
}

Gap gap_of(const Cylinder& cylinder, const ObstacleMotion&, const Vector3d& point) {
  const Vector3d radial = radial_of(cylinder, point);
  const double length = radial.norm();
  if (length == 0)
    return {-cylinder.radius, cylinder.axis.unitOrthogonal(), Vector3d::Zero(), Vector3d::Zero()};
  const Vector3d normal = radial / length;
  return {length - cylinder.radius, normal, Vector3d::Zero(),
          cylinder.axis.cross(normal) / std::sqrt(length)};
}

/// How far the material of a box at `point` has moved in the step.
Vector3d moved_by(const ObstacleMotion& motion, const Vector3d& point, const Vector3d& local) {
  return motion.moves ? Vector3d(point - motion.start * local) : Vector3d::Zero();
}

/// Gap to the face of a box across `axis`, on the side of `sign`.
Gap gap_to_face(const Box& box, const ObstacleMotion& motion, const Vector3d& point, const Vector3d& local,
                int axis, double sign) {
  return {sign * local[axis] - box.half_extents[axis], sign * motion.end.linear().col(axis),
          moved_by(motion, point, local), Vector3d::Zero()};
}

Gap gap_of(const Box& box, const ObstacleMotion& motion, const Vector3d& point) {
  const Vector3d local = motion.end.inverse(Eigen::Isometry) * point;
  const Vector3d excess = local.cwiseAbs() - box.half_extents;
  if (excess.maxCoeff() <= 0) {
    int axis;
    excess.maxCoeff(&axis);
    return gap_to_face(box, motion, point, local, axis, std::copysign(1.0, local[axis]));
  }
  const Vector3d outside = excess.cwiseMax(0.0).cwiseProduct(local.cwiseSign());
  const double distance = outside.norm();
  return {distance, motion.end.linear() * (outside / distance), moved_by(motion, point, local),
          Vector3d::Zero()};
}

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

Gap gap_after_way(const Plane& plane, const ObstacleMotion& motion, const Vector3d& start,
                  const Vector3d& point, const Vector3d&, double time_step, const Exit& exit) {
  return let_out(gap_of(plane, motion, point), -plane.normal.dot(start - plane.point), time_step, exit);
}

Gap gap_after_way(const Cylinder& cylinder, const ObstacleMotion& motion, const Vector3d& start,
                  const Vector3d& point, const Vector3d&, double time_step, const Exit& exit) {
  Gap gap = gap_of(cylinder, motion, point);
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
  return passage;
}

/// Moves a grazing way out of the box at a face that looks up. At one that looks down moves it into the box,
/// if the way begins at another face or outside. Grazing: in the plane of the face, to within rounding.
/// Returns the axis of the face that looks up, or -1.
int decide_grazing(const Box& box, const Vector3d& down, Vector3d& from, Vector3d& to) {
  constexpr double grazing = 1e-9;  // [m]
  constexpr double level = 0.5;     // cosine between the vertical and a face that looks up or down
  int upper = -1;
  const Vector3d excess = from.cwiseAbs() - box.half_extents;
  for (int axis = 0; axis < 3; ++axis) {
    const double side = std::copysign(1.0, from[axis]);
    const auto grazes = [&](double x) { return std::abs(side * x - box.half_extents[axis]) <= grazing; };
    if (std::abs(down[axis]) < level || !grazes(from[axis]) || !grazes(to[axis])) continue;
    const bool looks_down = side * down[axis] > 0;
    const bool beside = excess[(axis + 1) % 3] >= -grazing || excess[(axis + 2) % 3] >= -grazing;
    if (looks_down && !beside) continue;
    if (!looks_down) upper = axis;
    const double decided = side * (box.half_extents[axis] + (looks_down ? -2 : 2) * grazing);
    from[axis] = to[axis] = decided;
  }
  return upper;
}

Gap gap_after_way(const Box& box, const ObstacleMotion& motion, const Vector3d& start, const Vector3d& point,
                  const Vector3d& slid, double time_step, const Exit& exit) {
  Vector3d from = motion.start.inverse(Eigen::Isometry) * start;
  const Vector3d local = motion.end.inverse(Eigen::Isometry) * point;
  Vector3d to = motion.end.inverse(Eigen::Isometry) * slid;
  const int upper = decide_grazing(box, motion.end.linear().transpose() * motion.down, from, to);
  if (upper >= 0) {
    const Gap gap = gap_to_face(box, motion, point, local, upper, std::copysign(1.0, from[upper]));
    Vector3d above = local.cwiseAbs() - box.half_extents;
    above[upper] = gap.distance;
    if (above.maxCoeff() <= 0) return gap;
  }
  const Passage passage = passage_through(box, from, to, motion.start.linear().transpose() * exit.way);
  if (!passage.enters) return gap_of(box, motion, point);
  const bool ends_inside = ((to.cwiseAbs() - box.half_extents).array() <= 0).all();
  const bool behind = passage.exit_axis == passage.entry_axis &&
                      passage.entry_sign * to[passage.entry_axis] < -box.half_extents[passage.entry_axis];
  if (!ends_inside && !behind) return gap_of(box, motion, point);
  const Gap gap = gap_to_face(box, motion, point, local, passage.entry_axis, passage.entry_sign);
  const double depth = box.half_extents[passage.entry_axis] - passage.entry_sign * from[passage.entry_axis];
  return let_out(gap, depth, time_step, exit);
}

ObstacleMotion motion_of(const Obstacle& obstacle, double start, double end) {
  ObstacleMotion motion;
  const Box* box = std::get_if<Box>(&obstacle.shape);
  if (box == nullptr) return motion;
  motion.moves = !box->trajectory.times.empty();
  motion.start = motion.moves ? data::pose_at(box->trajectory, start) : box->pose;
  motion.end = motion.moves ? data::pose_at(box->trajectory, end) : box->pose;
  return motion;
}

}  // namespace

std::vector<ObstacleMotion> obstacle_motions(const Environment& environment, double start, double end) {
  std::vector<ObstacleMotion> motions;
  const double gravity = environment.gravity.norm();
  for (const Obstacle& obstacle : environment.obstacles) {
    motions.push_back(motion_of(obstacle, start, end));
    if (gravity > 0) motions.back().down = environment.gravity / gravity;
  }
  return motions;
}

Gap gap_to(const Obstacle& obstacle, const ObstacleMotion& motion, const Vector3d& point) {
  return std::visit([&](const auto& shape) { return gap_of(shape, motion, point); }, obstacle.shape);
}

Gap gap_at_start(const Obstacle& obstacle, const ObstacleMotion& motion, const Vector3d& point) {
  ObstacleMotion still = motion;
  still.end = still.start;
  return gap_to(obstacle, still, point);
}

Gap gap_after(const Obstacle& obstacle, const ObstacleMotion& motion, const Vector3d& start,
              const Vector3d& point, const Vector3d& slid, double time_step, const Exit& exit) {
  return std::visit(
      [&](const auto& shape) { return gap_after_way(shape, motion, start, point, slid, time_step, exit); },
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
          distances[i] = std::min(distances[i], gap_after_way(shape, motion, starts.row(i), points.row(i),
                                                              points.row(i), time_step, exit)
                                                    .distance);
      },
      obstacle.shape);
}

}  // namespace flash::sim
