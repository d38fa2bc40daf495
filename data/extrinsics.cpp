#include "data/extrinsics.h"

#include <cmath>

#include "data/error.h"
#include "data/json_reader.h"
#include "data/text.h"
#include "data/trajectory.h"

namespace flash::data {

std::vector<std::string> read_warnings(const JsonObject& file) {
  std::vector<std::string> warnings;
  if (!file.has("warnings")) return warnings;
  if (!file.raw("warnings").is_array()) throw file.error("warnings", "a list of texts");
  for (const nlohmann::json& warning : file.raw("warnings")) {
    if (!warning.is_string()) throw file.error("warnings", "a list of texts");
    warnings.push_back(warning.get<std::string>());
  }
  return warnings;
}

NamedTransform read_transform(const JsonObject& object) {
  object.expect_fields({"parent", "child", "translation", "rotation_xyzw"});
  NamedTransform transform{
      .parent = object.string("parent", ""), .child = object.string("child", ""), .T = {}};
  Eigen::Matrix<double, 7, 1> pose;
  pose << object.vector("translation", 3), object.vector("rotation_xyzw", 4);
  constexpr double kFarthest = 1e4;  // [m]
  if (!(pose.head<3>().cwiseAbs().maxCoeff() < kFarthest))
    throw object.error("translation", "metres, below 10,000");
  if (std::abs(pose.tail<4>().norm() - 1) > 1e-3) throw object.error("rotation_xyzw", "a unit quaternion");
  transform.T = from_vector(pose);
  return transform;
}

CameraPose read_camera_pose(const JsonObject& file, bool accept_unusable) {
  file.expect_fields({"schema",      "setup",      "method",        "transform",
                      "target_pose", "covariance", "predicted_sd",  "sigmas",
                      "residuals",   "depth",      "lens",          "time_offset",
                      "comparison",  "views",      "observability", "convention_findings",
                      "scale",       "edges",      "splits",        "smooth_errors",
                      "joint_zeros", "use",        "warnings",      "exit_code",
                      "provenance"});
  // The second version has joint_zeros, use and the depth of comparisons; what is read here is in both.
  const std::string schema = file.string("schema", "");
  if (schema != "flash-extrinsics/1" && schema != "flash-extrinsics/2")
    throw file.error("schema", "\"flash-extrinsics/2\" or \"flash-extrinsics/1\"");
  CameraPose pose;
  pose.transform = read_transform(file.object("transform"));
  pose.warnings = read_warnings(file);
  pose.usable = file.integer("exit_code", 0) == 0;
  if (!pose.usable && !accept_unusable)
    throw file.error("exit_code", "0: flash-calib handeye ended with an answer that cannot be used" +
                                      (pose.warnings.empty() ? "" : " (" + pose.warnings.front() + ")") +
                                      "; calibrate again, or take it as it is with --force");
  return pose;
}

CameraPose load_camera_pose(const std::string& path, bool accept_unusable) {
  CameraPose pose;
  if (lower_extension(path) == ".json") {
    const nlohmann::json json = load_json(path);
    const JsonObject file(json, path);
    if (file.string("setup", "") == "eye-in-hand")
      throw file.error("setup", "\"eye-to-hand\": this camera moves with the gripper");
    pose = read_camera_pose(file, accept_unusable);
  } else {
    pose.transform = {.parent = "base", .child = "camera", .T = load_trajectory(path).poses.front()};
  }
  constexpr double kFarthest = 20;  // from which no camera of a cell looks on [m]
  if (const double distance = pose.transform.T.translation().norm(); distance > kFarthest)
    throw input_error(path, "translation",
                      "found a camera " + format_short(distance) +
                          " m from the robot's base, expected at most " + format_short(kFarthest) +
                          " m: are these millimetres?");
  return pose;
}

}  // namespace flash::data
