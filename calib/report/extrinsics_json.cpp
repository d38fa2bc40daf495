#include "calib/report/extrinsics_json.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "calib/report/json_list.h"
#include "calib/uncertainty/joint_errors.h"
#include "data/camera/posed_lens.h"
#include "data/motion/trajectory.h"

namespace flash::calib {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kDegrees = 180 / M_PI;

template <class Matrix>
Json rows(const Matrix& m) {
  Json values = Json::array();
  for (Eigen::Index i = 0; i < m.rows(); ++i) values.push_back(list(m.row(i)));
  return values;
}

/// By how many standard errors over the folds the answer's squared residuals exceed another method's.
Json behind_json(const HeldOut& answer, const HeldOut& other) {
  Json behind = Json::object();
  for (const auto& [measure, name] : {std::pair{0, "px"}, {1, "mm"}, {2, "deg"}}) {
    const MeanDifference d = mean_difference(means_of_folds(answer, measure), means_of_folds(other, measure));
    behind[name] = d.sd > 0 ? Json(d.mean / d.sd) : Json(nullptr);
  }
  return behind;
}

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
      // Mean squares of px, mm and deg over the views of each fold.
      if (pixels)
        entry["heldout_folds"] = {means_of_folds(*method.held_out, 0), means_of_folds(*method.held_out, 1),
                                  means_of_folds(*method.held_out, 2)};
      if (pixels) entry["behind"] = behind_json(calibration.held_out, *method.held_out);
    }
    if (method.halves) entry["halves_apart_mm"] = method.halves->apart;
    entry["wild"] = method.wild;
    entry["translation"] = list(method.poses.X.translation());
    entry["rotation_xyzw"] = list(data::to_vector(method.poses.X).tail<4>());
    methods[method.name] = std::move(entry);
  }
  return methods;
}

/// What the answer is for, its error in that, and of halves which views made the first.
Json use_json(const Calibration& calibration) {
  const UseError& use = calibration.use;
  Json json = {{"for", to_string(use.use)}, {"measure", use.measure}, {"unit", use.unit}};
  json["error"] = use.value ? Json(*use.value) : Json(nullptr);
  const std::optional<Halves>* halves = nullptr;
  for (const ComparedMethod& method : calibration.comparison)
    if (method.halves) halves = &method.halves;
  if (halves) json["first_halves"] = (*halves)->first;
  return json;
}

Json views_json(const Calibration& calibration) {
  const bool pixels = has_pixels(calibration);
  Json views = Json::array();
  for (std::size_t i = 0; i < calibration.views.size(); ++i) {
    const ViewResult& view = calibration.views[i];
    Json entry = {{"image", calibration.selection.observations[i].image}, {"used", view.used}};
    entry["reason"] = view.used ? Json(nullptr) : Json(view.reason);
    entry["px"] = view.used && pixels ? Json(view.px) : Json(nullptr);
    if (view.used && pixels) {
      entry["chain_px"] = view.chain_px;
      entry["correction_mm"] = 1e3 * view.correction.head<3>().norm();
      entry["correction_deg"] = view.correction.tail<3>().norm() * kDegrees;
    }
    if (view.used) {
      const Observation& observation = calibration.selection.observations[i];
      entry["base_gripper"] = list(data::to_vector(observation.T_base_gripper));
      entry["camera_target"] = list(data::to_vector(observation.T_camera_target.front()));
    }
    if (view.used) entry["renumbered"] = calibration.selection.views[i].symmetry != 0;
    views.push_back(std::move(entry));
  }
  return views;
}

Json lens_json(const data::CameraIntrinsics& lens) {
  return {
      {"focal_px", {lens.fx, lens.fy}}, {"centre_px", {lens.cx, lens.cy}}, {"distortion", lens.distortion}};
}

/// The axis that the robot turns about, without minus zeros, and where the answer has camera and target along
/// it.
Json along_json(const PlaceAlong& along, const HandEyePoses& poses) {
  Json json = {{"told", along.told},
               {"camera_axis", list(Eigen::Vector3d(along.axis.camera.array() + 0.0))},
               {"camera_m", along.axis.camera.dot(poses.X.translation())},
               {"target_axis", list(Eigen::Vector3d(along.axis.target.array() + 0.0))},
               {"target_m", along.axis.target.dot(poses.Z.translation())},
               {"measured", nullptr}};
  if (const std::optional<MeasuredHeight>& measured = along.measured)
    json["measured"] = {{"what", measured->target ? "target" : "camera"},
                        {"height_m", measured->height},
                        {"sd_m", measured->sd}};
  return json;
}

