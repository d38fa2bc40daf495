#include "sysid/capture/render_depth.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "data/files/error.h"

namespace flash::sysid {
namespace {

constexpr double near_plane = 1e-3;  // [m]

void rasterize(const Eigen::Matrix3d& corners, int surface, int triangle,
               const data::CameraIntrinsics& camera, DepthView& view) {
  // One corner a row: pixel and inverse depth.
  Eigen::Matrix<double, 3, 2> pixel;
  Eigen::Vector3d inverse_depth;
  for (int k = 0; k < 3; ++k) {
    if (corners(k, 2) < near_plane) return;
    inverse_depth(k) = 1 / corners(k, 2);
    pixel(k, 0) = camera.fx * corners(k, 0) * inverse_depth(k) + camera.cx;
    pixel(k, 1) = camera.fy * corners(k, 1) * inverse_depth(k) + camera.cy;
  }
  const Eigen::Vector2d a = pixel.row(1) - pixel.row(0), b = pixel.row(2) - pixel.row(0);
  const double area = a.x() * b.y() - a.y() * b.x();
  if (area == 0) return;

  const auto first = [](double low) { return std::max(0.0, std::ceil(low)); };
  const int u0 = static_cast<int>(std::min<double>(first(pixel.col(0).minCoeff()), camera.width));
  const int v0 = static_cast<int>(std::min<double>(first(pixel.col(1).minCoeff()), camera.height));
  const int u1 = static_cast<int>(std::clamp(std::floor(pixel.col(0).maxCoeff()), -1.0, camera.width - 1.0));
  const int v1 = static_cast<int>(std::clamp(std::floor(pixel.col(1).maxCoeff()), -1.0, camera.height - 1.0));
  for (int u = u0; u <= u1; ++u)
    for (int v = v0; v <= v1; ++v) {
      const Eigen::Vector2d p(u - pixel(0, 0), v - pixel(0, 1));
      const double w1 = (p.x() * b.y() - p.y() * b.x()) / area;
      const double w2 = (a.x() * p.y() - a.y() * p.x()) / area;
      if (w1 < 0 || w2 < 0 || w1 + w2 > 1) continue;
      const double depth =
          1 / ((1 - w1 - w2) * inverse_depth(0) + w1 * inverse_depth(1) + w2 * inverse_depth(2));
      if (depth >= view.depth(v, u)) continue;
      view.depth(v, u) = depth;
      view.surface(v, u) = surface;
      view.triangle(v, u) = triangle;
    }
}

}  // namespace

DepthView render_depth(const data::CameraIntrinsics& camera, const Eigen::Isometry3d& base_from_camera,
                       const std::vector<data::TriangleMesh>& surfaces) {
  for (double coefficient : camera.distortion)
    if (coefficient != 0)
      throw data::InputError(
          "camera: distortion: found a lens with distortion, expected an undistorted camera to render with");
  DepthView view;
  view.depth =
      Eigen::ArrayXXd::Constant(camera.height, camera.width, std::numeric_limits<double>::infinity());
  view.surface = Eigen::ArrayXXi::Constant(camera.height, camera.width, -1);
  view.triangle = view.surface;
  const Eigen::Isometry3d camera_from_base = base_from_camera.inverse();
  for (std::size_t s = 0; s < surfaces.size(); ++s) {
    const data::Points seen = (surfaces[s].vertices * camera_from_base.linear().transpose()).rowwise() +
                              camera_from_base.translation().transpose();
    for (Eigen::Index t = 0; t < surfaces[s].triangles.rows(); ++t) {
      Eigen::Matrix3d corners;
      for (int k = 0; k < 3; ++k) corners.row(k) = seen.row(surfaces[s].triangles(t, k));
      rasterize(corners, static_cast<int>(s), static_cast<int>(t), camera, view);
    }
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
