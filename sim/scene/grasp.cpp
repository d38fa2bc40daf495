#include "sim/scene/grasp.h"

namespace flash::sim {

void update_grasps(Environment& environment, double time) {
  constexpr double rounding = 1e-9;  // of a time that is a sum of steps [s]
  auto& offsets = environment.state.grasp_offsets;
  offsets.resize(environment.grasps.size());
  for (std::size_t k = 0; k < environment.grasps.size(); ++k) {
    const Grasp& grasp = environment.grasps[k];
    const bool closed = environment.state.time >= grasp.from - rounding && time <= grasp.to + rounding;
    if (!closed) {
      offsets[k].resize(0, 3);
    } else if (offsets[k].rows() == 0) {
      const Eigen::Isometry3d gripper = data::pose_at(grasp.gripper, environment.state.time).inverse();
      offsets[k].resize(static_cast<Eigen::Index>(grasp.vertices.size()), 3);
      for (std::size_t v = 0; v < grasp.vertices.size(); ++v)
        offsets[k].row(v) = gripper * environment.state.positions.row(grasp.vertices[v]).transpose();
    }
  }
}

}  // namespace flash::sim
