#include <algorithm>
#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/calib/options.h"
#include "apps/calib/verbs.h"
#include "apps/command_line/command_line.h"
#include "apps/command_line/option_checks.h"
#include "apps/command_line/result_files.h"
#include "calib/dataset/lens_file.h"
#include "calib/dataset/told_shape.h"
#include "calib/detect/finder.h"
#include "calib/detect/grey_image.h"
#include "calib/detect/intrinsics.h"
#include "data/files/error.h"
#include "data/files/json_reader.h"
#include "data/files/text.h"
#include "data/files/writable.h"

namespace flash {
namespace {

struct IntrinsicsOptions {
  CalibCommonOptions common;
  DatasetChoice dataset;
  std::string model = "plumb_bob";
  std::string out;
};

const char* const kNames[] = {"fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"};

data::DistortionModel model_of(const std::string& name) {
  if (name == "none") return data::DistortionModel::none;
  return name == "plumb_bob" ? data::DistortionModel::plumb_bob : data::DistortionModel::rational_polynomial;
}

nlohmann::ordered_json result_json(const calib::IntrinsicsEstimate& estimate) {
  nlohmann::ordered_json json;
  json["schema"] = "flash-intrinsics/1";
  json["width"] = estimate.camera.width;
  json["height"] = estimate.camera.height;
  const calib::IntrinsicsVector values = calib::to_vector(estimate.camera);
  for (Eigen::Index i = 0; i < 4 + static_cast<Eigen::Index>(estimate.camera.distortion.size()); ++i)
    json["parameters"][kNames[i]] = {{"estimate", values[i]}, {"sd", estimate.sd[i]}};
  const calib::Warp warp = 1e3 * estimate.warp.estimate, warp_sd = 1e3 * estimate.warp.sd;
  json["warp_mm"] = {warp.x(), warp.y(), warp.z()};
  json["warp_sd_mm"] = {warp_sd.x(), warp_sd.y(), warp_sd.z()};
  if (estimate.edges) {
    json["edge_offset_px"] = estimate.edges->estimate;
    json["edge_offset_sd_px"] = estimate.edges->sd;
  }
  json["reprojection_rms_px"] = estimate.rms;
  json["picture_corner_sd_px"] = estimate.corner_sd;
  json["sd_factor_of_views"] = std::sqrt(estimate.view_factor);
  json["coverage"] = estimate.coverage;
  json["tilt_rad"] = estimate.tilt;
  json["views"] = nlohmann::json::array();
  for (const calib::IntrinsicsView& view : estimate.views)
    json["views"].push_back(
        {{"image", view.image}, {"used", view.reason.empty()}, {"reason", view.reason}, {"px", view.rms}});
  json["warnings"] = estimate.warnings;
  return json;
}

void print_table(const calib::IntrinsicsEstimate& estimate) {
  const calib::IntrinsicsVector values = calib::to_vector(estimate.camera);
  for (Eigen::Index i = 0; i < 4 + static_cast<Eigen::Index>(estimate.camera.distortion.size()); ++i)
    std::printf("%-3s %12.5g  +- %.2g%s\n", kNames[i], values[i], estimate.sd[i], i < 4 ? " px" : "");
  const std::string warp = calib::describe(estimate.warp);
  if (!warp.empty()) std::printf("target: %s\n", warp.c_str());
  if (estimate.edges && calib::told(*estimate.edges))
    std::printf("%s\n", calib::describe(*estimate.edges).c_str());
  std::printf("%.3f px rms a corner; places at the picture's corners known to %.2g px%s\n", estimate.rms,
              estimate.corner_sd, estimate.corner_sd < calib::most_corner_sd ? "" : ", or not at all");
}

// Corners are found twice: the lens must be known for places at which straight things are straight.
int run_intrinsics(const IntrinsicsOptions& options) {
  if (!options.out.empty()) data::check_file_free(options.out, options.common.force);
  calib::Dataset dataset = load_dataset(options.dataset, false, false);
  expect_own_files({options.out}, files_read(options.dataset, dataset, options.common));
  expect_ending("--out", options.out, {".yaml", ".yml"});
  const calib::Target target = target_of(options.dataset, dataset);
  dataset.camera.reset();
  calib::IntrinsicsSettings settings;
  settings.model = model_of(options.model);
  calib::IntrinsicsEstimate estimate;
  for (int round = 0; round < 2; ++round) {
    CalibCommonOptions common = options.common;
    common.quiet = common.quiet || round > 0;
    const std::vector<calib::Detection> detections = detect_all(dataset, target, options.dataset, common);
    const calib::GreyImage first = calib::load_grey_image(dataset.frames.front().image);
    estimate = calib::calibrate_intrinsics(target, calib::observations_of(detections, calib::kImageModel),
                                           first.width, first.height, settings);
    dataset.camera = estimate.camera;
    dataset.camera_path = "the estimate";
  }
  for (const calib::IntrinsicsView& view : estimate.views)
    if (!view.reason.empty()) warn_calib(view.image + ": left out: " + view.reason);
  for (const std::string& warning : estimate.warnings) warn_calib(warning);
  if (!options.out.empty()) calib::save_lens(estimate.camera, estimate.covariance, options.out);
  if (options.common.json)
    std::cout << data::format_json(result_json(estimate)) << '\n';
  else
    print_table(estimate);
  if (estimate.usable()) return exit_done;
  say_unusable("the focal length is known to " +
               data::format_short(
                   100 * std::max(estimate.sd[0] / estimate.camera.fx, estimate.sd[1] / estimate.camera.fy)) +
               " %, expected " + data::format_short(100 * calib::most_focal_sd) + " % or better");
  return exit_unusable;
}

}  // namespace

void add_intrinsics_verb(CLI::App& app, Action& action) {
  const auto options = std::make_shared<IntrinsicsOptions>();
  CLI::App* verb = app.add_subcommand("intrinsics", "Calibrate the camera itself, with standard deviations");
  add_dataset_options(*verb, options->dataset);
  verb->add_option("--model", options->model,
                   "Of the lens: none, plumb_bob (5 coefficients), rational_polynomial (8)")
      ->check(CLI::IsMember({"none", "plumb_bob", "rational_polynomial"}))
      ->capture_default_str();
  verb->add_option("-o,--out", options->out, "camera_info YAML to write");
  add_calib_common_options(*verb, options->common);
  verb->footer(
      "Exit code 3: the focal length is known to no better than 5 %; the file is written.\n"
      "Example:\n  flash-calib intrinsics recording --target chessboard:9x6:0.025 -o camera_info.yaml");
  verb->callback([options, &action] { action = [options] { return run_intrinsics(*options); }; });
}

}  // namespace flash
