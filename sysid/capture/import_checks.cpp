#include "sysid/capture/import_checks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "data/asset/questioned_numbers.h"
#include "data/files/error.h"
#include "data/files/text.h"
#include "sysid/replay/recorded_grasp.h"

namespace flash::sysid {
namespace {

constexpr double kRegistration = 0.15;  // from a gripper to the nearest point that is seen, at most [m]
constexpr double kFarthest = 20;        // beyond it, millimetres were given for metres [m]
constexpr double kHighest = 0.06;       // of a tool that holds a lying sheet, over the table [m]
constexpr double kStretch = 0.05;       // by which calibrated cameras and robots are off at most [m]

std::string metres(double length) { return data::format_short(std::round(1000 * length) / 1000) + " m"; }

double quantile(std::vector<double> values, double share) {
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// A cloud about the tool that holds it.
struct HeldCloud {
  double nearest = 0, farthest = 0;                  ///< point, and all but 2 % of them [m]
  double lowest = 0;                                 ///< over the table, all but 2 % of the points [m]
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();  ///< from where the tool started, seen from above [m]
  double moved = 0;                                  ///< by the tool, seen from above [m]
  double highest = 0;                                ///< over the table, all but 2 % of the points [m]
  Eigen::Vector3d tool = Eigen::Vector3d::Zero();    ///< base frame [m]
};

std::vector<HeldCloud> held_clouds(const data::Recording& recording,
                                   const std::vector<data::Keyframe>& keyframes) {
  constexpr double kStray = 0.02;
  const data::RecordedGrasp& grasp = recording.grasps.front();
  const data::Trajectory& trajectory = recording.trajectories.at(grasp.gripper);
  const Eigen::Vector3d start = trajectory.poses.front().translation();
  std::vector<HeldCloud> held;
  for (const data::Keyframe& keyframe : keyframes) {
    if (keyframe.time < grasp.from || keyframe.cloud.rows() == 0) continue;
    const Eigen::Vector3d tool = data::pose_at(trajectory, keyframe.time).translation();
    std::vector<double> distances, heights;
    for (const auto point : keyframe.cloud.rowwise()) {
      distances.push_back((point.transpose() - tool).norm());
      heights.push_back(point.z() - recording.table_point.z());
    }
    held.push_back({*std::min_element(distances.begin(), distances.end()), quantile(distances, 1 - kStray),
                    quantile(heights, kStray),
                    keyframe.cloud.leftCols<2>().colwise().mean().transpose() - start.head<2>(),
                    (tool - start).head<2>().norm(), quantile(heights, 1 - kStray), tool});
  }
  return held;
}

/// Where the cloth is lifted by a gripper that stands still; empty where it is not.
std::string stuck_gripper(const std::vector<HeldCloud>& held) {
  constexpr double kStill = 2e-3, kLifted = 0.05;  // [m]
  double way = 0, low = held.front().highest, high = low;
  for (const HeldCloud& cloud : held) {
    way = std::max(way, (cloud.tool - held.front().tool).norm());
    low = std::min(low, cloud.highest);
    high = std::max(high, cloud.highest);
  }
  if (way > kStill || high - low < kLifted) return "";
  return "the gripper stands still while the cloth rises by " + metres(high - low) +
         ": is the trajectory that of this recording?";
}

/// Where the cloth is higher than the gripper ever was until then, in three frames or more; empty where it is
/// not.
std::string cloth_above_gripper(const data::Recording& recording, const std::vector<HeldCloud>& held) {
  constexpr int kFewest = 3;
  double raised = held.front().tool.z(), most = 0;
  int frames = 0;
  for (const HeldCloud& cloud : held) {
    raised = std::max(raised, cloud.tool.z());
    const double above = cloud.highest + recording.table_point.z() - raised;
    if (above <= kStretch + recording.nuisance.offset.z()) continue;
    ++frames;
    most = std::max(most, above);
  }
  if (frames < kFewest) return "";
  return "the cloth is up to " + metres(most) + " above the highest place of the gripper until then, in " +
         std::to_string(frames) +
         " frames: do the times of the frames and the trajectory belong together (--times), or were frames "
         "lost?";
}

}  // namespace

std::vector<std::string> contradictions(const data::Recording& recording,
                                        const std::vector<data::Keyframe>& keyframes) {
  constexpr std::size_t kFewest = 3;  // frames
  constexpr double kOffTable = 0.05;  // [m]
  constexpr double kShare = 0.6;      // of its diagonal that hanging cloth reaches, folds and all
  const std::vector<HeldCloud> held = held_clouds(recording, keyframes);
  if (held.size() < kFewest) return {};
  const Eigen::RowVector3d size =
      recording.mesh.vertices.colwise().maxCoeff() - recording.mesh.vertices.colwise().minCoeff();
  const double diagonal = size.norm(), offset = recording.nuisance.offset.norm();
  const std::string sheet = metres(size.x()) + " x " + metres(size.y());

  std::vector<std::string> found;
  std::string of_time = stuck_gripper(held);
  if (of_time.empty()) of_time = cloth_above_gripper(recording, held);
  if (!of_time.empty()) found.push_back(of_time);
  std::vector<double> nearest, farthest, off_table;
  for (const HeldCloud& cloud : held) {
    nearest.push_back(cloud.nearest);
    farthest.push_back(cloud.farthest);
    if (cloud.lowest > kOffTable) off_table.push_back(cloud.farthest);
  }
  if (const double gap = quantile(nearest, 0.5); gap > kRegistration + offset)
    found.push_back(
        "the gripper is " + metres(gap) +
        " from the nearest point of the cloth, in the median frame, expected at most " +
        metres(kRegistration + offset) +
        (1e-3 * gap < diagonal && gap > kFarthest ? ": are the poses of the gripper in millimetres?" : "") +
        ": is the trajectory that of the tool centre point in the frame of the clouds, and does "
        "the recording hold the lift alone?");
  if (const double reach = quantile(farthest, 0.9); reach > diagonal + kStretch + offset)
    found.push_back("the clouds reach " + metres(reach) + " from the gripper, and a sheet of " + sheet +
                    " at most " + metres(diagonal) +
                    ": is it larger than --mesh says, or is there something else in the clouds?");
  if (off_table.size() >= kFewest)
    if (const double reach = quantile(off_table, 1); reach + offset < kShare * diagonal)
      found.push_back("the cloth ends " + metres(reach) +
                      " from the gripper at most, above the table, and a sheet of " + sheet + " reaches " +
                      metres(diagonal) + ": is it smaller than --mesh says, or cut off by a crop?");
  if (!recording.grasps.front().select.corner) return found;

  const data::Trajectory& trajectory = recording.trajectories.at(recording.grasps.front().gripper);
  const Eigen::Vector3d start = trajectory.poses.front().translation();
  const double height = start.z() - recording.table_point.z();
  const std::string approach = approach_of(trajectory);
  if (height > kHighest + recording.nuisance.offset.z())
    found.push_back("the gripper starts " + metres(height) +
                    " above the table on which the sheet lies in its fingers, expected at most " +
                    metres(kHighest + recording.nuisance.offset.z()) +
                    ": is the trajectory that of the flange, or does it begin before the grasp? (--table-z, "
                    "where the table is not at " +
                    metres(recording.table_point.z()) + ")" + (approach.empty() ? "" : " " + approach + "."));
  const Eigen::RowVector3d low = recording.mesh.vertices.colwise().minCoeff();
  const Eigen::Vector3d middle = recording.base_from_object * (low + 0.5 * size).transpose();
  const Eigen::Vector2d stated = (middle - start).head<2>();
  const std::array<int, 2> corner = *recording.grasps.front().select.corner;
  const Eigen::Vector3d across((corner[0] == 0 ? 1 : -1) * size.x(), (corner[1] == 0 ? 1 : -1) * size.y(), 0);
  const Eigen::Vector3d diagonal_way = recording.base_from_object.linear() * across;
  std::vector<double> along;
  for (const HeldCloud& cloud : held)
    if (cloud.moved < 0.25 * diagonal) along.push_back(stated.normalized().dot(cloud.middle));
  if (along.size() >= kFewest)
    if (const double way = quantile(along, 0.5); way < -(0.1 * diagonal + offset))
      found.push_back("the clouds are " + metres(-way) +
                      " behind the gripper's start, seen along the sheet as --heading " +
                      data::format_short(std::round(std::atan2(diagonal_way.y(), diagonal_way.x()) * 180 /
                                                    std::numbers::pi)) +
                      " has it: is it turned by half a turn?");
  return found;
}

std::string flange_doubt(const data::Recording& recording) {
  constexpr double kFlange = 0.4;  // of a flange from its tool [m]
  const data::Trajectory& trajectory = recording.trajectories.at(recording.grasps.front().gripper);
  const double height = trajectory.poses.front().translation().z() - recording.table_point.z();
  if (height <= kHighest + recording.nuisance.offset.z() || height > kFlange) return "";
  return "it starts " + metres(height) +
         " above the table: is the trajectory that of the flange, in place of the tool centre point?";
}

std::string approach_of(const data::Trajectory& trajectory) {
  constexpr double kDown = 1e-3;    // noise of a robot's poses, and the give of what it touches [m]
  constexpr double kLifted = 2e-2;  // above its lowest place: what follows is another descent [m]
  double lowest = trajectory.poses.front().translation().z();
  for (const Eigen::Isometry3d& pose : trajectory.poses) {
    if (pose.translation().z() > lowest + kLifted) break;
    lowest = std::min(lowest, pose.translation().z());
  }
  std::size_t down = 0;
  while (trajectory.poses[down].translation().z() > lowest + kDown) ++down;
  if (down == 0) return "";
  const double fall = trajectory.poses.front().translation().z() - trajectory.poses[down].translation().z();
  return "the gripper comes down by " + metres(fall) + " first, until " +
         data::format_clock(trajectory.times[down]) + " s: --from " +
         data::format_clock(trajectory.times[down]) + " starts there";
}

void check_patch(const data::Recording& recording) {
  const data::Selection& select = recording.grasps.front().select;
  if (select.corner) check_patch_size(select.within, recording.mesh);
}

std::string questioned_settings(const data::Recording& recording) {
  const data::NuisanceBounds& bounds = recording.nuisance;
  const data::Selection& select = recording.grasps.front().select;
  std::vector<data::UsualNumber> numbers = {
      {"--offset-bound", bounds.offset.maxCoeff(), 0, 0.1, "m", "", " (10 mm are 0.01)"},
      {"--yaw-bound", bounds.yaw, 0, 0.35, "rad", "", " (2 deg are 0.035)"},
      {"--start-yaw-bound", bounds.start_yaw, 0, 0.5, "rad", "", " (10 deg are 0.17)"},
      {"--time-offset-bound", bounds.time, 0, 1, "s", "", " (50 ms are 0.05)"},
      {"--table-height-bound", bounds.table_height, 0, 0.05, "m", "", " (5 mm are 0.005)"}};
  if (select.vertices.empty())
    numbers.push_back({"--grasp-within", select.within, 0.005, 0.1, "m", "", " (25 mm are 0.025)"});
  return data::questioned("import", numbers);
}

}  // namespace flash::sysid
