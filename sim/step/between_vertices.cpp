#include "sim/step/between_vertices.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <vector>

#include "sim/law/mesh_gap.h"
#include "sim/scene/solid.h"
#include "sim/step/moving_obstacles.h"

namespace flash::sim {
namespace {

using Corners = std::array<Eigen::Vector3d, 3>;

/// The deepest of the middles of a triangle and of its edges.
double depth_in_mesh(const SurfaceMesh& mesh, const Corners& corners) {
  const auto& [a, b, c] = corners;
  double depth = 0;
  for (const Eigen::Vector3d& place : {Eigen::Vector3d((a + b + c) / 3), Eigen::Vector3d((a + b) / 2),
                                       Eigen::Vector3d((b + c) / 2), Eigen::Vector3d((c + a) / 2)})
    depth = std::max(depth, -gap_at(mesh, 0, vector3(place)).distance);
  return depth;
}

/// Raises `deepest` to the depth of a triangle in a convex obstacle, if that is larger by more than
/// `tolerance`. The distance to a convex set is convex: over the triangle it is no less than its tangent at
/// the centre. Where that leaves room, the triangle is quartered, `levels` times at most: rounding ends it
/// too.
void look_for_deeper(const MovingObstacle<double>& obstacle, const Corners& corners, double tolerance,
                     int levels, double& deepest) {
  const auto& [a, b, c] = corners;
  const Eigen::Vector3d centre = (a + b + c) / 3;
  const SurfaceGap<double> gap = gap_to(obstacle, vector3(centre));
  deepest = std::max(deepest, -gap.distance);
  double bound = -gap.distance;
  for (const Eigen::Vector3d& corner : corners)
    bound = std::max(bound, -gap.distance - vector3d(gap.normal).dot(corner - centre));
  if (levels == 0 || !(bound > deepest + tolerance)) return;
  const Eigen::Vector3d ab = (a + b) / 2, bc = (b + c) / 2, ca = (c + a) / 2;
  for (const Corners& part :
       {Corners{a, ab, ca}, Corners{ab, b, bc}, Corners{ca, bc, c}, Corners{ab, bc, ca}})
    look_for_deeper(obstacle, part, tolerance, levels - 1, deepest);
}

/// The vertices that a frame holds, to which its obstacles are none.
std::vector<bool> held_by(const Environment& environment, int frame) {
  std::vector<bool> held(static_cast<std::size_t>(environment.state.positions.rows()), false);
  for (const Hold& hold : environment.holds)
    if (hold.frame == frame)
      for (const int vertex : hold.vertices) held[static_cast<std::size_t>(vertex)] = true;
  return held;
}

}  // namespace

ComingThrough deepest_between_vertices(const Sheet& sheet, const Environment& environment, double from) {
  constexpr int kLevels = 24;  // from kilometres to a tenth of a millimetre
  const double time = environment.state.time;
  ComingThrough found{from, -1, time};
  const data::Triangles triangles = visible_triangles(sheet);
  const data::Points& x = environment.state.positions;
  const std::vector<MovingObstacle<double>> obstacles = moving_obstacles(environment, time, time);
  for (std::size_t k = 0; k < obstacles.size(); ++k) {
    const Obstacle& obstacle = environment.obstacles[k];
    const auto* const mesh = std::get_if<Mesh>(&obstacle.shape);
    if (std::holds_alternative<Plane>(obstacle.shape)) continue;  // deepest at a vertex
    const Eigen::Isometry3d to_mesh =
        mesh == nullptr ? Eigen::Isometry3d::Identity()
                        : (frame_pose(environment, obstacle.frame, time) * mesh->pose).inverse();
    const std::vector<bool> held = held_by(environment, obstacle.frame);
    for (const auto& t : triangles.rowwise()) {
      if (std::any_of(t.begin(), t.end(), [&](int i) { return held[static_cast<std::size_t>(i)]; })) continue;
      const Corners corners = {Eigen::Vector3d(to_mesh * x.row(t[0]).transpose()),
                               Eigen::Vector3d(to_mesh * x.row(t[1]).transpose()),
                               Eigen::Vector3d(to_mesh * x.row(t[2]).transpose())};
      double depth = found.depth;
      if (mesh != nullptr)
        depth = depth_in_mesh(*mesh->surface, corners);
      else if (std::none_of(corners.begin(), corners.end(), [&](const Eigen::Vector3d& corner) {
                 return -gap_to(obstacles[k], vector3(corner)).distance > from;
               }))
        look_for_deeper(obstacles[k], corners, 0.1 * from, kLevels, depth);
      if (depth > found.depth) found = {depth, static_cast<int>(k), time};
    }
  }
  return found.obstacle < 0 ? ComingThrough{} : found;
}

}  // namespace flash::sim
