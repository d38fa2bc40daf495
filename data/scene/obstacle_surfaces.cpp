#include "data/scene/obstacle_surfaces.h"

#include <cmath>
#include <numbers>

#include "data/mesh/obstacle_mesh.h"
#include "data/motion/trajectory.h"

namespace flash::data {
namespace {

using Eigen::Vector3d;

constexpr int kAround = 48, kAlong = 12;  // points of a circle, of a quarter of one
constexpr double kPast = 0.6;             // of the box's diagonal, to each side of its middle

/// Where what has a `pose` without a trajectory stands in its frame.
Eigen::Isometry3d in_frame(const Eigen::Isometry3d& pose, const Trajectory& trajectory) {
  return trajectory.times.empty() ? pose : Eigen::Isometry3d::Identity();
}

TriangleMesh placed(TriangleMesh mesh, const Eigen::Isometry3d& pose) {
  mesh.vertices = (mesh.vertices * pose.linear().transpose()).rowwise() + pose.translation().transpose();
  return mesh;
}

/// A frame whose third axis points along `axis`.
Eigen::Isometry3d along(const Vector3d& axis, const Vector3d& origin) {
  Eigen::Isometry3d frame(Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), axis));
  frame.translation() = origin;
  return frame;
}

/// A surface of revolution about the third axis: rings of `radii` at `heights`.
TriangleMesh turned(const std::vector<double>& radii, const std::vector<double>& heights) {
  const auto rings = static_cast<int>(radii.size());
  TriangleMesh mesh;
  mesh.vertices.resize(rings * kAround, 3);
  mesh.triangles.resize(2 * (rings - 1) * kAround, 3);
  Eigen::Index t = 0;
  for (int ring = 0; ring < rings; ++ring)
    for (int k = 0; k < kAround; ++k) {
      const double angle = 2 * std::numbers::pi * k / kAround, radius = radii[std::size_t(ring)];
      mesh.vertices.row(ring * kAround + k) << radius * std::cos(angle), radius * std::sin(angle),
          heights[std::size_t(ring)];
      if (ring == 0) continue;
      const int above = ring * kAround + k, below = above - kAround, next = (k + 1) % kAround - k;
      mesh.triangles.row(t++) << below, below + next, above + next;
      mesh.triangles.row(t++) << below, above + next, above;
    }
  return mesh;
}

TriangleMesh capsule_surface(double radius, double half_length) {
  std::vector<double> radii, heights;
  for (const int end : {-1, 1})
    for (int k = 0; k <= kAlong; ++k) {
      const double angle = 0.5 * std::numbers::pi * (end < 0 ? k - kAlong : k) / kAlong;
      radii.push_back(radius * std::cos(angle));
      heights.push_back(end * half_length + radius * std::sin(angle));
    }
  return turned(radii, heights);
}

const Trajectory* trajectory_of(const SceneObstacle& obstacle) {
  if (const auto* box = std::get_if<SceneBox>(&obstacle.shape)) return &box->trajectory;
  if (const auto* capsule = std::get_if<SceneCapsule>(&obstacle.shape)) return &capsule->trajectory;
  if (const auto* mesh = std::get_if<SceneMesh>(&obstacle.shape)) return &mesh->trajectory;
  return nullptr;
}

TriangleMesh surface_of(const ScenePlane& plane, const Eigen::AlignedBox3d& about) {
  const double half = kPast * about.diagonal().norm();
  TriangleMesh mesh;
  mesh.vertices.resize(4, 3);
  mesh.vertices << -half, -half, 0, half, -half, 0, half, half, 0, -half, half, 0;
  mesh.triangles.resize(2, 3);
  mesh.triangles << 0, 1, 2, 0, 2, 3;
  const Vector3d middle = about.center();
  return placed(std::move(mesh),
                along(plane.normal, middle - plane.normal.dot(middle - plane.point) * plane.normal));
}

TriangleMesh surface_of(const SceneBox& box, const Eigen::AlignedBox3d& /*about*/) {
  return placed(box_surface(box.size), in_frame(box.pose, box.trajectory));
}

TriangleMesh surface_of(const SceneCylinder& cylinder, const Eigen::AlignedBox3d& about) {
  const double half = kPast * about.diagonal().norm();
  const Vector3d middle = cylinder.point + cylinder.axis.dot(about.center() - cylinder.point) * cylinder.axis;
  return placed(turned({cylinder.radius, cylinder.radius}, {-half, half}), along(cylinder.axis, middle));
}

TriangleMesh surface_of(const SceneCapsule& capsule, const Eigen::AlignedBox3d& /*about*/) {
  return placed(capsule_surface(capsule.radius, capsule.half_length), along(capsule.axis, capsule.point));
}

TriangleMesh surface_of(const SceneMesh& mesh, const Eigen::AlignedBox3d& /*about*/) {
  return placed(load_obstacle_mesh(mesh.file, mesh.scale).mesh, in_frame(mesh.pose, mesh.trajectory));
}

}  // namespace

std::vector<SceneObstacle> colliding(const Scene& scene) {
  std::vector<SceneObstacle> all = scene.obstacles;
  for (const SceneEndEffector& effector : scene.end_effectors)
    if (effector.collides)
      all.push_back({effector.name, SceneBox{effector.size, {}, effector.trajectory}, effector.friction});
  return all;
}

TriangleMesh box_surface(const Vector3d& size) {
  TriangleMesh mesh;
  mesh.vertices.resize(8, 3);
  for (int corner = 0; corner < 8; ++corner)
    for (int axis = 0; axis < 3; ++axis)
      mesh.vertices(corner, axis) = (corner >> axis & 1) != 0 ? 0.5 * size[axis] : -0.5 * size[axis];
  mesh.triangles.resize(12, 3);
  mesh.triangles << 0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4, 2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2,
      1, 3, 7, 1, 7, 5;
  return mesh;
}

TriangleMesh obstacle_surface(const SceneObstacle& obstacle, const Eigen::AlignedBox3d& about) {
  return std::visit([&](const auto& shape) { return surface_of(shape, about); }, obstacle.shape);
}

std::vector<TriangleMesh> obstacle_surfaces(const Scene& scene, double time,
                                            const Eigen::AlignedBox3d& about) {
  std::vector<TriangleMesh> surfaces;
  for (const SceneObstacle& obstacle : colliding(scene)) {
    surfaces.push_back(obstacle_surface(obstacle, about));
    const Trajectory* trajectory = trajectory_of(obstacle);
    if (trajectory && !trajectory->times.empty())
      surfaces.back() = placed(std::move(surfaces.back()), pose_at(*trajectory, time));
  }
  return surfaces;
}

}  // namespace flash::data
