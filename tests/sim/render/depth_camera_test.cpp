#include "sim/render/depth_camera.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "data/files/error.h"
#include "data/mesh/procedural_mesh.h"
#include "tests/sim/render/drawn_pictures.h"

namespace flash::sim {
namespace {

using Eigen::Isometry3d, Eigen::Vector3d;

data::CameraIntrinsics small_camera() {
  data::CameraIntrinsics camera;
  camera.width = 64, camera.height = 48;
  camera.fx = 50, camera.fy = 52, camera.cx = 31.3, camera.cy = 23.8;
  return camera;
}

SeenMesh seen(const data::TriangleMesh& mesh) {
  return {
      .triangles = &mesh.triangles, .vertex_count = mesh.vertices.rows(), .vertices = {mesh.vertices.data()}};
}

/// Moeller and Trumbore 1997. `depth`: in units of the ray, infinity where it misses; `edge`: how far the
/// ray is from the nearest edge, in barycentric coordinates.
struct RayHit {
  double depth = std::numeric_limits<double>::infinity();
  double edge = std::numeric_limits<double>::infinity();
};

RayHit ray_triangle(const Vector3d& origin, const Vector3d& ray, const Eigen::Matrix3d& corners) {
  const Vector3d a = (corners.row(1) - corners.row(0)).transpose(),
                 b = (corners.row(2) - corners.row(0)).transpose();
  const Vector3d p = ray.cross(b), s = origin - corners.row(0).transpose(), q = s.cross(a);
  const double determinant = a.dot(p);
  const double u = s.dot(p) / determinant, v = ray.dot(q) / determinant, t = b.dot(q) / determinant;
  const double within = std::min({u, v, 1 - u - v});
  RayHit hit{.edge = std::min(std::abs(within), std::abs(t - near_plane))};
  if (within >= 0 && t >= near_plane) hit.depth = t;
  return hit;
}

TEST(DepthCameras, SeeWhatRaysMeet) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  const data::CameraIntrinsics camera = small_camera();
  int compared = 0, near_edges = 0;
  for (int scene = 0; scene < 40; ++scene) {
    const std::vector<data::TriangleMesh> meshes = {triangles_about(12, random), triangles_about(8, random)};
    Isometry3d pose = Isometry3d::Identity();
    pose.linear() = Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random))
                        .normalized()
                        .matrix();
    pose.translation() = 0.1 * Vector3d(normal(random), normal(random), normal(random));
    const std::vector<SeenMesh> views = {seen(meshes[0]), seen(meshes[1])};
    const std::vector<PixelHit> hits = see(camera, pose, views);
    for (int v = 0; v < camera.height; ++v)
      for (int u = 0; u < camera.width; ++u) {
        const Vector3d ray =
            pose.linear() * Vector3d((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1);
        RayHit nearest;
        double edge = nearest.edge;
        int mesh = -1, triangle = -1;
        for (int m = 0; m < 2; ++m)
          for (int t = 0; t < meshes[std::size_t(m)].triangles.rows(); ++t) {
            const RayHit hit =
                ray_triangle(pose.translation(), ray, meshes[std::size_t(m)].vertices.middleRows<3>(3 * t));
            edge = std::min(edge, hit.edge);
            if (hit.depth < nearest.depth) nearest = hit, mesh = m, triangle = t;
          }
        // Rounding of a sliver's barycentric coordinates is 1e-16 times its length over its width, and more.
        if (edge < 1e-9) {
          ++near_edges;
          continue;
        }
        ++compared;
        const PixelHit& own = hits[static_cast<std::size_t>(v * camera.width + u)];
        ASSERT_EQ(own.mesh, mesh) << scene << ' ' << u << ' ' << v;
        ASSERT_EQ(own.triangle, triangle) << scene << ' ' << u << ' ' << v;
        if (mesh >= 0) {
          EXPECT_NEAR(1 / own.inverse_depth, nearest.depth, 1e-9) << scene;
        }
      }
  }
  EXPECT_GT(compared, 100000);
  EXPECT_LT(near_edges, 100);
}

