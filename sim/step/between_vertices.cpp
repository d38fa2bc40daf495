#include "sim/step/between_vertices.h"

#include <Eigen/Geometry>

#include "sim/law/mesh_gap.h"
#include "sim/scene/solid.h"
#include "sim/step/moving_obstacles.h"

namespace flash::sim {

using Eigen::Vector3d;

ComingThrough deepest_between_vertices(const Sheet& sheet, const Environment& environment) {
  ComingThrough deepest;
  const data::Triangles triangles = visible_triangles(sheet);
  const data::Points& x = environment.state.positions;
  for (std::size_t k = 0; k < environment.obstacles.size(); ++k) {
    const Obstacle& obstacle = environment.obstacles[k];
    const auto* mesh = std::get_if<Mesh>(&obstacle.shape);
    if (mesh == nullptr) continue;
    const Eigen::Isometry3d to_mesh =
        (frame_pose(environment, obstacle.frame, environment.state.time) * mesh->pose).inverse();
    const auto see = [&](const Vector3d& place) {
      const double depth = -gap_at(*mesh->surface, 0, vector3(to_mesh * place)).distance;
      if (depth > deepest.depth) deepest = {depth, static_cast<int>(k)};
    };
    for (const auto& t : triangles.rowwise()) {
      const Vector3d a = x.row(t[0]), b = x.row(t[1]), c = x.row(t[2]);
      see((a + b + c) / 3);
      see((a + b) / 2);
      see((b + c) / 2);
      see((c + a) / 2);
    }
  }
  return deepest;
}

}  // namespace flash::sim
