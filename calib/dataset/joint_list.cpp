#include "calib/dataset/joint_list.h"

#include <cmath>
#include <vector>

#include "data/files/error.h"
#include "data/files/text.h"
#include "data/motion/pose_table.h"

namespace flash::calib {
namespace {

/// Columns of the joints that move: by their names, else q1 q2 ...; in degrees where they end so.
std::vector<std::string> joint_columns(const data::Columns& columns, const SerialChain& robot,
                                       const std::string& path) {
  std::vector<std::string> names = moving_joints(robot), found;
  for (std::size_t k = 0; k < names.size(); ++k)
    for (const std::string& name : {data::column_name(names[k]), "q" + std::to_string(k + 1)})
      for (const std::string& column : {name, name + "_deg"})
        if (found.size() == k && columns.count(column) > 0) found.push_back(column);
  if (found.size() == names.size()) return found;
  throw data::input_error(path, "header",
                          "found no column of joint " + names[found.size()] + ", expected " +
                              names[found.size()] + " or q" + std::to_string(found.size() + 1) +
                              " [rad], or the same with the ending _deg");
}

}  // namespace

data::PoseList load_joint_list(const std::string& path, const SerialChain& robot) {
  constexpr double kTurns = 4 * M_PI;  // beyond which no joint turns
  std::vector<std::string> names;
  const auto check = [&](const data::Columns& columns) { names = joint_columns(columns, robot, path); };
  const auto read = [&](const data::PoseTableLine& line) {
    data::RecordedPose pose;
    data::read_picture(line, pose);
    pose.joints.resize(static_cast<Eigen::Index>(names.size()));
    for (std::size_t k = 0; k < names.size(); ++k) {
      const bool degrees = names[k].ends_with("_deg");
      const double value = line.value(names[k]) * (degrees ? M_PI / 180 : 1);
      if (std::abs(value) > kTurns)
        throw data::input_error(path, "line " + std::to_string(line.number) + ", " + names[k],
                                "found " + data::format_short(value) +
                                    " rad, more than two turns (degrees? end the name in _deg)");
      pose.joints[static_cast<Eigen::Index>(k)] = value;
    }
    pose.pose = gripper_pose(robot, pose.joints);
    return pose;
  };
  return data::read_pose_table(path, check, read);
}

}  // namespace flash::calib
