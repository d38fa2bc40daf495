#include "calib/calibrate/extrinsics.h"

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "data/error.h"
#include "data/json_reader.h"
#include "data/trajectory.h"

namespace flash::calib {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr double kDegrees = 180 / M_PI;

template <class Vector>
Json list(const Vector& v) {
  Json values = Json::array();
  for (Eigen::Index i = 0; i < v.size(); ++i) values.push_back(v[i]);
  return values;
}

template <class Matrix>
Json rows(const Matrix& m) {
  Json values = Json::array();
  for (Eigen::Index i = 0; i < m.rows(); ++i) values.push_back(list(m.row(i)));
  return values;
}

/// Pose pairs are seen by no camera.
bool has_pixels(const Calibration& calibration) { return !calibration.refined.bundle.cameras.empty(); }

Json comparison_json(const Calibration& calibration) {
  const bool pixels = has_pixels(calibration);
  Json methods = Json::object();
  for (const ComparedMethod& method : calibration.comparison) {
    Json entry = {{"relative_deg", method.relative.rotation * kDegrees},
                  {"relative_mm", 1e3 * method.relative.translation},
                  {"reprojection_rms_px", pixels ? Json(method.px) : Json(nullptr)}};
    if (method.held_out) {
      entry["heldout_px"] = pixels ? Json(method.held_out->px) : Json(nullptr);
      entry["heldout_mm"] = method.held_out->mm;
      entry["heldout_deg"] = method.held_out->deg;
    }
    entry["wild"] = method.wild;
    entry["translation"] = list(method.poses.X.translation());
    entry["rotation_xyzw"] = list(data::to_vector(method.poses.X).tail<4>());
    methods[method.name] = std::move(entry);
  }
  return methods;
}

Json views_json(const Calibration& calibration) {
  const bool pixels = has_pixels(calibration);
  Json views = Json::array();
  for (std::size_t i = 0; i < calibration.views.size(); ++i) {
    const ViewResult& view = calibration.views[i];
    Json entry = {{"image", calibration.repair.observations[i].image}, {"used", view.used}};
    entry["reason"] = view.used ? Json(nullptr) : Json(view.reason);
    entry["px"] = view.used && pixels ? Json(view.px) : Json(nullptr);
    if (view.used && pixels) {
      entry["chain_px"] = view.chain_px;
      entry["correction_mm"] = 1e3 * view.correction.head<3>().norm();
      entry["correction_deg"] = view.correction.tail<3>().norm() * kDegrees;
    }
    if (view.used) entry["renumbered"] = calibration.repair.views[i].symmetry != 0;
    views.push_back(std::move(entry));
  }
  return views;
}

Json depth_json(const DepthUse& depth) {
  return {{"used", depth.used},
          {"reason", depth.used ? Json(nullptr) : Json(depth.reason)},
          {"views", depth.views},
          {"pixel_noise_m", depth.pixel_noise},
          {"over_corners", depth.over_corners},
          {"over_corners_sd", depth.over_corners_sd}};
}

}  // namespace

const char* to_string(Setup setup) { return setup == Setup::eye_in_hand ? "eye-in-hand" : "eye-to-hand"; }

Setup parse_setup(const std::string& text, const std::string& source, const std::string& field) {
  if (text == "eye-in-hand") return Setup::eye_in_hand;
  if (text == "eye-to-hand") return Setup::eye_to_hand;
  throw data::input_error(source, field, "found \"" + text + "\", expected eye-in-hand or eye-to-hand");
}

