#include "calib/calibrate/extrinsics.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "calib/uncertainty/joint_errors.h"
#include "data/files/error.h"
#include "data/files/json_reader.h"

namespace flash::calib {

namespace fs = std::filesystem;

ExtrinsicsInputs relative_to(ExtrinsicsInputs inputs, const std::string& out) {
  if (out.empty()) return inputs;
  const fs::path folder = fs::weakly_canonical(fs::absolute(out)).parent_path();
  for (std::string* path : {&inputs.dataset, &inputs.target, &inputs.poses, &inputs.camera, &inputs.robot})
    if (!path->empty() && fs::exists(*path))  // a target may be words
      *path = fs::weakly_canonical(fs::absolute(*path)).lexically_relative(folder).string();
  return inputs;
}

std::string resolved(const std::string& path, const std::string& calibration) {
  const fs::path beside = fs::weakly_canonical(fs::absolute(calibration).parent_path() / path);
  if (fs::exists(beside)) return beside.string();
  if (fs::exists(path)) return path;
  throw data::input_error(calibration, "provenance",
                          "found " + path + ", which is neither " + beside.string() + " nor " +
                              fs::weakly_canonical(fs::absolute(path)).string() +
                              ", expected where it was when the file was written");
}

Vector6d parent_deviations(const Eigen::Isometry3d& T, const Matrix6d& covariance) {
  Matrix6d turn = Matrix6d::Zero();
  turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() = T.linear();
  return (turn * covariance * turn.transpose()).diagonal().cwiseMax(0).cwiseSqrt();
}

ToldDeviations told_deviations(const Calibration& calibration, Matrix6d covariance, Axes axes) {
  constexpr double kLeans = 0.01;
  const Eigen::Isometry3d& X = calibration.poses.X;
  const bool in_parent = axes == Axes::parent;
  Eigen::Vector3d untold = Eigen::Vector3d::Zero();
  if (calibration.along && !calibration.along->told) {
    covariance -= covariance_along(*calibration.along, X);
    untold = in_parent ? calibration.along->axis.camera
                       : Eigen::Vector3d(untold_direction(calibration.along->axis, X).head<3>());
  }
  const Vector6d sd = parent_deviations(in_parent ? X : Eigen::Isometry3d::Identity(), covariance);
  ToldDeviations told;
  for (Eigen::Index i = 0; i < 6; ++i)
    if (i >= 3 || std::abs(untold[i]) < kLeans) told[static_cast<std::size_t>(i)] = sd[i];
  return told;
}

namespace {

std::vector<double> numbers(const data::JsonObject& object, const char* field) {
  const nlohmann::json& list = object.raw(field);
  std::vector<double> values;
  for (const nlohmann::json& value : list) {
    if (!value.is_number()) throw object.error(field, "a list of numbers");
    values.push_back(value.get<double>());
  }
  return values;
}

/// Files of old have no twist.
Warp read_warp(const data::JsonObject& scale) {
  const std::vector<double> values = numbers(scale, "warp_mm");
  if (values.size() != 2 && values.size() != kWarp) throw scale.error("warp_mm", "three numbers");
  Warp warp = Warp::Zero();
  for (std::size_t i = 0; i < values.size(); ++i) warp[static_cast<Eigen::Index>(i)] = 1e-3 * values[i];
  return warp;
}

Eigen::Isometry3d read_origin(const data::JsonObject& origin) {
  origin.expect_fields({"xyz", "rpy"});
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = origin.vector("xyz", 3);
  T.linear() = rotation_of_rpy(origin.vector("rpy", 3));
  return T;
}

Joint read_joint(const data::JsonObject& origin) {
  Joint joint{.name = origin.string("joint"), .origin = read_origin(origin.object("described"))};
  const std::string kind = origin.string("kind");
  for (const Joint::Kind other : {Joint::Kind::revolute, Joint::Kind::prismatic})
    if (kind == to_string(other)) joint.kind = other;
  if (kind != to_string(joint.kind)) throw origin.error("kind", "fixed, revolute or prismatic");
  if (joint.kind != Joint::Kind::fixed) joint.axis = origin.vector("axis", 3);
  return joint;
}

}  // namespace

Extrinsics extrinsics_of(const Calibration& calibration, const ExtrinsicsInputs& inputs) {
  const bool in_hand = calibration.setup == Setup::eye_in_hand;
  Extrinsics extrinsics;
  extrinsics.setup = calibration.setup;
  extrinsics.pixels = has_pixels(calibration);
  extrinsics.method = extrinsics.pixels ? to_string(calibration.method) : "pose_space";
  extrinsics.transform = {camera_parent(calibration.setup), "camera", calibration.poses.X};
  extrinsics.target_pose = {in_hand ? "base" : "gripper", "target", calibration.poses.Z};
  extrinsics.covariance = calibration.covariance;
  extrinsics.corner_px = calibration.refined.noise.corner.front();
  extrinsics.robot_rotation_rad = calibration.refined.noise.rotation.front();
  extrinsics.robot_translation_m = calibration.refined.noise.translation.front();
  if (extrinsics.pixels) {
    extrinsics.target = shape_of(calibration.refined.bundle, 0);
    extrinsics.edge_offset = edge_offset(calibration.refined.bundle, 0);
    extrinsics.lens = calibration.refined.bundle.intrinsics.front();
    extrinsics.stated_lens = with_vector(*extrinsics.lens, calibration.lens.stated);
  } else {
    if (calibration.size) extrinsics.target.scale = calibration.size->estimate;
    if (calibration.focal_length) extrinsics.focal_length = calibration.focal_length->estimate;
  }
  const auto errors =
      joint_errors(calibration.refined.bundle, calibration.unknowns, calibration.shared_covariance);
  if (errors && inputs.arm) extrinsics.joint_origins = joint_origins(*inputs.arm, errors->estimate);
  extrinsics.inputs = inputs;
  return extrinsics;
}

Extrinsics load_extrinsics(const std::string& path, bool accept_unusable) {
  const nlohmann::json file = data::load_json(path);
  const data::JsonObject object(file, path);
  const data::CameraPose pose = data::read_camera_pose(object, accept_unusable);
  data::expect_near(path, pose.transform.T);
  Extrinsics extrinsics;
  extrinsics.setup = parse_setup(object.string("setup"), path, "setup");
  extrinsics.method = object.string("method");
  extrinsics.transform = pose.transform;
  extrinsics.lens = pose.lens;
  extrinsics.stated_lens = pose.stated;
  extrinsics.warnings = pose.warnings;
  extrinsics.usable = pose.usable;
  extrinsics.target_pose = data::read_transform(object.object("target_pose"));
  const nlohmann::json& covariance = object.raw("covariance");
  if (!covariance.is_array() || covariance.size() != 6) throw object.error("covariance", "6 x 6 numbers");
  for (Eigen::Index i = 0; i < 6; ++i) {
    const nlohmann::json& row = covariance[static_cast<std::size_t>(i)];
    if (!row.is_array() || row.size() != 6) throw object.error("covariance", "6 x 6 numbers");
    for (Eigen::Index j = 0; j < 6; ++j) {
      const nlohmann::json& value = row[static_cast<std::size_t>(j)];
      if (!value.is_number()) throw object.error("covariance", "6 x 6 numbers");
      extrinsics.covariance(i, j) = value.get<double>();
    }
  }
  constexpr double kLargest = 1e8;  // [m^2], [rad^2]
  if (!(extrinsics.covariance.cwiseAbs().maxCoeff() < kLargest))
    throw object.error("covariance", "numbers below 1e8");
  if (!extrinsics.covariance.isApprox(extrinsics.covariance.transpose(), 1e-6) ||
      extrinsics.covariance.diagonal().minCoeff() < 0)
    throw object.error("covariance", "a symmetric matrix, no variance below 0");
  if (object.has("sigmas")) {
    const data::JsonObject sigmas = object.object("sigmas");
    extrinsics.pixels = sigmas.has("corner_px");
    extrinsics.corner_px = sigmas.not_negative("corner_px", 0);
    extrinsics.robot_rotation_rad = sigmas.not_negative("robot_rotation_rad");
    extrinsics.robot_translation_m = sigmas.not_negative("robot_translation_m");
  }
  if (object.has("residuals")) {
    const data::JsonObject residuals = object.object("residuals");
    if (residuals.has("heldout_mm") && residuals.has("heldout_deg"))
      extrinsics.held_out = {residuals.not_negative("heldout_deg") * M_PI / 180,
                             1e-3 * residuals.not_negative("heldout_mm")};
  }
  if (object.has("scale")) {
    const data::JsonObject scale = object.object("scale");
    if (scale.boolean("solved", false)) extrinsics.target.scale = scale.positive("estimate");
    extrinsics.size_unknown = scale.boolean("solved", false) && !scale.has("prior_sd");
    if (scale.has("warp_mm")) extrinsics.target.warp = read_warp(scale);
  }
  if (object.has("focal_length"))
    extrinsics.focal_length = object.object("focal_length").positive("estimate");
  if (object.has("edges")) extrinsics.edge_offset = object.object("edges").number("offset_px");
  if (object.has("use")) {
    const std::string use = object.object("use").string("for", "workspace");
    const std::optional<Use> known = use_named(use);
    if (!known) throw object.error("use", "workspace, image or two-arms, found " + use);
    extrinsics.use = *known;
  }
  if (object.has("provenance")) {
    const data::JsonObject from = object.object("provenance");
    extrinsics.inputs = {from.string("dataset", ""), from.string("target", ""), from.string("poses", ""),
                         from.string("camera", ""), from.string("refiner", "")};
    extrinsics.inputs.robot = from.string("robot", "");
    extrinsics.inputs.base_link = from.string("base_link", "");
    extrinsics.inputs.tip_link = from.string("tip_link", "");
    if (from.has("depth_scale")) {
      DepthUse& depth = extrinsics.inputs.depth.emplace();
      depth.used = true;
      depth.scale = from.positive("depth_scale");
    }
  }
  for (const data::JsonObject& origin : object.objects("joint_origins"))
    extrinsics.joint_origins.push_back({read_joint(origin), read_origin(origin.object("corrected"))});
  if (object.has("link_lengths"))
    extrinsics.inputs.link_length_sd = 1e-3 * object.object("link_lengths").positive("prior_sd_mm");
  if (object.has("time_offset")) {
    const data::JsonObject offset = object.object("time_offset");
    extrinsics.inputs.time_offset = {offset.number("estimate_s"), offset.not_negative("sd_s")};
  }
  return extrinsics;
}

}  // namespace flash::calib
