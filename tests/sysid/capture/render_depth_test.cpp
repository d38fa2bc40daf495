#include "sysid/capture/render_depth.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "data/files/error.h"

namespace flash::sysid {
namespace {

data::CameraIntrinsics small_camera() {
  data::CameraIntrinsics camera;
  camera.width = 64;
  camera.height = 48;
  camera.fx = 70;
  camera.fy = 72;
  camera.cx = 31.3;
  camera.cy = 23.8;
  return camera;
}

// Moeller and Trumbore 1997: distance along the ray in units of its direction, infinity where it misses.
double ray_triangle(const Eigen::Vector3d& origin, const Eigen::Vector3d& ray,
                    const Eigen::Matrix3d& corners) {
  const Eigen::Vector3d a = (corners.row(1) - corners.row(0)).transpose(),
                        b = (corners.row(2) - corners.row(0)).transpose();
  const Eigen::Vector3d p = ray.cross(b);
  const double determinant = a.dot(p);
  const Eigen::Vector3d s = origin - corners.row(0).transpose(), q = s.cross(a);
  const double u = s.dot(p) / determinant, v = ray.dot(q) / determinant, t = b.dot(q) / determinant;
  const bool hit = std::abs(determinant) > 1e-12 && u >= 0 && v >= 0 && u + v <= 1 && t > 0;
  return hit ? t : std::numeric_limits<double>::infinity();
}

data::TriangleMesh random_triangles(int count, std::mt19937_64& random) {
  std::uniform_real_distribution<double> place(-0.5, 0.5), extent(-0.2, 0.2);
  data::TriangleMesh mesh;
  mesh.vertices.resize(3 * count, 3);
  mesh.triangles.resize(count, 3);
  for (int t = 0; t < count; ++t) {
    const Eigen::RowVector3d centre(place(random), place(random), 0.6 * place(random));
    for (int k = 0; k < 3; ++k)
      mesh.vertices.row(3 * t + k) =
          centre + Eigen::RowVector3d(extent(random), extent(random), extent(random));
    mesh.triangles.row(t) << 3 * t, 3 * t + 1, 3 * t + 2;
  }
  return mesh;
}

TEST(DepthCamera, SeesWhatRayCastingSees) {
  std::mt19937_64 random(7);
  const data::CameraIntrinsics camera = small_camera();
  const Eigen::Isometry3d pose = look_at({0.2, -1.1, 0.9}, {0, 0, 0.05}, Eigen::Vector3d::UnitZ());
  const std::vector<data::TriangleMesh> surfaces = {random_triangles(40, random),
                                                    random_triangles(15, random)};
  const DepthView view = render_depth(camera, pose, surfaces);
  int seen = 0, differing = 0;
  for (int v = 0; v < camera.height; ++v)
    for (int u = 0; u < camera.width; ++u) {
      const Eigen::Vector3d ray =
          pose.linear() * Eigen::Vector3d((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1);
      double nearest = std::numeric_limits<double>::infinity();
      int owner = -1;
      for (int s = 0; s < 2; ++s)
        for (Eigen::Index t = 0; t < surfaces[s].triangles.rows(); ++t) {
          const double depth =
              ray_triangle(pose.translation(), ray, surfaces[s].vertices.middleRows<3>(3 * t));
          if (depth < nearest) nearest = depth, owner = s;
        }
      seen += owner >= 0;
      if (owner != view.surface(v, u)) {
        ++differing;  // an edge through the very centre of a pixel rounds either way
      } else if (owner >= 0) {
        EXPECT_NEAR(view.depth(v, u), nearest, 1e-9) << u << ' ' << v;
      }
    }
  EXPECT_GT(seen, 500);
  EXPECT_LE(differing, 1);
}

TEST(DepthCamera, PointsLieOnTheSurfaceAndNoiseRunsAlongTheRay) {
  data::TriangleMesh square;
  square.vertices.resize(4, 3);
  square.vertices << -0.3, -0.3, 0.1, 0.3, -0.3, 0.1, 0.3, 0.3, 0.1, -0.3, 0.3, 0.1;
  square.triangles.resize(2, 3);
  square.triangles << 0, 1, 2, 0, 2, 3;
  const data::CameraIntrinsics camera = small_camera();
  const Eigen::Isometry3d pose = look_at({0.4, -0.7, 1.0}, {0, 0, 0.1}, Eigen::Vector3d::UnitZ());
  const DepthView view = render_depth(camera, pose, {square});
  std::mt19937_64 random(1);
  const data::Points exact = visible_points(view, 0, camera, pose, 0.0, random);
  EXPECT_LT((exact.col(2).array() - 0.1).abs().maxCoeff(), 1e-12);

  const double sigma = 0.002;
  const data::Points noisy = visible_points(view, 0, camera, pose, sigma, random);
  ASSERT_EQ(noisy.rows(), exact.rows());
  double squares = 0;
  for (Eigen::Index i = 0; i < noisy.rows(); ++i) {
    const Eigen::Vector3d moved = (noisy.row(i) - exact.row(i)).transpose();
    const Eigen::Vector3d ray = (exact.row(i).transpose() - pose.translation()).normalized();
    EXPECT_LT(moved.cross(ray).norm(), 1e-12);
    squares += moved.squaredNorm();
  }
  // The estimate of a standard deviation from n samples spreads by 1 / sqrt(2 n); five of those.
  const double n = static_cast<double>(noisy.rows());
  EXPECT_NEAR(std::sqrt(squares / n) / sigma, 1, 5 / std::sqrt(2 * n));
}

TEST(DepthCamera, ABoxHidesWhatLiesBehindIt) {
  const data::CameraIntrinsics camera = small_camera();
  const Eigen::Isometry3d pose = look_at({0, -1, 0}, {0, 0, 0}, Eigen::Vector3d::UnitZ());
  Eigen::Isometry3d wall = Eigen::Isometry3d::Identity(), front = wall;
  wall.translation().y() = 0.3;
  front.translation().y() = -0.2;
  const DepthView view = render_depth(
      camera, pose, {box_mesh({0.4, 0.01, 0.3}, wall), box_mesh(Eigen::Vector3d::Constant(0.05), front)});
  EXPECT_EQ(view.surface(24, 31), 1);
  EXPECT_NEAR(view.depth(24, 31), 0.75, 1e-12);  // the front face of the box
  EXPECT_EQ(view.surface(24, 45), 0);
  EXPECT_NEAR(view.depth(24, 45), 1.29, 1e-12);  // the front face of the wall
}

TEST(DepthCamera, AnImageIsUpright) {
  const Eigen::Isometry3d pose = look_at({0, -1, 0.5}, {0, 0, 0}, Eigen::Vector3d::UnitZ());
  EXPECT_NEAR(pose.linear().determinant(), 1, 1e-12);
  EXPECT_LT(pose.linear().col(1).z(), 0);                                      // y runs down
  EXPECT_LT((pose.linear().col(0) - Eigen::Vector3d::UnitX()).norm(), 1e-12);  // x runs right
}

TEST(DepthCamera, RefusesALensWithDistortion) {
  data::CameraIntrinsics camera = small_camera();
  camera.distortion = {0.1, 0, 0, 0, 0};
  EXPECT_THROW(render_depth(camera, Eigen::Isometry3d::Identity(), {}), data::InputError);
}

}  // namespace
}  // namespace flash::sysid
