#include "sim/step/moving_obstacles.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <utility>

namespace flash::sim {

using Eigen::Isometry3d;
using Eigen::Vector3d;

namespace {

/// A frame at `origin` whose third axis is `axis`.
Isometry3d frame_along(const Vector3d& origin, const Vector3d& axis) {
  Isometry3d frame = Isometry3d::Identity();
  frame.translation() = origin;
  frame.linear().col(0) = axis.unitOrthogonal();
  frame.linear().col(1) = axis.cross(frame.linear().col(0));
  frame.linear().col(2) = axis;
  return frame;
}

/// Fills in the shape of an obstacle; returns where it stands in the frame that carries it.
Isometry3d describe(const Plane& plane, MovingObstacle<double>& moving) {
  moving.shape = ObstacleShape::plane;
  return frame_along(plane.point, plane.normal);
}
Isometry3d describe(const Box& box, MovingObstacle<double>& moving) {
  moving.shape = ObstacleShape::box;
  moving.half_extents = vector3(box.half_extents);
  return box.pose;
}
Isometry3d describe(const Cylinder& cylinder, MovingObstacle<double>& moving) {
  moving.shape = ObstacleShape::cylinder;
  moving.radius = cylinder.radius;
  return frame_along(cylinder.point, cylinder.axis);
}

Isometry3d describe(const Capsule& capsule, MovingObstacle<double>& moving) {
  moving.shape = ObstacleShape::capsule;
  moving.radius = capsule.radius;
  moving.half_length = capsule.half_length;
  return frame_along(capsule.centre, capsule.axis);
}

Isometry3d describe(const Mesh& mesh, MovingObstacle<double>& moving) {
  moving.shape = ObstacleShape::mesh;
  moving.mesh = mesh.surface.get();
  moving.radius = mesh.margin;
  return mesh.pose;
}

/// The obstacle itself, and where it stands in the frame that carries it.
std::pair<MovingObstacle<double>, Isometry3d> described(const Obstacle& obstacle, double friction) {
  MovingObstacle<double> moving;
  const Isometry3d place =
      std::visit([&](const auto& shape) { return describe(shape, moving); }, obstacle.shape);
  moving.moves = obstacle.frame != base_frame;
  moving.friction = friction_on(obstacle, 0, friction);
  return {moving, place};
}

}  // namespace

bool stand_beside(const std::vector<Obstacle>& obstacles) {
  const auto is_box = [](const Obstacle& obstacle) { return std::holds_alternative<Box>(obstacle.shape); };
  return obstacles.size() > 1 && std::any_of(obstacles.begin(), obstacles.end(), is_box);
}

int surfaces_of(const Obstacle& obstacle) {
  return std::holds_alternative<Mesh>(obstacle.shape) ? most_mesh_surfaces : 1;
}

MovingObstacle<double> obstacle_in_frame(const Obstacle& obstacle, double friction) {
  auto [moving, place] = described(obstacle, friction);
  moving.start = moving.end = frame_of(place);
  return moving;
}

Gap gap_of(const SurfaceGap<double>& gap) {
  return {gap.distance,
          vector3d(gap.normal),
          vector3d(gap.surface_moved),
          vector3d(gap.curvature_direction),
          gap.ball_curvature,
          gap.starts_inside,
          gap.sunk};
}

std::vector<MovingObstacle<double>> moving_obstacles(const Environment& environment, double start,
                                                     double end) {
  std::vector<MovingObstacle<double>> all;
  for (const Obstacle& obstacle : environment.obstacles) {
    auto [moving, place] = described(obstacle, friction_of(environment, 0));
    moving.start = frame_of(moving.moves ? frame_pose(environment, obstacle.frame, start) * place : place);
    moving.end = moving.moves ? frame_of(frame_pose(environment, obstacle.frame, end) * place) : moving.start;
    all.push_back(moving);
  }
  return all;
}

}  // namespace flash::sim
