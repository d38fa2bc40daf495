#include "python/calib/bindings/handeye.h"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "calib/calibrate/calibrate.h"
#include "calib/calibrate/calibrate_pairs.h"
#include "calib/dataset/detection.h"
#include "calib/dataset/edge_offset.h"
#include "calib/dataset/posed_detection.h"
#include "calib/dataset/symmetry.h"
#include "calib/dataset/target.h"
#include "calib/report/extrinsics_json.h"
#include "data/files/json_reader.h"
#include "data/motion/pose_numbers.h"
#include "python/bindings/arrays.h"
#include "python/calib/bindings/camera.h"

namespace flash::python {

namespace nb = nanobind;

namespace {

/// Rows of 16 or 7 numbers.
std::vector<Eigen::Isometry3d> poses_of(const Numbers& rows, const std::string& name) {
  const std::size_t count = rows.shape(0), width = count > 0 ? rows.size() / count : 0;
  std::vector<Eigen::Isometry3d> poses;
  for (std::size_t i = 0; i < count; ++i) {
    const double* const first = rows.data() + i * width;
    poses.push_back(data::pose_of_numbers({first, first + width}, name, "pose " + std::to_string(i)));
  }
  return poses;
}

/// A calibration, and the file that flash-calib would write of it.
struct Answer {
  calib::Calibration calibration;
  std::string text;
};

Answer answer_of(calib::Calibration calibration, const calib::ExtrinsicsInputs& inputs) {
  std::string text = data::format_json(calib::to_json(calibration, inputs, calibration.usable ? 0 : 3));
  return {std::move(calibration), std::move(text)};
}

nb::dict to_dict(const Answer& answer) {
  const calib::Calibration& c = answer.calibration;
  nb::dict found;
  found["text"] = answer.text;
  found["T"] = array_of(c.poses.X.matrix());
  found["target_pose"] = array_of(c.poses.Z.matrix());
  found["covariance"] = array_of(c.covariance);
  found["repeatable"] = array_of(c.repeatable);
  found["refusals"] = c.refusals;
  return found;
}

nb::dict handeye_pairs(const std::string& setup, const Numbers& robot, const Numbers& target,
                       const calib::CalibrateSettings& settings) {
  const auto solve = [&] {
    const nb::gil_scoped_release release;
    const std::vector<Eigen::Isometry3d> grippers = poses_of(robot, "T_base_gripper"),
                                         targets = poses_of(target, "T_camera_target");
    std::vector<calib::Observation> pairs(grippers.size());
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      pairs[i].image = "sample " + std::to_string(i);  // as pairs of a file are named
      pairs[i].T_base_gripper = grippers[i];
      pairs[i].pixels.resize(2, 0);
      pairs[i].T_camera_target = {targets[i]};
    }
    return answer_of(
        calib::calibrate_pairs(calib::parse_setup(setup, "handeye_pairs", "setup"), pairs, settings), {});
  };
  return to_dict(solve());
}

/// What is to be seen: points, how they may be confused, and of which kind their corners are.
struct Shown {
  Eigen::Matrix3Xd points;
  std::vector<calib::Symmetry> symmetries;
  std::optional<calib::TargetKind> kind = {};
};

Shown shown_by(const std::string& words) {
  const calib::Target target = calib::parse_target(words);
  return {calib::target_points(target), calib::confusable_symmetries(target), target.kind};
}

Shown shown_by(const Numbers& rows, bool any_end) {
  Shown shown;
  shown.points = Eigen::Map<const Eigen::Matrix3Xd>(rows.data(), 3, static_cast<Eigen::Index>(rows.shape(0)));
  shown.symmetries = calib::grid_symmetries(shown.points);
  if (!any_end) shown.symmetries.resize(1);
  return shown;
}

/// Markers have edges at all four corners, which say how far those stand outwards.
bool has_edges(const Shown& shown) {
  return shown.kind && calib::outward_motion(*shown.kind, Eigen::Matrix2Xd::Zero(2, 4)).cols() > 0;
}

/// The corners of a view that were seen, those with numbers. pixels: row by row.
calib::Observation corners_of(const double* pixels, const Shown& shown) {
  const auto seen = [&](int i) { return std::isfinite(pixels[2 * i]) && std::isfinite(pixels[2 * i + 1]); };
  const bool edges = has_edges(shown);
  calib::Observation view;
  for (int i = 0; i < shown.points.cols(); ++i) {
    const int first = i - i % 4;
    const bool whole = seen(first) && seen(first + 1) && seen(first + 2) && seen(first + 3);
    if (edges ? whole : seen(i)) view.points.push_back(i);
  }
  view.pixels.resize(2, std::ssize(view.points));
  for (Eigen::Index k = 0; k < view.pixels.cols(); ++k) {
    const double* const pixel = pixels + 2 * view.points[static_cast<std::size_t>(k)];
    view.pixels.col(k) << pixel[0], pixel[1];
  }
  if (edges) view.outward = calib::outward_motion(*shown.kind, view.pixels);
  return view;
}

/// pixels: N x M x 2; not a number where a point was not seen.
calib::Calibration calibrate_corners(calib::Setup setup, const std::vector<Eigen::Isometry3d>& grippers,
                                     const double* pixels, const Shown& shown,
                                     const data::CameraIntrinsics& camera,
                                     const calib::CalibrateSettings& settings) {
  std::vector<calib::Detection> detections;
  for (std::size_t i = 0; i < grippers.size(); ++i) {
    calib::Observation view =
        corners_of(pixels + 2 * static_cast<std::size_t>(shown.points.cols()) * i, shown);
    view.image = "view " + std::to_string(i);
    view.T_base_gripper = grippers[i];
    calib::Detection& detection = detections.emplace_back();
    detection.image = view.image;
    if (view.points.size() < 4) {
      detection.reason = "found " + std::to_string(view.points.size()) + " corners, expected 4 or more";
      continue;
    }
    detection.readings.push_back({"given", std::move(view)});
    calib::add_poses(camera, shown.points, {}, detection);
  }
  calib::drop_misfits({}, detections);
  std::vector<calib::Observation> views;
  for (const calib::Detection& detection : detections) {
    calib::Observation missing;
    missing.image = detection.image;
    views.push_back(detection.readings.empty() ? missing : detection.readings.front().observation);
  }
  calib::Calibration found = calib::calibrate(setup, camera, shown.points, shown.symmetries, views, settings);
  for (std::size_t i = 0; i < detections.size(); ++i)
    if (!detections[i].reason.empty()) found.views[i].reason = detections[i].reason;
  return found;
}

nb::dict handeye_corners(const std::string& setup, const Numbers& robot, const Numbers& pixels,
                         const Numbers& points, const std::string& target, bool any_end,
                         const Numbers& camera, const calib::CalibrateSettings& settings) {
  const auto solve = [&] {
    const nb::gil_scoped_release release;
    const Shown shown = target.empty() ? shown_by(points, any_end) : shown_by(target);
    return answer_of(calibrate_corners(calib::parse_setup(setup, "handeye_corners", "setup"),
                                       poses_of(robot, "T_base_gripper"), pixels.data(), shown,
                                       camera_of(camera), settings),
                     {.dataset = "", .target = target, .poses = "", .camera = "", .refiner = "given"});
  };
  return to_dict(solve());
}

}  // namespace

void bind_handeye(nb::module_& module) {
  using Settings = calib::CalibrateSettings;
  nb::class_<Settings>(module, "Settings")
      .def(nb::init<>())
      .def("set_use", [](Settings& s, const std::string& name) { s.use = *calib::use_named(name); })
      .def("set_lens",
           [](Settings& s, const std::string& name) {
             s.lens = name == "stated"   ? calib::LensKnowledge::stated
                      : name == "solved" ? calib::LensKnowledge::unknown
                                         : calib::LensKnowledge::near;
           })
      .def("set_lens_covariance",
           [](Settings& s, const Numbers& rows) { s.lens_covariance = lens_covariance_of(rows); })
      .def("set_height", [](Settings& s, bool target, double height,
                            double sd) { s.height = {.target = target, .height = height, .sd = sd}; })
      .def_rw("target_size_sd", &Settings::target_size_sd)
      .def_rw("size_as_stated", &Settings::size_as_stated)
      .def_rw("held_out_seed", &Settings::held_out_seed)
      .def_rw("threads", &Settings::threads);
  module.def("handeye_pairs", &handeye_pairs);
  module.def("handeye_corners", &handeye_corners);
}

}  // namespace flash::python
