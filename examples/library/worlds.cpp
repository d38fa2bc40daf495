#include <cstdio>
#include <limits>
#include <vector>

#include "data/mesh/procedural_mesh.h"
#include "sim/worlds.h"

// Four towels of unlike stiffness on a table. A gripper comes down on a corner of each, takes it and lifts
// it.
int main() {
  using namespace flash;
  const sim::Sheet towel =
      sim::make_sheet(data::rectangle({.width = 0.2, .height = 0.2, .cells_x = 10, .cells_y = 10}));
  sim::Environment start;
  start.state.positions = towel.rest.vertices;
  start.state.velocities = data::Points::Zero(towel.rest.vertices.rows(), 3);
  start.obstacles = {{.shape = sim::Plane{}, .name = "table"}};
  sim::Hold gripper = {.name = "gripper", .frame = 0, .reach = sim::Reach{.object = "towel"}};
  gripper.from = std::numeric_limits<double>::infinity();  // open until it is asked to close
  start.holds = {gripper};
  const Eigen::Isometry3d above(Eigen::Translation3d(0, 0, 0.1));
  start.schedule = std::make_shared<const sim::Schedule>(sim::Schedule{.frames = {{above}}});

  const int count = 4;
  sim::Worlds worlds(sim::make_sheet_plan(towel), std::vector(count, start), {.threads = 2});
  std::vector<data::SheetMaterial> materials(count);
  for (int e = 0; e < count; ++e) materials[e].membrane_stiffness = 50 * (e + 1);
  worlds.set_materials({}, materials);

  const sim::Tensor positions = worlds.positions(), forces = worlds.hold_forces();  // views: they stay
  for (int k = 0; k < 70; ++k) {
    const double height = k < 20 ? 0.1 - 0.005 * (k + 1) : 0.002 * (k - 19);
    std::vector<double> poses;
    for (int e = 0; e < count; ++e) poses.insert(poses.end(), {0, 0, height, 0, 0, 0, 1});
    worlds.set_poses({}, 0, {.data = poses.data(), .shape = {count, 7}});
    if (k == 20) worlds.grasp({}, 0);
    worlds.step();
  }
  const auto* x = static_cast<const double*>(positions.data);
  const auto* force = static_cast<const double*>(forces.data);
  for (int e = 0; e < count; ++e)
    std::printf("environment %d: its corner is at %.3f m, the gripper pulls %.3f N %s\n", e,
                x[e * positions.shape[1] * 3 + 2], force[3 * e + 2], worlds.why_lost(e).c_str());
}