/// Of these errors, in `unit`, of which one of SI has `scale`; null stands for those of another.
Json errors_json(const JointErrors& errors, const std::vector<std::optional<Eigen::Index>>& which,
                 double scale, const std::string& unit) {
  Json estimates = Json::array(), deviations = Json::array(), intervals = Json::array();
  for (const std::optional<Eigen::Index>& i : which) {
    estimates.push_back(i ? Json(scale * errors.estimate[*i]) : Json(nullptr));
    deviations.push_back(i ? Json(scale * errors.sd[*i]) : Json(nullptr));
    intervals.push_back(i ? list(Eigen::Vector2d(scale * errors.interval(*i))) : Json(nullptr));
  }
  return {{"estimate_" + unit, estimates}, {"sd_" + unit, deviations}, {"interval_" + unit, intervals}};
}

Json told_json(const JointErrors& errors, Eigen::Index first, Eigen::Index count) {
  Json told = Json::array();
  for (Eigen::Index i = first; i < first + count; ++i) told.push_back(errors.told(i));
  return told;
}

Json origin_json(const Eigen::Isometry3d& origin) {
  return {{"xyz", list(origin.translation())}, {"rpy", list(roll_pitch_yaw(origin.linear()))}};
}

/// Zeros of joints, lengths of links, and the origins of joints with both.
void add_joint_errors(const Calibration& calibration, const Extrinsics& extrinsics, Json& json) {
  for (const char* field : {"joint_zeros", "link_lengths", "joint_origins"}) json[field] = nullptr;
  const auto errors =
      joint_errors(calibration.refined.bundle, calibration.unknowns, calibration.shared_covariance);
  if (!errors || !extrinsics.inputs.arm) return;
  const ArmModel& arm = *extrinsics.inputs.arm;
  const auto lengths = static_cast<Eigen::Index>(arm.lengths.size()), zeros = errors->sd.size() - lengths;
  std::vector<std::optional<Eigen::Index>> turning, sliding, all;
  for (const Joint& joint : arm.chain.joints) {
    if (joint.kind == Joint::Kind::fixed) continue;
    const auto i = static_cast<Eigen::Index>(turning.size());
    const bool turns = joint.kind == Joint::Kind::revolute;
    turning.push_back(turns ? std::optional(i) : std::nullopt);
    sliding.push_back(turns ? std::nullopt : std::optional(i));
  }
  json["joint_zeros"] = {{"joints", moving_joints(arm.chain)}, {"told", told_json(*errors, 0, zeros)}};
  json["joint_zeros"].update(errors_json(*errors, turning, kDegrees, "deg"));
  json["joint_zeros"].update(errors_json(*errors, sliding, 1e3, "mm"));
  json["joint_origins"] = Json::array();
  for (const JointOrigin& origin : extrinsics.joint_origins)
    json["joint_origins"].push_back(
        {{"joint", origin.joint.name},
         {"kind", to_string(origin.joint.kind)},
         {"axis", origin.joint.kind == Joint::Kind::fixed ? Json(nullptr) : Json(list(origin.joint.axis))},
         {"described", origin_json(origin.joint.origin)},
         {"corrected", origin_json(origin.corrected)}});
  if (lengths == 0) return;
  Json joints = Json::array(), directions = Json::array();
  for (const LinkLength& length : arm.lengths) {
    joints.push_back(arm.chain.joints[length.joint].name);
    directions.push_back(list(Eigen::Vector3d(length.direction.array() + 0.0)));  // no minus zero
  }
  for (Eigen::Index i = 0; i < lengths; ++i) all.emplace_back(zeros + i);
  json["link_lengths"] = {{"prior_sd_mm", 1e3 * arm.length_sd},
                          {"joints", joints},
                          {"directions", directions},
                          {"told", told_json(*errors, zeros, lengths)}};
  json["link_lengths"].update(errors_json(*errors, all, 1e3, "mm"));
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

Json to_json(const NamedTransform& transform) {
  const Eigen::Matrix<double, 7, 1> v = data::to_vector(transform.T);
  return {{"parent", transform.parent},
          {"child", transform.child},
          {"translation", list(v.head<3>())},
          {"rotation_xyzw", list(v.tail<4>())}};
}

Json to_json(const ToldDeviations& deviations, bool rotation) {
  Json values = Json::array();
  for (std::size_t i = rotation ? 3 : 0, end = i + 3; i < end; ++i)
    values.push_back(deviations[i] ? Json(*deviations[i] * (rotation ? kDegrees : 1e3)) : Json(nullptr));
  return values;
}

Json to_json(const TargetSize& size) {
  return {{"estimate", size.estimate},
          {"sd", size.sd},
          {"solved", size.sd > 0},
          {"prior_sd", std::isfinite(size.prior_sd) ? Json(size.prior_sd) : Json(nullptr)},
          {"wanted", size.wanted ? Json(size.wanted->estimate) : Json(nullptr)},
          {"wanted_sd", size.wanted ? Json(size.wanted->sd) : Json(nullptr)}};
}

Json to_json(const Calibration& calibration, const ExtrinsicsInputs& inputs, int exit_code) {
  const Extrinsics extrinsics = extrinsics_of(calibration, inputs);
  Json json = {{"schema", "flash-extrinsics/2"},
               {"setup", to_string(extrinsics.setup)},
               {"method", extrinsics.method},
               {"transform", to_json(extrinsics.transform)},
               {"target_pose", to_json(extrinsics.target_pose)},
               {"covariance", rows(calibration.covariance)}};
  const ToldDeviations sd = told_deviations(calibration, calibration.covariance, Axes::camera),
                       in_parent = told_deviations(calibration, calibration.covariance, Axes::parent),
                       here = told_deviations(calibration, calibration.repeatable, Axes::parent);
  json["predicted_sd"] = {{"translation_mm", to_json(sd, false)},
                          {"rotation_deg", to_json(sd, true)},
                          {"translation_parent_mm", to_json(in_parent, false)},
                          {"rotation_parent_deg", to_json(in_parent, true)},
                          {"repeatable_parent_mm", to_json(here, false)},
                          {"repeatable_parent_deg", to_json(here, true)}};
  json["one_axis"] = calibration.along ? along_json(*calibration.along, calibration.poses) : Json(nullptr);
  const auto px = [&](double value) { return extrinsics.pixels ? Json(value) : Json(nullptr); };
  const auto sight = [&](double SightNoise::*part) {
    return calibration.sight_noise ? Json((*calibration.sight_noise).*part) : Json(nullptr);
  };
  json["sigmas"] = {
      {"corner_px", px(extrinsics.corner_px)},
      {"robot_rotation_rad", extrinsics.robot_rotation_rad},
      {"robot_translation_m", extrinsics.robot_translation_m},
      {"across_sight_m", sight(&SightNoise::across)},
      {"along_sight_m", sight(&SightNoise::along)},
      {"depth_m", inputs.depth && inputs.depth->used ? Json(inputs.depth->sigma) : Json(nullptr)}};
  json["use"] = use_json(calibration);
  json["residuals"] = {{"reprojection_rms_px", px(calibration.chain_rms)},
                       {"corner_rms_px", px(calibration.corner_rms)},
                       {"centre_rms_px", px(calibration.centre_rms)},
                       {"heldout_px", px(calibration.held_out.px)},
                       {"heldout_mm", calibration.held_out.mm},
                       {"heldout_deg", calibration.held_out.deg},
                       {"heldout_part", calibration.held_out.fold}};
  json["lens"] = nullptr;
  if (extrinsics.pixels) {
    const data::CameraIntrinsics &lens = *extrinsics.lens, &stated = *extrinsics.stated_lens;
    json["lens"] = {{"solved", calibration.unknowns.intrinsics > 0},
                    {"as_stated", data::same_lens(lens, stated)},
                    {"stated_excluded", !calibration.lens.far_off.empty()},
                    {"size_px", {lens.width, lens.height}}};
    json["lens"].update(lens_json(lens));
    json["lens"]["sd"] = list(Eigen::VectorXd(calibration.lens.sd.head(kLensUnknowns)));
    json["lens"]["sd_factor_of_views"] = std::sqrt(calibration.lens_view_factor);
    json["lens"]["stated"] = lens_json(stated);
    const Vector6d& shift = calibration.lens.camera_shift;
    json["lens"]["camera_shift_mm"] = list(Eigen::Vector3d(1e3 * shift.head<3>()));
    json["lens"]["camera_shift_deg"] = list(Eigen::Vector3d(kDegrees * shift.tail<3>()));
  }
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
  json["scale"] = calibration.size ? to_json(*calibration.size) : Json(nullptr);
  json["focal_length"] = calibration.focal_length ? to_json(*calibration.focal_length) : Json(nullptr);
  if (calibration.size && has_pixels(calibration)) {
    json["scale"]["warp_mm"] = list(Warp(1e3 * calibration.warp.estimate));
    json["scale"]["warp_sd_mm"] = list(Warp(1e3 * calibration.warp.sd));
  }
  json["edges"] = calibration.edges ? Json{{"offset_px", calibration.edges->estimate},
                                           {"offset_sd_px", calibration.edges->sd},
                                           {"prior_sd_px", kUsualEdgeOffset}}
                                    : Json(nullptr);
  json["splits"] = nullptr;
  if (!calibration.splits.empty()) {
    json["splits"] = {{"covariance_factor", calibration.covariance_factor}};
    for (const SplitCheck& check : calibration.splits)
      json["splits"][to_string(check.split)] = {{"apart_mm", 1e3 * check.apart.head<3>().norm()},
                                                {"apart_deg", kDegrees * check.apart.tail<3>().norm()},
                                                {"chi_square", check.chi_square}};
  }
  if (calibration.other_part) {
    const KnockedPart& other = *calibration.other_part;
    const Vector6d& motion = other.knock.motion;
    json["splits"]["knock"] = {{"view", other.view},
                               {"what", other.knock.camera ? "camera" : "target"},
                               {"told", other.knock.told},
                               {"moved_mm", list(Eigen::Vector3d(1e3 * motion.head<3>()))},
                               {"moved_deg", list(Eigen::Vector3d(kDegrees * motion.tail<3>()))},
                               {"other_part", other.before ? "before" : "after"},
                               {"other_views", other.views}};
    if (other.poses) json["splits"]["knock"]["other_transform"] = list(data::to_vector(other.poses->X));
  }
  if (calibration.drift) {
    const Vector6d& motion = calibration.drift->motion;
    json["splits"]["drift"] = {{"what", calibration.drift->camera ? "camera" : "target"},
                               {"told", calibration.drift->told},
                               {"moved_mm", list(Eigen::Vector3d(1e3 * motion.head<3>()))},
                               {"moved_deg", list(Eigen::Vector3d(kDegrees * motion.tail<3>()))}};
  }
  add_joint_errors(calibration, extrinsics, json);
  const CorrelatedPoseErrors& errors = calibration.pose_errors;
  json["smooth_errors"] = {{"found", errors.found},           {"gain", errors.gain},
                           {"share", errors.share},           {"translation_m", errors.translation},
                           {"rotation_rad", errors.rotation}, {"reach", errors.reach}};
  json["warnings"] = calibration.warnings;
  json["exit_code"] = exit_code;
  json["provenance"] = {{"tool", "flash-calib"},    {"version", FLASH_VERSION}, {"dataset", inputs.dataset},
                        {"target", inputs.target},  {"poses", inputs.poses},    {"camera", inputs.camera},
                        {"refiner", inputs.refiner}};
  if (!inputs.robot.empty()) {
    json["provenance"]["robot"] = inputs.robot;
    json["provenance"]["base_link"] = inputs.base_link;
    json["provenance"]["tip_link"] = inputs.tip_link;
  }
  json["provenance"]["depth_scale"] =
      inputs.depth && inputs.depth->used ? Json(inputs.depth->scale) : Json(nullptr);
  return json;
}

}  // namespace flash::calib
