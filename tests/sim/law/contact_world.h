#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "sim/law/vertex_contact.h"
#include "sim/step/contact_set.h"

namespace flash::sim {

/// Vertices above, on and in some obstacles.
struct ContactWorld {
  Sheet sheet;
  Environment environment;
  data::Points positions;  ///< at the end of the step [m]
  data::Points force;      ///< what each vertex needs [N]

  static constexpr double time_step = 0.01;  ///< [s]
  static constexpr int vertices = 400;

  ContactStep step() const { return {sheet, environment, time_step, {.speed = 1}}; }
};

inline data::Points random_points(double size, std::mt19937& engine) {
  std::uniform_real_distribution<double> number(-size, size);
  return data::Points::NullaryExpr(ContactWorld::vertices, 3, [&] { return number(engine); });
}

/// Obstacles of all shapes, one to three; one of them moves in every second world.
inline ContactWorld mixed_world(unsigned seed) {
  ContactWorld world;
  std::mt19937 engine(seed);
  std::uniform_real_distribution<double> number(-1, 1);
  const auto vector = [&] { return Eigen::Vector3d(number(engine), number(engine), number(engine)); };
  const auto pose = [&](double size) {
    return Eigen::Isometry3d(Eigen::Translation3d(size * vector()) *
                             Eigen::AngleAxisd(size * number(engine), vector().normalized()));
  };
  world.sheet.bodies = {{.vertex_count = ContactWorld::vertices}};
  Environment& environment = world.environment;
  const Eigen::Isometry3d from = pose(0.02), to = pose(0.02);
  environment.schedule = std::make_shared<const Schedule>(Schedule{0, ContactWorld::time_step, {{from, to}}});
  const unsigned count = 1 + seed % 3;
  for (unsigned k = 0; k < count; ++k) {
    Obstacle obstacle{Plane{0.01 * vector(), (vector() + 3 * Eigen::Vector3d::UnitZ()).normalized()}};
    if ((seed / 3 + k) % 3 == 1)
      obstacle.shape = Box{0.02 * Eigen::Vector3d::Ones() + 0.05 * vector().cwiseAbs(), pose(0.05)};
    if ((seed / 3 + k) % 3 == 2) obstacle.shape = Cylinder{0.02 * vector(), vector().normalized(), 0.03};
    // Every other round one is a capsule, every fourth a sphere.
    if ((seed / 3 + k) % 6 == 2)
      obstacle.shape = Capsule{0.02 * vector(), vector().normalized(), (seed + k) % 4 < 2 ? 0.03 : 0.0, 0.03};
    obstacle.friction = {k == 1 ? 0 : 0.5};
    obstacle.frame = seed % 2 == 0 && k == 0 ? 0 : base_frame;
    environment.obstacles.push_back(obstacle);
  }
  environment.state.positions = random_points(0.08, engine);
  world.positions = environment.state.positions + random_points(0.01, engine);
  // Some rest where their surface takes them.
  for (int i = 0; i < ContactWorld::vertices; i += 3)
    world.positions.row(i) = environment.state.positions.row(i);
  world.force = random_points(1, engine);
  return world;
}

/// Planes at rest, one to five, about a space that holds the origin; vertices start in it.
inline ContactWorld world_of_planes(unsigned seed) {
  ContactWorld world;
  std::mt19937 engine(seed);
  std::uniform_real_distribution<double> number(-1, 1);
  world.sheet.bodies = {{.vertex_count = ContactWorld::vertices}};
  for (unsigned k = 0; k < 1 + seed % 5; ++k) {
    const Eigen::Vector3d normal =
        Eigen::Vector3d(number(engine), number(engine), number(engine)).normalized();
    Obstacle obstacle{Plane{-0.02 * normal, normal}};
    obstacle.friction = {0.5};
    world.environment.obstacles.push_back(obstacle);
  }
  world.environment.state.positions = random_points(0.01, engine);
  world.positions = random_points(0.08, engine);
  world.force = random_points(1, engine);
  return world;
}

/// Whether two of the faces that a vertex touches are nearly parallel, or a wedge so sharp that it jams with
/// a friction of 1/2: then no forces obey both laws. The matrix of two faces at an angle of cosine c is
/// copositive where c - mu sqrt(1 - c^2) > -1.
inline bool has_no_unique_force(const std::vector<VertexTouch>& touches) {
  for (const VertexTouch& a : touches)
    for (const VertexTouch& b : touches) {
      if (&a == &b || !a.touches() || !b.touches()) continue;
      const double c = dot(a.normal, b.normal);
      if (std::abs(c) > 0.99 || c - 0.5 * std::sqrt(1 - c * c) <= -1) return true;
    }
  return false;
}

}  // namespace flash::sim
