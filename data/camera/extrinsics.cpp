#include "data/camera/extrinsics.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <initializer_list>

#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/json_reader.h"
#include "data/files/text.h"
#include "data/motion/pose_file.h"
#include "data/motion/trajectory.h"

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

namespace {

constexpr const char* kRemark = "lens {";

/// Of one lens: focal_px, centre_px and distortion.
CameraIntrinsics read_lens(const JsonObject& object, const Eigen::Vector2d& size) {
  CameraIntrinsics lens;
  constexpr double kLargest = 1e5;  // [px]
  if (!(size.minCoeff() >= 1 && size.maxCoeff() <= kLargest))
    throw object.error("size_px", "width and height in pixels");
  lens.width = static_cast<int>(size.x());
  lens.height = static_cast<int>(size.y());
  const Eigen::Vector2d focal = object.vector("focal_px", 2), centre = object.vector("centre_px", 2);
  if (!(focal.minCoeff() > 0)) throw object.error("focal_px", "two numbers above 0");
  lens.fx = focal.x();
  lens.fy = focal.y();
  lens.cx = centre.x();
  lens.cy = centre.y();
  const Eigen::VectorXd distortion = object.vector("distortion", -1);
  if (distortion.size() > 8) throw object.error("distortion", "at most 8 coefficients");
  if (distortion.isZero(0)) return lens;
  const bool rational = distortion.size() > 5;
  lens.model = rational ? DistortionModel::rational_polynomial : DistortionModel::plumb_bob;
  lens.distortion.assign(distortion.begin(), distortion.end());
  lens.distortion.resize(rational ? 8 : 5, 0.0);
  return lens;
}

bool has_word(std::string name, std::initializer_list<const char*> words) {
  std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::tolower(c); });
  return std::any_of(words.begin(), words.end(),
                     [&](const char* word) { return name.find(word) != std::string::npos; });
}

/// Throws InputError where the names of the frames say that this is the pose of the base in the camera.
void expect_camera_in_parent(const JsonObject& object, const NamedTransform& transform) {
  const auto is_camera = [](const std::string& name) {
    return has_word(name, {"cam", "optical", "lens", "depth", "rgb", "color", "sensor", "kinect"});
  };
  const auto is_robot = [](const std::string& name) {
    return has_word(name, {"base", "world", "robot", "gripper", "flange", "tool", "tcp", "hand"});
  };
  if (is_camera(transform.child)) return;
  if (is_robot(transform.child))
    throw object.error("child", "the camera: the transform is that of the camera in " + transform.child +
                                    ", not its inverse (parent base or gripper, child camera)");
  if (is_camera(transform.parent) && !is_robot(transform.parent))
    throw object.error("parent",
                       "base or gripper: the transform is that of the camera in it, not its inverse");
}

/// Files of pairs of poses have none.
void read_lenses(const JsonObject& file, CameraPose& pose) {
  if (!file.has("lens")) return;
  const JsonObject lens = file.object("lens");
  if (!lens.has("size_px")) return;
  const Eigen::Vector2d size = lens.vector("size_px", 2);
  pose.lens = read_lens(lens, size);
  if (lens.has("stated")) pose.stated = read_lens(lens.object("stated"), size);
}

}  // namespace

namespace {

/// Where a robot that turns about one axis does not tell where the camera is along it.
void expect_whole(const JsonObject& file) {
  if (!file.has("one_axis")) return;
  const JsonObject along = file.object("one_axis");
  if (along.boolean("told", true)) return;
  const Eigen::VectorXd axis = along.vector("camera_axis", 3);
  char text[80];
  const Eigen::Vector3d rounded = (100 * axis.head<3>()).array().round() / 100 + 0.0;  // no minus zero
  std::snprintf(text, sizeof text, "(%.2f, %.2f, %.2f)", rounded[0], rounded[1], rounded[2]);
  throw along.error("told", std::string("true: where the camera is along ") + text +
                                " is not known, as the robot turns about that axis alone; measure it, and "
                                "calibrate with --camera-height or --target-height");
}

/// Of a trajectory, a list of poses, or a YAML file of one.
Eigen::Isometry3d first_pose(const std::string& path) {
  const std::string extension = lower_extension(path);
  if (extension == ".yaml" || extension == ".yml" || extension == ".calib") return load_yaml_pose(path);
  return is_tum(path) ? load_tum(path).poses.front() : load_pose_list(path).poses.front().pose;
}

}  // namespace