/// Corners that are halves of pixels, so that edges go exactly through centres.
TEST(DepthCameras, PixelsOfASharedEdgeAreDrawnOnce) {
  std::mt19937_64 random(3);
  std::uniform_int_distribution<int> half(4, 36);
  const Pinhole camera{24, 24, 1, 1, 0, 0};
  for (int fan = 0; fan < 300; ++fan) {
    // A square about an inner point, either way around.
    const ImageCorner inner{0.5 * half(random), 0.5 * half(random), 1};
    ImageCorner corners[4] = {{1, 1, 1}, {20, 1, 1}, {20, 20, 1}, {1, 20, 1}};
    std::vector<int> count(24 * 24);
    const auto hit = [&](int u, int v, double) { ++count[static_cast<std::size_t>(24 * v + u)]; };
    for (int k = 0; k < 4; ++k)
      if ((fan + k) % 2 == 0)
        cover(whole_picture(camera), corners[k], corners[(k + 1) % 4], inner, hit);
      else
        cover(whole_picture(camera), inner, corners[(k + 1) % 4], corners[k], hit);
    for (int v = 0; v < 24; ++v)
      for (int u = 0; u < 24; ++u) {
        const int drawn = count[static_cast<std::size_t>(24 * v + u)];
        EXPECT_LE(drawn, 1);
        if (u > 1 && u < 20 && v > 1 && v < 20) {
          EXPECT_EQ(drawn, 1) << fan << ": " << u << ' ' << v;
        }
      }
  }
}

TEST(DepthCameras, PicturesOfAPlaneAreThoseOfItsEquationOnAnyNumberOfThreads) {
  data::TriangleMesh plane{data::Points(4, 3), data::Triangles(2, 3)};
  plane.vertices << -9, -9, 0, 9, -9, 0, 9, 9, 0, -9, 9, 0;  // reaches behind the cameras
  plane.triangles << 0, 1, 2, 0, 2, 3;
  const data::CameraIntrinsics camera = small_camera();
  const std::size_t pixels = 64 * 48, size = 5;
  const auto height = [](std::size_t picture) { return 0.01 * static_cast<double>(picture); };
  std::vector<Isometry3d> raised(size, Isometry3d::Identity()), cameras;
  for (std::size_t e = 0; e < size; ++e) {
    raised[e].translation().z() = height(e);
    Isometry3d pose(Eigen::AngleAxisd(3.14159 - 0.4 - 0.1 * static_cast<double>(e), Vector3d::UnitX()));
    pose.translation() = Vector3d(0.1, 0.2, 0.8);
    cameras.push_back(pose);
  }
  SeenMesh mesh = seen(plane);
  mesh.base_from_mesh = raised;
  const auto pictures = [&](int threads) {
    std::vector<float> numbers(5 * pixels * size, -1);
    std::vector<std::uint8_t> instance(pixels * size);
    std::vector<std::int32_t> triangle(pixels * size);
    float* from = numbers.data();
    render(camera, cameras, {&mesh, 1},
           {from, from + pixels * size, instance.data(), triangle.data(), from + 2 * pixels * size}, threads);
    for (std::size_t i = 0; i < triangle.size(); ++i) {
      numbers.push_back(static_cast<float>(instance[i]));
      numbers.push_back(static_cast<float>(triangle[i]));
    }
    return numbers;
  };
  const std::vector<float> one = pictures(1);
  EXPECT_EQ(one, pictures(2));
  EXPECT_EQ(one, pictures(7));
  for (std::size_t i = 0; i < size; ++i)
    for (std::size_t k = 0; k < pixels; ++k) {
      const Vector3d ray((static_cast<double>(k % 64) - camera.cx) / camera.fx,
                         (static_cast<double>(k / 64) - camera.cy) / camera.fy, 1);
      const double depth = (height(i) - cameras[i].translation().z()) / (cameras[i].linear() * ray).z();
      const Vector3d point = cameras[i] * (depth * ray).eval();
      const bool met = depth > 0 && point.head<2>().cwiseAbs().maxCoeff() < 9;
      const std::size_t pixel = i * pixels + k;
      // float32 has 6e-8 of what it holds.
      EXPECT_NEAR(one[pixel], met ? depth : 0, 1e-6);
      EXPECT_NEAR(one[pixels * size + pixel], met ? depth * ray.norm() : 0, 2e-6);
      for (int c = 0; met && c < 3; ++c)
        EXPECT_NEAR(one[2 * pixels * size + 3 * pixel + std::size_t(c)], point(c), 2e-6);
      EXPECT_EQ(one[5 * pixels * size + 2 * pixel], met ? 0 : 255);
    }
}

