#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/calib/options.h"
#include "apps/calib/verbs.h"
#include "apps/command_line/command_line.h"
#include "apps/command_line/result_files.h"
#include "calib/detect/plane_residual.h"
#include "data/files/atomic_file.h"
#include "data/files/json_reader.h"
#include "data/files/writable.h"

namespace flash {
namespace {

struct DetectOptions {
  CalibCommonOptions common;
  DatasetChoice dataset;
  std::string out;
};

/// posed: there are intrinsics, and with them poses that corners can be held against. Without, a flat target
/// is.
nlohmann::ordered_json reading_json(const calib::CornerReading& reading,
                                    const Eigen::Matrix3Xd& target_points, bool posed) {
  const calib::Observation& observation = reading.observation;
  nlohmann::ordered_json pixels = nlohmann::json::array();
  for (Eigen::Index i = 0; i < observation.pixels.cols(); ++i)
    pixels.push_back({observation.pixels(0, i), observation.pixels(1, i)});
  return {{"refiner", reading.refiner},
          {posed ? "pose_rms_px" : "plane_rms_px",
           posed ? observation.pose_rms : calib::plane_residual(target_points, observation)},
          {"points", observation.points},
          {"pixels", std::move(pixels)}};
}

nlohmann::ordered_json result_json(const std::vector<calib::Detection>& detections,
                                   const Eigen::Matrix3Xd& target_points, bool posed) {
  nlohmann::ordered_json json;
  json["schema"] = "flash-detections/1";
  json["target_points"] = nlohmann::json::array();
  for (const auto& point : target_points.colwise())
    json["target_points"].push_back({point.x(), point.y(), point.z()});
  json["refiners"] = nlohmann::json::array();
  for (const calib::RefinerScore& score : calib::rank_refiners(detections))
    json["refiners"].push_back(
        {{"refiner", score.refiner}, {"pose_rms_px", score.rms}, {"views", score.views}});
  json["views"] = nlohmann::json::array();
  for (const calib::Detection& detection : detections) {
    nlohmann::ordered_json view = {{"image", detection.image}, {"found", detection.reason.empty()}};
    if (!detection.reason.empty()) view["reason"] = detection.reason;
    view["readings"] = nlohmann::json::array();
    for (const calib::CornerReading& reading : detection.readings)
      view["readings"].push_back(reading_json(reading, target_points, posed));
    json["views"].push_back(std::move(view));
  }
  return json;
}

void print_table(const std::vector<calib::Detection>& detections, const Eigen::Matrix3Xd& target_points,
                 bool posed) {
  std::size_t found = 0;
  for (const calib::Detection& detection : detections) {
    found += detection.readings.empty() ? 0 : 1;
    std::printf("%-24s", detection.image.c_str());
    if (detection.readings.empty()) std::printf("  %s", detection.reason.c_str());
    for (const calib::CornerReading& reading : detection.readings) {
      const calib::Observation& observation = reading.observation;
      std::printf("  %s %.3f px (%zu)", reading.refiner.c_str(),
                  posed ? observation.pose_rms : calib::plane_residual(target_points, observation),
                  observation.points.size());
    }
    std::printf("\n");
  }
  std::printf("%zu of %zu pictures show the target\n", found, detections.size());
  if (!posed) {
    std::printf("px: from a flat target through a lens that bends nothing; with intrinsics, from its pose\n");
    return;
  }
  for (const calib::RefinerScore& score : calib::rank_refiners(detections))
    std::printf("%-16s %.3f px rms a corner, %d views\n", score.refiner.c_str(), score.rms, score.views);
}

int run_detect(const DetectOptions& options) {
  if (!options.out.empty()) data::check_file_free(options.out, options.common.force);
  const calib::Dataset dataset = load_dataset(options.dataset, false, false);
  expect_own_files({options.out}, files_read(options.dataset, dataset, options.common));
  const calib::Target target = target_of(options.dataset, dataset);
  CalibCommonOptions without_warnings = options.common;  // the table says the same
  without_warnings.quiet = true;
  const std::vector<calib::Detection> detections =
      detect_all(dataset, target, options.dataset, without_warnings);
  const Eigen::Matrix3Xd points = calib::target_points(target);
  const bool posed = dataset.camera.has_value();
  const std::string text = data::format_json(result_json(detections, points, posed)) + '\n';
  if (!options.out.empty()) data::write_atomically(options.out, text);
  if (options.common.json)
    std::cout << text;
  else
    print_table(detections, points, posed);
  return exit_done;
}

}  // namespace

void add_detect_verb(CLI::App& app, Action& action) {
  const auto options = std::make_shared<DetectOptions>();
  CLI::App* verb =
      app.add_subcommand("detect", "Find the target in every picture, to a few hundredths of a pixel");
  add_dataset_options(*verb, options->dataset);
  verb->add_option("-o,--out", options->out, "File for the corners, JSON");
  add_calib_common_options(*verb, options->common);
  verb->footer("Example:\n  flash-calib detect recording --target chessboard:9x6:0.025 -o corners.json");
  verb->callback([options, &action] { action = [options] { return run_detect(*options); }; });
}

}  // namespace flash
