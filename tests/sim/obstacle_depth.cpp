#include "tests/sim/obstacle_depth.h"

#include <algorithm>

#include "sim/law/surface_mesh.h"
#include "tests/sim/brute_surface.h"

namespace flash::sim {

using Eigen::Isometry3d;
using Eigen::Vector3d;

data::TriangleMesh triangles_of(const SurfaceMesh& surface) {
  data::TriangleMesh mesh;
  mesh.vertices.resize(3 * surface.size(), 3);
  mesh.triangles.resize(surface.size(), 3);
  for (int t = 0; t < surface.size(); ++t)
    for (int k = 0; k < 3; ++k) {
      const Vector3<double>& corner = surface.triangles[static_cast<std::size_t>(t)].corners[k];
      mesh.vertices.row(3 * t + k) << corner.x, corner.y, corner.z;
      mesh.triangles(t, k) = 3 * t + k;
    }
  return mesh;
}

namespace {

/// Of all triangles, one by one.
double depth_in_mesh(const SurfaceMesh& surface, double margin, const Vector3d& point) {
  const data::TriangleMesh mesh = triangles_of(surface);
  const double distance = brute_distance(mesh, point);
  const bool inside = surface.closed && brute_winding(mesh, point) > 0.5;
  return margin + (inside ? distance : -distance);
}

}  // namespace

double depth_in(const Environment& environment, const Obstacle& obstacle, const Vector3d& point,
                double time) {
  if (const auto* plane = std::get_if<Plane>(&obstacle.shape))
    return -plane->normal.dot(point - plane->point);
  if (const auto* cylinder = std::get_if<Cylinder>(&obstacle.shape))
    return cylinder->radius - (point - cylinder->point).cross(cylinder->axis).norm();
  if (const auto* capsule = std::get_if<Capsule>(&obstacle.shape)) {
    const Vector3d out = frame_pose(environment, obstacle.frame, time).inverse() * point - capsule->centre;
    const double along = std::clamp(out.dot(capsule->axis), -capsule->half_length, capsule->half_length);
    return capsule->radius - (out - along * capsule->axis).norm();
  }
  if (const auto* mesh = std::get_if<Mesh>(&obstacle.shape)) {
    const Isometry3d pose = frame_pose(environment, obstacle.frame, time) * mesh->pose;
    return depth_in_mesh(*mesh->surface, mesh->margin, pose.inverse() * point);
  }
  const Box& box = std::get<Box>(obstacle.shape);
  const Isometry3d pose = frame_pose(environment, obstacle.frame, time) * box.pose;
  return (box.half_extents - (pose.inverse() * point).cwiseAbs()).minCoeff();
}

}  // namespace flash::sim