TEST(DepthCameras, ACornerThatIsNoNumberHidesItsTrianglesAlone) {
  data::TriangleMesh mesh{data::Points(6, 3), data::Triangles(2, 3)};
  mesh.vertices << std::nan(""), 0, 1, 1, 0, 1, 0, 1, 1, -9, -9, 2, 9, -9, 2, 0, 9, 2;
  mesh.triangles << 0, 1, 2, 3, 4, 5;
  const SeenMesh view = seen(mesh);
  for (const PixelHit& hit : see(small_camera(), Isometry3d::Identity(), {&view, 1})) {
    EXPECT_EQ(hit.triangle, 1);
    EXPECT_NEAR(hit.inverse_depth, 0.5, 1e-12);
  }
}

TEST(DepthCameras, MeshesHaveAShapeForEachPictureOrOneForAll) {
  data::TriangleMesh near{data::Points(3, 3), data::Triangles(1, 3)};
  near.vertices << -9, -9, 1, 9, -9, 1, 0, 9, 1;
  near.triangles << 0, 1, 2;
  data::TriangleMesh far = near;
  far.vertices.col(2).setConstant(2);
  const std::vector<Isometry3d> cameras(2, Isometry3d::Identity());
  const data::CameraIntrinsics camera = small_camera();
  SeenMesh changing = seen(near), hidden;
  changing.vertices.push_back(far.vertices.data());
  std::vector<float> depth(2 * 64 * 48);
  std::vector<std::uint8_t> instance(depth.size());
  const DepthPictures pictures{.depth = depth.data(), .instance = instance.data()};
  render(camera, cameras, std::vector{hidden, changing}, pictures, 1);
  EXPECT_FLOAT_EQ(depth.front(), 1);
  EXPECT_FLOAT_EQ(depth.back(), 2);
  EXPECT_EQ(instance.back(), 1);  // the hidden one keeps its number
  changing.vertices.push_back(far.vertices.data());
  EXPECT_THROW(render(camera, cameras, {&changing, 1}, pictures, 1), data::InputError);
  changing = seen(near);
  changing.base_from_mesh.resize(3, Isometry3d::Identity());
  EXPECT_THROW(render(camera, cameras, {&changing, 1}, pictures, 1), data::InputError);
}

/// A sheet of many triangles at a depth below a plane, seen from any side: it shows as deep as the plane
/// yields.
TEST(DepthCameras, WhatLiesOnAPlaneThatYieldsShows) {
  constexpr double yields = 2e-3;
  data::TriangleMesh plane{data::Points(4, 3), data::Triangles(2, 3)};
  plane.vertices << -9, -9, 0, 9, -9, 0, 9, 9, 0, -9, 9, 0;
  plane.triangles << 0, 1, 2, 0, 2, 3;
  data::TriangleMesh sheet = data::rectangle({.width = 0.5, .height = 0.5, .cells_x = 23, .cells_y = 23});
  sheet.vertices.rowwise() -= Eigen::RowVector3d(0.25, 0.25, 0);
  const Isometry3d turn(Eigen::AngleAxisd(0.3, Vector3d(1, 2, 3).normalized()));
  const auto turned = [&](data::TriangleMesh mesh) {
    mesh.vertices = (mesh.vertices * turn.linear().transpose()).eval();
    return mesh;
  };
  const data::TriangleMesh turned_plane = turned(plane);
  for (const double tilt : {0.0, 0.5, 1.0, 1.4, 1.5})
    for (const double depth : {-0.1, 0.0, 0.99 * yields, 1.01 * yields, 0.1}) {
      data::TriangleMesh lower = sheet;
      lower.vertices.col(2).array() -= depth;
      lower = turned(lower);
      SeenMesh below = seen(turned_plane), own = seen(lower);
      below.yields = yields;
      const Isometry3d camera = turn *
                                Isometry3d(Eigen::AngleAxisd(std::numbers::pi - tilt, Vector3d::UnitX())) *
                                Eigen::Translation3d(0, 0, -0.7);
      const std::vector<PixelHit> alone = see(small_camera(), camera, {&own, 1});
      const std::vector<PixelHit> hits = see(small_camera(), camera, std::vector{own, below});
      const std::vector<PixelHit> turned_round = see(small_camera(), camera, std::vector{below, own});
      for (std::size_t i = 0; i < hits.size(); ++i) {
        const bool shows = alone[i].mesh == 0 && depth < yields;
        EXPECT_EQ(hits[i].mesh == 0, shows) << tilt << ' ' << depth;
        EXPECT_EQ(turned_round[i].mesh == 1, shows);
        if (shows) {
          EXPECT_EQ(hits[i].inverse_depth, alone[i].inverse_depth);  // where it is, not where the plane is
        }
      }
    }
}

