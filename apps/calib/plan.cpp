#include "calib/calibrate/next_poses.h"

#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/calib/options.h"
#include "apps/calib/verbs.h"
#include "apps/command_line/command_line.h"
#include "apps/command_line/option_checks.h"
#include "apps/command_line/result_files.h"
#include "calib/calibrate/calibrate_images.h"
#include "calib/detect/read_depth.h"
#include "calib/report/extrinsics_json.h"
#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/json_reader.h"
#include "data/files/text.h"
#include "data/files/writable.h"

namespace flash {
namespace {

struct PlanOptions {
  CalibCommonOptions common;
  DatasetChoice dataset;
  std::string setup, criterion = "trace";
  PlanBounds bounds;
  int count = calib::PlanSettings{}.poses;
  unsigned seed = calib::PlanSettings{}.seed;
  std::string out;
};

constexpr double kDegrees = 180 / M_PI;

nlohmann::ordered_json plan_json(const calib::Plan& plan, const PlanOptions& options) {
  nlohmann::ordered_json json = {
      {"schema", "flash-calibration-plan/1"},
      {"criterion", options.criterion},
      {"candidates_seeing_the_target", plan.visible},
      {"now",
       {{"translation_sd_mm", 1e3 * plan.translation_sd}, {"rotation_sd_deg", kDegrees * plan.rotation_sd}}}};
  json["poses"] = nlohmann::json::array();
  for (const calib::PlannedPose& pose : plan.poses) {
    nlohmann::ordered_json entry =
        calib::to_json(calib::NamedTransform{"base", "gripper", pose.T_base_gripper});
    entry["translation_sd_mm"] = 1e3 * pose.translation_sd;
    entry["rotation_sd_deg"] = kDegrees * pose.rotation_sd;
    json["poses"].push_back(std::move(entry));
  }
  return json;
}

void print(const calib::Plan& plan) {
  std::printf(
      "now, by noise alone: +- %.3g mm, %.3g deg an axis; of the candidates %d see the whole target\n",
      1e3 * plan.translation_sd, kDegrees * plan.rotation_sd, plan.visible);
  for (std::size_t i = 0; i < plan.poses.size(); ++i) {
    const Eigen::Vector3d t = plan.poses[i].T_base_gripper.translation();
    const Eigen::Quaterniond q(plan.poses[i].T_base_gripper.linear());
    std::printf("%zu  (%.3f, %.3f, %.3f) m  xyzw (%.4f, %.4f, %.4f, %.4f)  then +- %.3g mm, %.3g deg\n",
                i + 1, t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w(), 1e3 * plan.poses[i].translation_sd,
                kDegrees * plan.poses[i].rotation_sd);
  }
}

int run_plan(const PlanOptions& options) {
  calib::PlanSettings settings = plan_settings(options.bounds);
  settings.poses = options.count;
  settings.seed = options.seed;
  if (options.criterion == "determinant") settings.criterion = calib::PlanCriterion::determinant;
  if (!options.out.empty()) data::check_file_free(options.out, options.common.force);
  const calib::Dataset dataset = load_dataset(options.dataset);
  expect_own_files({options.out}, files_read(options.dataset, dataset, options.common));
  if (options.setup.empty() && !dataset.setup)
    throw data::InputError(dataset.source +
                           ": says nothing of the setup; add --setup eye-in-hand or eye-to-hand");
  const calib::Setup setup =
      options.setup.empty() ? *dataset.setup : calib::parse_setup(options.setup, "command line", "--setup");
  const calib::Target target = target_of(options.dataset, dataset);
  const std::vector<calib::Detection> detections =
      detect_all(dataset, target, options.dataset, options.common);
  calib::CalibrateSettings calibrate;
  if (dataset.lens_covariance) calibrate.lens_covariance = *dataset.lens_covariance;
  calibrate.threads = options.common.threads;
  const calib::ImageCalibration solved = calib::calibrate_images(
      setup, dataset, target, detections, calib::read_depth(dataset, detections), calibrate);
  const calib::Plan plan = calib::plan_poses(solved.calibration, calib::target_points(target), settings);
  for (const std::string& warning : solved.calibration.warnings) warn_calib(warning);
  const std::string text = data::format_json(plan_json(plan, options));
  if (!options.out.empty()) data::write_atomically(options.out, text);
  if (options.common.json)
    std::cout << text;
  else
    print(plan);
  if (!solved.calibration.usable) say_unusable(solved.calibration.refusals.front());
  return solved.calibration.usable ? exit_done : exit_unusable;
}

}  // namespace

void add_plan_verb(CLI::App& app, Action& action) {
  const auto options = std::make_shared<PlanOptions>();
  CLI::App* verb = app.add_subcommand("plan", "The next robot poses that would help the calibration most");
  add_dataset_options(*verb, options->dataset);
  verb->get_option("dataset")->description("Folder of pictures and poses");
  add_link_option(*verb, options->dataset);
  add_setup_option(*verb, options->setup);
  verb->add_option("--count", options->count, "Number of poses to propose")
      ->check(whole_number(1, 100))
      ->capture_default_str();
  add_plan_bounds(*verb, options->bounds);
  verb->add_option("--criterion", options->criterion,
                   "trace: sum of variances; determinant: volume of the region")
      ->check(CLI::IsMember({"trace", "determinant"}))
      ->capture_default_str();
  verb->add_option("--seed", options->seed, "Random seed of the candidate poses")
      ->check(whole_number(0, 1'000'000'000))
      ->capture_default_str();
  verb->add_flag("--no-depth", options->dataset.no_depth, "Leave depth pictures out");
  verb->add_option("-o,--out", options->out, "File for the plan, JSON");
  add_calib_common_options(*verb, options->common);
  verb->footer(
      "Example:\n"
      "  flash-calib plan wrist --target chessboard:9x6:0.025 --lower 0.2,-0.4,0.1 --upper 0.7,0.4,0.6 -o "
      "next.json");
  verb->callback([options, &action] { action = [options] { return run_plan(*options); }; });
}

}  // namespace flash