ExtrinsicsInputs relative_to(ExtrinsicsInputs inputs, const std::string& out) {
  if (out.empty()) return inputs;
  const fs::path folder = fs::weakly_canonical(fs::absolute(out)).parent_path();
  for (std::string* path : {&inputs.dataset, &inputs.target, &inputs.poses, &inputs.camera})
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

Extrinsics extrinsics_of(const Calibration& calibration, const ExtrinsicsInputs& inputs) {
  const bool in_hand = calibration.setup == Setup::eye_in_hand;
  Extrinsics extrinsics;
  extrinsics.setup = calibration.setup;
  extrinsics.pixels = has_pixels(calibration);
  extrinsics.method = extrinsics.pixels ? to_string(Method::errors_in_variables) : "pose_space";
  extrinsics.transform = {in_hand ? "gripper" : "base", "camera", calibration.poses.X};
  extrinsics.target_pose = {in_hand ? "base" : "gripper", "target", calibration.poses.Z};
  extrinsics.covariance = calibration.covariance;
  extrinsics.corner_px = calibration.refined.noise.corner.front();
  extrinsics.robot_rotation_rad = calibration.refined.noise.rotation.front();
  extrinsics.robot_translation_m = calibration.refined.noise.translation.front();
  extrinsics.inputs = inputs;
  return extrinsics;
}

Json to_json(const NamedTransform& transform) {
  const Eigen::Matrix<double, 7, 1> v = data::to_vector(transform.T);
  return {{"parent", transform.parent},
          {"child", transform.child},
          {"translation", list(v.head<3>())},
          {"rotation_xyzw", list(v.tail<4>())}};
}

Json to_json(const Calibration& calibration, const ExtrinsicsInputs& inputs, int exit_code) {
  const Extrinsics extrinsics = extrinsics_of(calibration, inputs);
  const Vector6d sd = calibration.covariance.diagonal().cwiseSqrt();
  Json json = {{"schema", "flash-extrinsics/1"},
               {"setup", to_string(extrinsics.setup)},
               {"method", extrinsics.method},
               {"transform", to_json(extrinsics.transform)},
               {"target_pose", to_json(extrinsics.target_pose)},
               {"covariance", rows(calibration.covariance)}};
  json["predicted_sd"] = {{"translation_mm", list(Eigen::Vector3d(1e3 * sd.head<3>()))},
                          {"rotation_deg", list(Eigen::Vector3d(kDegrees * sd.tail<3>()))}};
  const auto px = [&](double value) { return extrinsics.pixels ? Json(value) : Json(nullptr); };
  json["sigmas"] = {
      {"corner_px", px(extrinsics.corner_px)},
      {"robot_rotation_rad", extrinsics.robot_rotation_rad},
      {"robot_translation_m", extrinsics.robot_translation_m},
      {"depth_m", inputs.depth && inputs.depth->used ? Json(inputs.depth->sigma) : Json(nullptr)}};
  json["residuals"] = {{"reprojection_rms_px", px(calibration.chain_rms)},
                       {"corner_rms_px", px(calibration.corner_rms)},
                       {"centre_rms_px", px(calibration.centre_rms)},
                       {"heldout_px", px(calibration.held_out.px)},
                       {"heldout_mm", calibration.held_out.mm},
                       {"heldout_deg", calibration.held_out.deg}};
  json["depth"] = inputs.depth ? depth_json(*inputs.depth) : Json(nullptr);
  json["time_offset"] = inputs.time_offset ? Json{{"estimate_s", inputs.time_offset->estimate},
                                                  {"sd_s", inputs.time_offset->sd}}
                                           : Json(nullptr);
  json["comparison"] = comparison_json(calibration);
  json["views"] = views_json(calibration);
  json["observability"] = {
      {"turn_spread_deg", list(Eigen::Vector3d(kDegrees * calibration.diversity.spread))},
      {"first_axis_share", calibration.diversity.first_share},
      {"condition", calibration.weakest.condition},
      {"weakest", calibration.weakest.name},
      {"weakest_mm", 1e3 * calibration.weakest.translation},
      {"weakest_deg", kDegrees * calibration.weakest.rotation}};
  json["convention_findings"] = Json::array();
  json["scale"] = calibration.scale ? Json{{"estimate", calibration.scale->estimate},
                                           {"sd", calibration.scale->sd},
                                           {"solved", calibration.scale->solved}}
                                    : Json(nullptr);
  json["splits"] = nullptr;
  if (!calibration.splits.empty()) {
    json["splits"] = {{"covariance_factor", calibration.covariance_factor}};
    for (const SplitCheck& check : calibration.splits)
      json["splits"][to_string(check.split)] = {{"apart_mm", 1e3 * check.apart.head<3>().norm()},
                                                {"apart_deg", kDegrees * check.apart.tail<3>().norm()},
                                                {"chi_square", check.chi_square}};
  }
  json["smooth_errors"] = nullptr;
  if (calibration.smooth_errors) {
    const SmoothErrors& errors = *calibration.smooth_errors;
    json["smooth_errors"] = {{"found", errors.found},
                             {"gain", errors.gain},
                             {"translation_m", errors.translation},
                             {"rotation_rad", errors.rotation},
                             {"about_base_rad", errors.about_base},
                             {"reach", errors.reach}};
  }
  json["warnings"] = calibration.warnings;
  json["exit_code"] = exit_code;
  json["provenance"] = {{"tool", "flash-calib"},    {"version", FLASH_VERSION}, {"dataset", inputs.dataset},
                        {"target", inputs.target},  {"poses", inputs.poses},    {"camera", inputs.camera},
                        {"refiner", inputs.refiner}};
  json["provenance"]["depth_scale"] =
      inputs.depth && inputs.depth->used ? Json(inputs.depth->scale) : Json(nullptr);
  return json;
}

Extrinsics load_extrinsics(const std::string& path, bool accept_unusable) {
  const nlohmann::json file = data::load_json(path);
  const data::JsonObject object(file, path);
  const data::CameraPose pose = data::read_camera_pose(object, accept_unusable);
  Extrinsics extrinsics;
  extrinsics.setup = parse_setup(object.string("setup"), path, "setup");
  extrinsics.method = object.string("method");
  extrinsics.transform = pose.transform;
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
  if (!extrinsics.covariance.isApprox(extrinsics.covariance.transpose(), 1e-6) ||
      extrinsics.covariance.diagonal().minCoeff() < 0)
    throw object.error("covariance", "a symmetric matrix");
  if (object.has("sigmas")) {
    const data::JsonObject sigmas = object.object("sigmas");
    extrinsics.pixels = sigmas.has("corner_px");
    extrinsics.corner_px = sigmas.not_negative("corner_px", 0);
    extrinsics.robot_rotation_rad = sigmas.not_negative("robot_rotation_rad");
    extrinsics.robot_translation_m = sigmas.not_negative("robot_translation_m");
  }
  if (object.has("scale")) {
    const data::JsonObject scale = object.object("scale");
    if (scale.boolean("solved", false)) extrinsics.target_scale = scale.positive("estimate");
  }
  if (object.has("provenance")) {
    const data::JsonObject from = object.object("provenance");
    extrinsics.inputs = {from.string("dataset", ""), from.string("target", ""), from.string("poses", ""),
                         from.string("camera", ""), from.string("refiner", "")};
    if (from.has("depth_scale")) {
      DepthUse& depth = extrinsics.inputs.depth.emplace();
      depth.used = true;
      depth.scale = from.positive("depth_scale");
    }
  }
  if (object.has("time_offset")) {
    const data::JsonObject offset = object.object("time_offset");
    extrinsics.inputs.time_offset = {offset.number("estimate_s"), offset.not_negative("sd_s")};
  }
  return extrinsics;
}

}  // namespace flash::calib