std::string lens_remark(const CameraIntrinsics& lens) {
  const auto list = [](std::initializer_list<double> values) {
    std::string text;
    for (const double value : values) text += (text.empty() ? "" : ", ") + format_number(value);
    return '[' + text + ']';
  };
  std::string distortion;
  for (const double c : lens.distortion) distortion += (distortion.empty() ? "" : ", ") + format_number(c);
  return std::string(kRemark) + R"("size_px": )" + list({double(lens.width), double(lens.height)}) +
         R"(, "focal_px": )" + list({lens.fx, lens.fy}) + R"(, "centre_px": )" + list({lens.cx, lens.cy}) +
         R"(, "distortion": [)" + distortion + "]}";
}

std::optional<CameraIntrinsics> find_lens_remark(const std::string& text, const std::string& path) {
  const std::size_t found = text.find(kRemark);
  if (found == std::string::npos) return std::nullopt;
  const std::size_t begin = found + std::string(kRemark).size() - 1, end = text.find('}', begin);
  const nlohmann::json json = nlohmann::json::parse(text.substr(begin, end + 1 - begin), nullptr, false);
  if (!json.is_object()) throw input_error(path, "lens", "expected {\"size_px\": [...], ...}");
  const JsonObject object(json, path, "lens");
  return read_lens(object, object.vector("size_px", 2));
}

CameraPose read_camera_pose(const JsonObject& file, bool accept_unusable) {
  file.expect_fields({"schema",      "setup",      "method",        "transform",
                      "target_pose", "covariance", "predicted_sd",  "sigmas",
                      "residuals",   "depth",      "lens",          "time_offset",
                      "comparison",  "views",      "observability", "convention_findings",
                      "scale",       "edges",      "splits",        "smooth_errors",
                      "joint_zeros", "use",        "warnings",      "exit_code",
                      "one_axis",    "provenance", "link_lengths",  "joint_origins",
                      "focal_length"});
  // The second version has joint_zeros, use and the depth of comparisons; what is read here is in both.
  const std::string schema = file.string("schema", "");
  if (schema != "flash-extrinsics/1" && schema != "flash-extrinsics/2")
    throw file.error("schema", "\"flash-extrinsics/2\" or \"flash-extrinsics/1\"");
  expect_whole(file);
  CameraPose pose;
  pose.transform = read_transform(file.object("transform"));
  expect_camera_in_parent(file.object("transform"), pose.transform);
  read_lenses(file, pose);
  pose.warnings = read_warnings(file);
  pose.usable = file.integer("exit_code", 0) == 0;
  if (!pose.usable && !accept_unusable)
    throw file.error("exit_code", "0: flash-calib handeye ended with an answer that cannot be used" +
                                      (pose.warnings.empty() ? "" : " (" + pose.warnings.front() + ")") +
                                      "; calibrate again, or take it as it is with --despite-doubts");
  return pose;
}

CameraPose load_camera_pose(const std::string& path, bool accept_unusable) {
  CameraPose pose;
  const std::string extension = lower_extension(path);
  const bool json_file = extension == ".json";
  const nlohmann::json json = json_file ? load_json(path) : nlohmann::json();
  if (json.is_object() && (json.contains("schema") || !json.contains("poses"))) {
    const JsonObject file(json, path);
    if (file.string("setup", "") == "eye-in-hand")
      throw file.error("setup", "\"eye-to-hand\": this camera moves with the gripper");
    pose = read_camera_pose(file, accept_unusable);
  } else {
    pose.transform = {.parent = "base", .child = "camera", .T = first_pose(path)};
    if (!json_file) pose.lens = find_lens_remark(read_file(path), path);
  }
  expect_near(path, pose.transform.T);
  return pose;
}

void expect_near(const std::string& path, const Eigen::Isometry3d& camera) {
  constexpr double kFarthest = 20;  // from which no camera of a cell looks on [m]
  if (const double distance = camera.translation().norm(); distance > kFarthest)
    throw input_error(path, "translation",
                      "found a camera " + format_short(distance) +
                          " m from the robot's frame, expected at most " + format_short(kFarthest) +
                          " m: are these millimetres?");
}

}  // namespace flash::data
