// Feet on the device beside a search of all triangles, with a formula of its own.
#ifdef FLASH_HAVE_CUDA
#include "sim/cuda/surface_feet.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <string>

#include "data/mesh/procedural_mesh.h"
#include "sim/cuda/devices.h"

namespace flash::sim::cuda {
namespace {

using data::Points;
using Eigen::Vector3d;

#define SKIP_WITHOUT_DEVICE() \
  if (const std::string why = why_no_device(); !why.empty()) GTEST_SKIP() << why

double to_segment(const Vector3d& q, const Vector3d& a, const Vector3d& b) {
  const double length2 = (b - a).squaredNorm();
  const double s = length2 > 0 ? std::clamp((q - a).dot(b - a) / length2, 0.0, 1.0) : 0.0;
  return (q - a - s * (b - a)).norm();
}

/// The plane's foot point where it lies inside, else the nearest of the three edges.
double to_triangle(const Vector3d& q, const Points& x, const Eigen::RowVector3i& corners) {
  const Vector3d a = x.row(corners[0]), b = x.row(corners[1]), c = x.row(corners[2]);
  const double on_edges = std::min({to_segment(q, a, b), to_segment(q, b, c), to_segment(q, c, a)});
  const Vector3d normal = (b - a).cross(c - a);
  if (normal.norm() == 0) return on_edges;
  const Vector3d foot = q - normal * normal.dot(q - a) / normal.squaredNorm();
  const bool inside = normal.dot((b - a).cross(foot - a)) >= 0 && normal.dot((c - b).cross(foot - b)) >= 0 &&
                      normal.dot((a - c).cross(foot - c)) >= 0;
  return inside ? std::min(on_edges, (q - foot).norm()) : on_edges;
}

/// A mesh, two shapes of it, and what it is searched for.
struct Scene {
  std::string name;
  data::Triangles triangles;
  std::vector<Points> motion;
  std::vector<Points> clouds;
};

/// A sheet that lies in three layers 2 mm apart, and then waves.
Points folded(const Points& rest) {
  Points x = rest;
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    const double u = rest(i, 0), third = 0.4 / 3;
    const int layer = std::min(2, static_cast<int>(u / third));
    const double along = u - layer * third;
    x.row(i) << (layer % 2 ? third - along : along), rest(i, 1), 0.002 * layer;
  }
  return x;
}
Points waving(const Points& rest) {
  Points x = rest;
  for (Eigen::Index i = 0; i < x.rows(); ++i)
    x(i, 2) = 0.05 * std::sin(20 * rest(i, 0)) + 0.03 * std::cos(25 * rest(i, 1));
  return x;
}

/// Points on vertices, edges and triangles of a surface, near it, and far away.
Points around(const Points& x, const data::Triangles& triangles, int count, std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(0, 1);
  std::normal_distribution<double> normal(0, 1);
  Points points(count, 3);
  for (int i = 0; i < count; ++i) {
    const auto corners =
        triangles.row(static_cast<Eigen::Index>(uniform(random) * static_cast<double>(triangles.rows())));
    Vector3d weights(uniform(random), uniform(random), uniform(random));
    if (i % 4 == 0) weights[0] = 0;       // on an edge
    if (i % 8 == 0) weights = {0, 0, 1};  // on a vertex
    weights /= weights.sum();
    const double away = i % 3 == 0 ? 0 : i % 3 == 1 ? 1e-3 : i % 7 == 0 ? 10 : 0.1;
    points.row(i) = weights[0] * x.row(corners[0]) + weights[1] * x.row(corners[1]) +
                    weights[2] * x.row(corners[2]) +
                    away * Eigen::RowVector3d(normal(random), normal(random), normal(random));
  }
  return points;
}

std::vector<Scene> scenes() {
  std::mt19937 random(11);
  std::vector<Scene> all;
  for (const int cells : {1, 4, 15, 44}) {
    const data::TriangleMesh mesh =
        data::rectangle({.width = 0.4, .height = 0.4, .cells_x = cells, .cells_y = cells});
    all.push_back({"sheet of " + std::to_string(cells),
                   mesh.triangles,
                   {folded(mesh.vertices), waving(mesh.vertices)},
                   {}});
  }
  // Triangles without order, some without area, some without extent.
  std::uniform_real_distribution<double> uniform(-0.3, 0.3);
  Scene soup{"soup", data::Triangles(500, 3), {Points(300, 3), Points(300, 3)}, {}};
  for (Points& x : soup.motion) x = x.unaryExpr([&](double) { return uniform(random); });
  std::uniform_int_distribution<int> vertex(0, 299);
  for (Eigen::Index t = 0; t < 500; ++t) {
    soup.triangles.row(t) << vertex(random), vertex(random), vertex(random);
    if (t % 10 == 0) soup.triangles(t, 2) = soup.triangles(t, 1);
    if (t % 50 == 0) soup.triangles.row(t).setConstant(vertex(random));
  }
  all.push_back(soup);
  for (Scene& scene : all)
    for (const int count : {700, 0, 33})
      scene.clouds.push_back(around(scene.motion[0], scene.triangles, count, random));
  return all;
}

double to_surface(const Vector3d& q, const Points& x, const data::Triangles& triangles) {
  double least = std::numeric_limits<double>::infinity();
  for (Eigen::Index t = 0; t < triangles.rows(); ++t)
    least = std::min(least, to_triangle(q, x, triangles.row(t)));
  return least;
}

std::vector<int> in_turn(const data::Triangles& triangles) {
  std::vector<int> order(static_cast<std::size_t>(triangles.rows()));
  std::iota(order.begin(), order.end(), 0);
  return order;
}

Vector3d vector(const Vector3<double>& v) { return {v.x, v.y, v.z}; }

Points between(const std::vector<Points>& motion, const BetweenSteps& time) {
  return (1 - time.fraction) * motion[static_cast<std::size_t>(time.first)] +
         time.fraction * motion[static_cast<std::size_t>(time.last)];
}

TEST(SurfaceFeet, AreThoseOfASearchOfAll) {
  SKIP_WITHOUT_DEVICE();
  for (const Scene& scene : scenes()) {
    SCOPED_TRACE(scene.name);
    const std::vector<Points> few = {Points(0, 3), scene.clouds[2], Points(0, 3)};
    SurfaceFeet search(0, scene.triangles, scene.motion[0].rows(), in_turn(scene.triangles),
                       {scene.clouds, few});
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    for (const double turn : {0.0, 0.3}) {
      pose.linear() = Eigen::AngleAxisd(turn, Vector3d(1, 2, 2) / 3).toRotationMatrix();
      pose.translation() = Vector3d(0.02, -0.01, 0.005) * turn;
      const std::vector<BetweenSteps> times = {{0, 1, turn}, {1, 1, 0}, {0, 0, 0}};
      for (const std::size_t set : {0, 1}) {
        const auto feet = search.find(set, scene.motion, 0.01, times, pose);
        ASSERT_EQ(feet.size(), 3u);
        for (std::size_t k = 0; k < 3; ++k) {
          const Points& cloud = set == 0 ? scene.clouds[k] : few[k];
          const Points x = between(scene.motion, times[k]);
          ASSERT_EQ(std::ssize(feet[k]), cloud.rows());
          for (Eigen::Index i = 0; i < cloud.rows(); ++i) {
            SCOPED_TRACE("point " + std::to_string(i) + " of cloud " + std::to_string(k));
            const SurfaceFoot& foot = feet[k][static_cast<std::size_t>(i)];
            const Vector3d q = pose * cloud.row(i).transpose();
            // Rounding of coordinates of order |q|; squares of distances below 1e-9 m leave of it 1e-16 / d.
            const double rounding = 1e-12 * (1 + q.norm());
            EXPECT_NEAR(foot.distance, to_surface(q, x, scene.triangles), rounding);
            if (foot.distance < 1e-9) continue;
            EXPECT_NEAR(vector(foot.direction).norm(), 1, 1e-12);
            EXPECT_NEAR(to_surface(q - foot.distance * vector(foot.direction), x, scene.triangles), 0,
                        rounding);
          }
        }
      }
    }
  }
}

TEST(SurfaceFeet, MoveAsFastAsDistancesShrink) {
  SKIP_WITHOUT_DEVICE();
  const Scene scene = scenes()[2];
  constexpr double step = 0.01, apart = 1e-4;
  SurfaceFeet search(0, scene.triangles, scene.motion[0].rows(), in_turn(scene.triangles),
                     {{scene.clouds[0]}});
  for (const double fraction : {0.2, 0.9}) {
    const BetweenSteps time = {0, 1, fraction}, before = {0, 1, fraction - apart},
                       after = {0, 1, fraction + apart};
    const auto feet = search.find(0, scene.motion, step, {time}, Eigen::Isometry3d::Identity());
    const Points x[3] = {between(scene.motion, before), between(scene.motion, time),
                         between(scene.motion, after)};
    int compared = 0;
    for (Eigen::Index i = 0; i < scene.clouds[0].rows(); ++i) {
      const SurfaceFoot& foot = feet[0][static_cast<std::size_t>(i)];
      double d[3];
      for (int k = 0; k < 3; ++k)
        d[k] = to_surface(scene.clouds[0].row(i).transpose(), x[k], scene.triangles);
      // Beside a kink, as where another triangle becomes the nearest, and near zero there is no one
      // derivative.
      const double first = (d[1] - d[0]) / (apart * step), second = (d[2] - d[1]) / (apart * step);
      if (d[1] < 2e-3 || std::abs(first - second) > 0.01 * std::abs(first)) continue;
      ++compared;
      EXPECT_NEAR(-foot.speed, (first + second) / 2, 1e-3 + 1e-3 * std::abs(first)) << i;
    }
    EXPECT_GT(compared, 100);
    const auto at_rest = search.find(0, scene.motion, step, {{1, 1, 0}}, Eigen::Isometry3d::Identity());
    for (const SurfaceFoot& foot : at_rest[0]) EXPECT_EQ(foot.speed, 0);
  }
}

TEST(SurfaceFeet, OfAnotherMotionAreNotThoseOfTheFirst) {
  SKIP_WITHOUT_DEVICE();
  const data::TriangleMesh mesh = data::rectangle({.width = 0.4, .height = 0.4, .cells_x = 9, .cells_y = 9});
  Points cloud(1, 3);
  cloud << 0.01, 0.02, 0.1;
  SurfaceFeet search(0, mesh.triangles, mesh.vertices.rows(), in_turn(mesh.triangles), {{cloud}});
  Points raised = mesh.vertices;
  raised.col(2).array() += 0.02;
  const auto distance = [&](const Points& x) {
    search.begin_motion();
    return search.find(0, {x}, 0.01, {{0, 0, 0}}, Eigen::Isometry3d::Identity())[0][0].distance;
  };
  EXPECT_NEAR(distance(mesh.vertices), 0.1, 1e-15);
  EXPECT_NEAR(distance(raised), 0.08, 1e-15);
  EXPECT_NEAR(distance(mesh.vertices), 0.1, 1e-15);
}

}  // namespace
}  // namespace flash::sim::cuda
#endif
