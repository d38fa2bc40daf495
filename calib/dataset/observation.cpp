#include "calib/dataset/observation.h"

namespace flash::calib {

std::vector<PoseLoop> pose_loops(Setup setup, const std::vector<Observation>& observations) {
  std::vector<PoseLoop> loops;
  loops.reserve(observations.size());
  for (const Observation& o : observations)
    loops.push_back(pose_loop(setup, o.T_base_gripper, o.T_camera_target.front()));
  return loops;
}

}  // namespace flash::calib