TEST(DepthCameras, RefuseWhatIsNoCamera) {
  const Isometry3d pose = Isometry3d::Identity();
  data::CameraIntrinsics camera = small_camera();
  for (const double focal_length : {0.0, 1e-300, 1e300, std::nan("")}) {
    camera.fx = focal_length;
    EXPECT_THROW(see(camera, pose, {}), data::InputError);
  }
  camera = small_camera();
  for (const double centre : {1e300, std::nan("")}) {
    camera.cy = centre;
    EXPECT_THROW(see(camera, pose, {}), data::InputError);
  }
  camera = small_camera();
  camera.height = 0;
  EXPECT_THROW(see(camera, pose, {}), data::InputError);
  camera = small_camera();
  camera.distortion = {0.1};
  EXPECT_THROW(see(camera, pose, {}), data::InputError);
}

// Two sheets at one depth to rounding: the first shows, everywhere.
TEST(DepthCameras, OfTwoAtOneDepthTheFirstShows) {
  const data::CameraIntrinsics camera = small_camera();
  const data::TriangleMesh sheet = data::rectangle({.cells_x = 5, .cells_y = 5});
  data::TriangleMesh other = sheet;
  for (const double nearer : {0.0, 1e-12, 1e-9}) {
    other.vertices.col(2).setConstant(-nearer);
    Isometry3d pose = Isometry3d::Identity();
    pose.translation() = Vector3d(0.1, 0.1, -0.3);
    const std::vector<SeenMesh> views = {seen(sheet), seen(other)};
    int covered = 0;
    for (const PixelHit& hit : see(camera, pose, views)) {
      EXPECT_LE(hit.mesh, 0);
      covered += hit.mesh == 0;
    }
    EXPECT_GT(covered, 100) << nearer;
  }
}

// A sheet in the plane of the camera has no area in the picture but rounding: no depth is outside of it.
TEST(DepthCameras, FromItsEdgeASheetIsNowhereElse) {
  std::mt19937_64 random(9);
  std::uniform_real_distribution<double> turn(-3, 3), place(-0.3, 0.3);
  data::CameraIntrinsics camera = small_camera();
  camera.cx = 32, camera.cy = 24;
  const data::TriangleMesh sheet = data::rectangle({.cells_x = 5, .cells_y = 5});
  int drawn = 0;
  for (int k = 0; k < 2000; ++k) {
    Isometry3d pose = Isometry3d::Identity();
    pose.translation() = Vector3d(place(random), place(random), 0);
    const double heading = turn(random);
    Eigen::Matrix3d axes;
    axes.col(2) = Vector3d(std::cos(heading), std::sin(heading), 0);
    axes.col(0) = axes.col(2).unitOrthogonal();
    axes.col(1) = axes.col(2).cross(axes.col(0));
    pose.linear() = axes * Eigen::AngleAxisd(turn(random), Vector3d::UnitZ()).toRotationMatrix();
    const Eigen::VectorXd depths =
        (sheet.vertices.rowwise() - pose.translation().transpose()) * pose.linear().col(2);
    const double nearest = std::max(near_plane, depths.minCoeff());
    for (const PixelHit& hit : see(camera, pose, std::vector<SeenMesh>{seen(sheet)}))
      if (hit.mesh >= 0) {
        ++drawn;
        EXPECT_GE(1 / hit.inverse_depth, nearest * (1 - 1e-12)) << k;
        EXPECT_LE(1 / hit.inverse_depth, depths.maxCoeff() * (1 + 1e-12)) << k;
      }
  }
  EXPECT_GT(drawn, 10);
}

}  // namespace
}  // namespace flash::sim
