#include "sysid/capture/render_depth.h"

#include <limits>

#include "sim/render/depth_camera.h"

namespace flash::sysid {

DepthView render_depth(const data::CameraIntrinsics& camera, const Eigen::Isometry3d& base_from_camera,
                       const std::vector<data::TriangleMesh>& surfaces) {
  std::vector<sim::SeenMesh> meshes;
  for (const data::TriangleMesh& surface : surfaces)
    meshes.push_back({&surface.triangles, surface.vertices.rows(), {surface.vertices.data()}});
  const std::vector<sim::PixelHit> hits = sim::see(camera, base_from_camera, meshes);
  DepthView view;
  view.depth.resize(camera.height, camera.width);
  view.surface.resize(camera.height, camera.width);
  view.triangle.resize(camera.height, camera.width);
  auto hit = hits.begin();
  for (int v = 0; v < camera.height; ++v)
    for (int u = 0; u < camera.width; ++u, ++hit) {
      view.depth(v, u) = hit->mesh < 0 ? std::numeric_limits<double>::infinity() : 1 / hit->inverse_depth;
      view.surface(v, u) = hit->mesh;
      view.triangle(v, u) = hit->triangle;
    }
  return view;
}

data::Points visible_points(const DepthView& view, int surface, const data::CameraIntrinsics& camera,
                            const Eigen::Isometry3d& base_from_camera, double depth_noise,
                            std::mt19937_64& random) {
  std::normal_distribution<double> noise(0.0, depth_noise);
  data::Points points((view.surface == surface).count(), 3);
  Eigen::Index row = 0;
  for (Eigen::Index v = 0; v < view.depth.rows(); ++v)
    for (Eigen::Index u = 0; u < view.depth.cols(); ++u) {
      if (view.surface(v, u) != surface) continue;
      const Eigen::Vector3d ray((static_cast<double>(u) - camera.cx) / camera.fx,
                                (static_cast<double>(v) - camera.cy) / camera.fy, 1);
      const Eigen::Vector3d seen =
          ray * view.depth(v, u) + ray.normalized() * (depth_noise > 0 ? noise(random) : 0.0);
      points.row(row++) = (base_from_camera * seen).transpose();
    }
  return points;
}

Eigen::Isometry3d look_at(const Eigen::Vector3d& position, const Eigen::Vector3d& target,
                          const Eigen::Vector3d& up) {
  const Eigen::Vector3d forward = (target - position).normalized();
  Eigen::Vector3d right = forward.cross(up);
  // Straight down or up: any right will do.
  if (right.norm() < 1e-9) right = forward.unitOrthogonal();
  right.normalize();
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() << right, forward.cross(right), forward;
  pose.translation() = position;
  return pose;
}

data::TriangleMesh box_mesh(const Eigen::Vector3d& half_extents, const Eigen::Isometry3d& base_from_box) {
  data::TriangleMesh mesh;
  mesh.vertices.resize(8, 3);
  for (int k = 0; k < 8; ++k) {
    const Eigen::Vector3d sign(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1);
    mesh.vertices.row(k) = (base_from_box * half_extents.cwiseProduct(sign).eval()).transpose();
  }
  mesh.triangles.resize(12, 3);
  mesh.triangles << 0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4, 2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6,
      1, 3, 5, 3, 7, 5;
  return mesh;
}

}  // namespace flash::sysid
