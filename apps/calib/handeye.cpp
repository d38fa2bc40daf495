#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/calib/options.h"
#include "apps/calib/verbs.h"
#include "apps/command_line/command_line.h"
#include "apps/command_line/result_files.h"
#include "calib/calibrate/calibrate_images.h"
#include "calib/calibrate/calibrate_pairs.h"
#include "calib/calibrate/extrinsics.h"
#include "calib/check/opencv_closed_forms.h"
#include "calib/dataset/told_shape.h"
#include "calib/detect/lens_doubt.h"
#include "calib/detect/read_depth.h"
#include "calib/report/extrinsics_export.h"
#include "calib/report/extrinsics_json.h"
#include "calib/report/report.h"
#include "calib/uncertainty/joint_errors.h"
#include "data/camera/camera_info.h"
#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/folder_lock.h"
#include "data/files/json_reader.h"
#include "data/files/text.h"
#include "data/files/writable.h"

namespace flash {
namespace {

struct HandEyeOptions {
  CalibCommonOptions common;
  DatasetChoice dataset;
  std::string setup;
  calib::Use use = calib::Use::workspace;
  calib::ClockOffset clock_offset = calib::ClockOffset::where_it_matters;
  LensOption lens;
  std::optional<double> target_size_sd = {};
  bool size_as_stated = false;
  unsigned held_out_seed = 0;
  std::string camera_height, target_height;  ///< "0.35" or "0.35:0.002" [m]
  std::string parent, child = "camera";
  std::string ros, urdf, easy_handeye2, camera_info;
  std::string out, report;
};

calib::Setup setup_of(const HandEyeOptions& options, const calib::Dataset& dataset) {
  if (!options.setup.empty()) return calib::parse_setup(options.setup, "command line", "--setup");
  if (dataset.setup) return *dataset.setup;
  throw data::InputError(dataset.source +
                         ": says nothing of the setup; add --setup eye-in-hand or eye-to-hand");
}

/// METRES or METRES:DEVIATION, of camera or target; none where neither is given.
std::optional<calib::MeasuredHeight> measured_height(const HandEyeOptions& options) {
  if (options.camera_height.empty() && options.target_height.empty()) return std::nullopt;
  if (!options.camera_height.empty() && !options.target_height.empty())
    throw data::InputError("--camera-height, --target-height: found both, expected one");
  calib::MeasuredHeight measured{.target = options.camera_height.empty()};
  const std::string& text = measured.target ? options.target_height : options.camera_height;
  const std::size_t colon = text.find(':');
  constexpr double kFarthest = 10;  // no arm reaches that far [m]
  const auto number = [](const std::string& part, double& value) {
    const std::optional<double> parsed = data::parse_number(part);
    value = parsed.value_or(value);
    return parsed && std::abs(*parsed) < kFarthest;
  };
  if (!number(text.substr(0, colon), measured.height) ||
      (colon != std::string::npos && !(number(text.substr(colon + 1), measured.sd) && measured.sd > 0)))
    throw data::InputError(std::string(measured.target ? "--target-height" : "--camera-height") + ": found " +
                           text + ", expected metres, below 10, and their standard deviation, as 0.35:0.002");
  return measured;
}

/// What other programs read has no words for a number that is not told.
void expect_whole(const HandEyeOptions& options, const calib::Calibration& calibration) {
  if (!calibration.along || calibration.along->told) return;
  for (const auto& [name, path] : {std::pair{"--ros", &options.ros},
                                   {"--urdf", &options.urdf},
                                   {"--easy-handeye2", &options.easy_handeye2}})
    if (!path->empty())
      throw data::InputError(std::string(name) + ": " +
                             calib::untold_sentence(*calibration.along, calibration.setup));
}

/// Beside the extrinsics, unless it has a name of its own; empty: none.
std::string report_path(const HandEyeOptions& options) {
  if (!options.report.empty() || options.out.empty()) return options.report;
  return std::filesystem::path(options.out).replace_extension(".html").string();
}

std::string report_text(const calib::Calibration& calibration, const calib::Extrinsics& extrinsics,
                        const nlohmann::ordered_json& json, const calib::Dataset& dataset,
                        const DatasetChoice& choice) {
  calib::ReportInputs inputs;
  if (!extrinsics.inputs.refiner.empty()) inputs.points = calib::target_points(target_of(choice, dataset));
  for (const calib::Frame& frame : dataset.frames) inputs.images.push_back(frame.image);
  return calib::render_report(calibration, extrinsics, json, inputs);
}

/// Rounded; what rounds to zero has no sign.
std::string fixed(double value, int digits) {
  char text[40];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  const bool zero = std::string(text).find_first_not_of("-0.") == std::string::npos;
  return zero && text[0] == '-' ? text + 1 : text;
}

/// With as many digits as show the deviation.
std::string with_deviation(double value, double sd) {
  if (!(sd > 0)) return fixed(value, 1) + " (as stated)";
  const int digits = std::clamp(1 - static_cast<int>(std::floor(std::log10(sd))), 1, 6);
  return fixed(value, digits) + " +- " + fixed(sd, digits);
}

/// The lens that the answer holds with and, where it matters, how far off it would be with the stated one.
void print_lens(const calib::Calibration& c) {
  const calib::LensEstimate& lens = c.lens;
  std::printf("lens:");
  for (int i = 0; i < 4; ++i)
    std::printf(" %s %s%s", calib::lens_unknown(i), with_deviation(lens.estimate[i], lens.sd[i]).c_str(),
                i < 3 ? "," : " px");
  std::printf(" (stated %.1f, %.1f, %.1f, %.1f)\n", lens.stated[0], lens.stated[1], lens.stated[2],
              lens.stated[3]);
  const calib::Vector6d& shift = lens.camera_shift;
  if (calib::exceeds_deviations(c.poses.X, shift, c.covariance))
    std::printf(
        "  this answer holds with this lens alone: with the stated one the camera would be %.1f mm and %.2f "
        "deg from here (--camera-info writes this lens, --lens stated keeps the other)\n",
        1e3 * shift.head<3>().norm(), shift.tail<3>().norm() * 180 / M_PI);
}

/// Each error of the arm's joints, with its interval.
void print_joints(const calib::Calibration& c, const calib::Extrinsics& extrinsics) {
  const auto errors = calib::joint_errors(c.refined.bundle, c.unknowns, c.shared_covariance);
  if (!errors || !extrinsics.inputs.arm) return;
  const calib::ArmModel& arm = *extrinsics.inputs.arm;
  const auto line = [&](const std::string& what, Eigen::Index i, double scale, const char* unit) {
    const Eigen::Vector2d interval = scale * errors->interval(i);
    std::printf("  %-32s %8s %s (%s to %s)%s\n", what.c_str(), fixed(scale * errors->estimate[i], 3).c_str(),
                unit, fixed(interval[0], 3).c_str(), fixed(interval[1], 3).c_str(),
                errors->told(i) ? "" : " not told");
  };
  std::printf("the gripper is what joint %s of the URDF carries%s\n", arm.chain.joints.back().name.c_str(),
              extrinsics.inputs.tip_link.empty() ? " (--tip-link names another link)" : "");
  std::printf("joints are farther than they say by, with intervals of 95 %%:\n");
  Eigen::Index next = 0;
  for (const calib::Joint& joint : arm.chain.joints) {
    if (joint.kind == calib::Joint::Kind::fixed) continue;
    const bool turns = joint.kind == calib::Joint::Kind::revolute;
    line(joint.name, next++, turns ? 180 / M_PI : 1e3, turns ? "deg" : "mm");
  }
  if (arm.lengths.empty()) {
    std::printf(
        "  the links were taken as the URDF has them: where they may be off by 0.3 mm, the deviations do not "
        "hold (--link-lengths solves for them)\n");
    return;
  }
  std::printf("origins of joints are farther than the URDF says by, likewise:\n");
  for (const calib::LinkLength& length : arm.lengths)
    line(arm.chain.joints[length.joint].name + " along " + calib::direction_name(length.direction), next++,
         1e3, "mm");
}

void print(const calib::Calibration& c, const calib::Extrinsics& extrinsics, const HandEyeOptions& options) {
  const Eigen::Vector3d t = extrinsics.transform.T.translation();
  constexpr double kDegrees = 180 / M_PI;
  const char* const parent = extrinsics.transform.parent.c_str();
  std::printf("%s <- %s: (%.5f, %.5f, %.5f) m; deviations along and about the axes of %s:\n", parent,
              extrinsics.transform.child.c_str(), t.x(), t.y(), t.z(), parent);
  const auto deviations = [&](const char* what, const calib::Matrix6d& covariance) {
    const calib::ToldDeviations sd = calib::told_deviations(c, covariance, calib::Axes::parent);
    const auto text = [&](std::size_t i) {
      return !sd[i] ? "not told" : i < 3 ? fixed(1e3 * *sd[i], 2) : fixed(kDegrees * *sd[i], 3);
    };
    std::printf("  %-28s +- (%s, %s, %s) mm, (%s, %s, %s) deg\n", what, text(0).c_str(), text(1).c_str(),
                text(2).c_str(), text(3).c_str(), text(4).c_str(), text(5).c_str());
  };
  deviations("in the true frames", c.covariance);
  deviations("repeatable in such poses", c.repeatable);
  if (c.use.value)
    std::printf("for %s: %s %.3g %s\n", calib::to_string(c.use.use), c.use.measure, *c.use.value, c.use.unit);
  const std::string corners =
      extrinsics.pixels ? "corners " + fixed(extrinsics.corner_px, 3) + " px, robot" : "robot and camera";
  std::printf("%zu of %zu views; %s %.3f deg %.2f mm an axis\n", c.used.size(), c.views.size(),
              corners.c_str(), kDegrees * extrinsics.robot_rotation_rad,
              1e3 * extrinsics.robot_translation_m);
  if (c.sight_noise)
    std::printf("places %.2f mm across the line of sight, %.2f mm along it\n", 1e3 * c.sight_noise->across,
                1e3 * c.sight_noise->along);
  if (extrinsics.pixels) {
    print_lens(c);
    const std::string warp = calib::describe(c.warp);
    std::printf("target: %.4f +- %.4f times as large as stated%s\n", c.size->estimate, c.size->sd,
                warp.empty() ? "" : (", " + warp).c_str());
    if (c.edges && calib::told(*c.edges)) std::printf("%s\n", calib::describe(*c.edges).c_str());
  } else if (c.size && c.size->sd > 0) {
    std::printf("target: %.4f +- %.4f times as large as stated\n", c.size->estimate, c.size->sd);
  }
  if (c.focal_length && c.focal_length->sd > 0)
    std::printf("focal length: %.4f +- %.4f times that with which the target's poses were made%s\n",
                c.focal_length->estimate, c.focal_length->sd,
                options.lens.knowledge == calib::LensKnowledge::near ? " (--lens stated takes that)" : "");
  print_joints(c, extrinsics);
  const std::optional<calib::DepthUse>& depth = extrinsics.inputs.depth;
  if (depth && depth->used)
    std::printf("depth of %d views: plane of the target known to %.2f mm, a pixel to %.2f mm\n", depth->views,
                1e3 * depth->sigma, 1e3 * depth->pixel_noise);
  if (extrinsics.inputs.time_offset)
    std::printf("pictures were taken %.2f +- %.2f ms later than their stamps say by the clock of the poses\n",
                1e3 * extrinsics.inputs.time_offset->estimate, 1e3 * extrinsics.inputs.time_offset->sd);
  std::printf("weakest: %s, %.2f mm, %.3f deg\n\n", c.weakest.name.c_str(), 1e3 * c.weakest.translation,
              kDegrees * c.weakest.rotation);
  std::printf("%-20s %10s %10s %8s   held out: %8s %8s %8s\n", "method", "AX=XB deg", "mm", "px", "px", "mm",
              "deg");
  for (const calib::ComparedMethod& method : c.comparison) {
    const auto px = [&](double value) { return extrinsics.pixels ? fixed(value, 3) : std::string("-"); };
    std::printf("%-20s %10.3f %10.2f %8s", method.name.c_str(), kDegrees * method.relative.rotation,
                1e3 * method.relative.translation, px(method.px).c_str());
    if (method.held_out)
      std::printf("             %8s %8.2f %8.3f", px(method.held_out->px).c_str(), method.held_out->mm,
                  method.held_out->deg);
    std::printf("%s\n", method.wild ? "  wild" : "");
  }
}

/// Wall time of the parts of a run, for --verbose.
class Phases {
 public:
  void end(const char* name) {
    const auto now = std::chrono::steady_clock::now();
    text_ += (text_.empty() ? "" : ", ") + std::string(name) + " " +
             fixed(std::chrono::duration<double>(now - begin_).count(), 2) + " s";
    begin_ = now;
  }
  const std::string& text() const { return text_; }

 private:
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  std::string text_;
};

/// One line for each reason, with the pictures that it is of.
void warn_of_unused(const calib::Calibration& calibration) {
  std::vector<std::pair<std::string, std::string>> lines;  // reasons, pictures
  for (std::size_t i = 0; i < calibration.views.size(); ++i) {
    if (calibration.views[i].used) continue;
    const std::string &reason = calibration.views[i].reason,
                      &image = calibration.selection.observations[i].image;
    const auto line =
        std::find_if(lines.begin(), lines.end(), [&](const auto& known) { return known.first == reason; });
    if (line == lines.end())
      lines.emplace_back(reason, image);
    else
      line->second += ", " + image;
  }
  for (const auto& [reason, images] : lines) warn_calib(images + ": not used: " + reason);
}

calib::ImageCalibration solve(const HandEyeOptions& options, calib::Setup setup,
                              const calib::Dataset& dataset, const calib::CalibrateSettings& settings,
                              Phases& phases) {
  const bool pairs = std::all_of(dataset.frames.begin(), dataset.frames.end(),
                                 [](const calib::Frame& frame) { return frame.image.empty(); });
  calib::ImageCalibration solved;
  if (pairs) {
    if (options.clock_offset == calib::ClockOffset::solved)
      throw data::InputError(dataset.source + ": pairs of poses have no time; leave --time-offset out");
    const Progress progress("solving", options.common);
    solved.calibration = calib::calibrate_pairs(setup, calib::pair_observations(dataset), settings);
  } else {
    const calib::Target target = target_of(options.dataset, dataset);
    const std::vector<calib::Detection> detections =
        detect_all(dataset, target, options.dataset, options.common, LeftOut::told_later);
    phases.end("corners");
    const Progress progress("solving", options.common);
    try {
      solved = calib::calibrate_images(setup, dataset, target, detections,
                                       calib::read_depth(dataset, detections), settings);
    } catch (const data::InputError&) {
      if (!options.common.quiet) warn_of_left_out(detections);
      const std::string doubt = calib::lens_doubt(dataset, target, detections);
      if (!doubt.empty()) throw data::InputError(doubt);
      throw;
    }
  }
  phases.end("solving");
  return solved;
}

/// Pairs have no pixels, and their lens is that of whoever made them.
void expect_pair_options(const HandEyeOptions& options, const calib::Dataset& dataset) {
  if (!dataset.frames.front().T_camera_target) return;
  if (options.use == calib::Use::image)
    throw data::InputError("--for: found image, expected workspace or two-arms: pairs of poses, " +
                           dataset.source + ", have no pixels");
  if (!options.lens.own.empty())
    throw data::InputError("--lens: found " + options.lens.own + ", expected stated or solved: of pairs of " +
                           "poses, " + dataset.source + ", the lens has been used already");
}

int run_handeye(const CLI::App& verb, HandEyeOptions options) {
  expect_no_camera(options.lens, options.dataset.camera);
  if (!options.lens.own.empty()) options.dataset.camera = options.lens.own;
  const std::string report = report_path(options);
  const std::vector<std::string> outputs = {
      options.out, report, options.ros, options.urdf, options.easy_handeye2, options.camera_info};
  expect_own_files(outputs, {});
  for (const std::string& path : outputs)
    if (!path.empty()) data::check_file_free(path, options.common.force);
  expect_frame_names(options.parent, options.child);
  Phases phases;
  const calib::Dataset dataset = load_dataset(options.dataset);
  expect_no_picture_options(verb, dataset);
  expect_pair_options(options, dataset);
  expect_own_files(outputs, files_read(options.dataset, dataset, options.common));
  phases.end("reading");
  const calib::Setup setup = setup_of(options, dataset);
  expect_frame_names(options.parent.empty() ? calib::camera_parent(setup) : options.parent, options.child);
  calib::CalibrateSettings settings;
  settings.use = options.use;
  settings.lens = options.lens.knowledge;
  if (dataset.lens_covariance) settings.lens_covariance = *dataset.lens_covariance;
  settings.closed_forms = calib::opencv_closed_forms();
  settings.target_size_sd = options.target_size_sd;
  settings.size_as_stated = options.size_as_stated;
  settings.height = measured_height(options);
  settings.threads = options.common.threads;
  settings.held_out_seed = options.held_out_seed;
  settings.clock_offset = options.clock_offset;
  const calib::ImageCalibration solved = solve(options, setup, dataset, settings, phases);

  expect_whole(options, solved.calibration);
  const calib::ExtrinsicsInputs inputs = calib::relative_to(
      {dataset.source, options.dataset.target.empty() ? dataset.target : options.dataset.target,
       dataset.poses_path, dataset.camera_path, solved.refiner, solved.depth, solved.time_offset,
       options.dataset.robot, options.dataset.base_link, options.dataset.tip_link,
       options.dataset.link_length_sd, dataset.arm},
      options.out);
  calib::Extrinsics extrinsics = calib::extrinsics_of(solved.calibration, inputs);
  const int exit_code = solved.calibration.usable ? exit_done : exit_unusable;
  nlohmann::ordered_json json = calib::to_json(solved.calibration, inputs, exit_code);
  if (!options.parent.empty()) extrinsics.transform.parent = options.parent;
  extrinsics.transform.child = options.child;
  json["transform"] = calib::to_json(extrinsics.transform);
  const std::string text = data::format_json(json);
  const std::string html =
      report.empty() ? "" : report_text(solved.calibration, extrinsics, json, dataset, options.dataset);
  {
    // Another run may have written meanwhile, and none writes before all files of this one are there.
    const data::FolderLock lock(options.out.empty() ? report : options.out);
    for (const std::string& path : outputs)
      if (!path.empty()) data::check_file_free(path, options.common.force);
    std::vector<data::FileText> files = {
        {options.out, text},
        {report, html},
        {options.ros, calib::ros_static_transform(extrinsics.transform, extrinsics.lens)},
        {options.urdf, calib::urdf_joint(extrinsics.transform, extrinsics.lens)},
        {options.easy_handeye2,
         calib::easy_handeye2(extrinsics.transform, setup, extrinsics.lens, extrinsics.target_pose.parent)}};
    if (extrinsics.pixels)
      files.push_back({options.camera_info,
                       data::camera_info_text(solved.calibration.refined.bundle.intrinsics.front())});
    data::write_together(files);
  }

  if (!options.common.quiet) warn_of_unused(solved.calibration);
  for (const std::string& warning : solved.calibration.warnings) warn_calib(warning);
  phases.end("writing");
  if (options.common.verbose) say(options.common, phases.text());
  if (options.common.json)
    std::cout << text;
  else
    print(solved.calibration, extrinsics, options);
  if (exit_code == exit_unusable) say_unusable(solved.calibration.refusals.front());
  return exit_code;
}

}  // namespace

void add_handeye_verb(CLI::App& app, Action& action) {
  const auto options = std::make_shared<HandEyeOptions>();
  CLI::App* verb = app.add_subcommand("handeye", "Where the camera sits, in the hand or before the robot");
  add_dataset_options(*verb, options->dataset);
  add_link_option(*verb, options->dataset);
  add_setup_option(*verb, options->setup);
  verb->add_option_function<std::string>(
          "--for", [options](const std::string& name) { options->use = *calib::use_named(name); },
          "What the answer is for. workspace: places seen by the camera, in the robot's frame; "
          "image: pictures predicted through this robot; two-arms: arms that one camera relates, "
          "with the lens as stated for all alike")
      ->check(CLI::IsMember({"workspace", "image", "two-arms"}))
      ->default_str("workspace");
  add_lens_option(*verb, options->lens);
  add_target_size_options(*verb, options->target_size_sd, options->size_as_stated);
  verb->add_option(
      "--camera-height", options->camera_height,
      "Of a robot that turns about one axis alone, as a four-axis arm: where the camera is along that "
      "axis, in the base (eye-to-hand) or the gripper, and a standard deviation of 1 mm or as stated, "
      "as 0.35:0.002 [m]");
  verb->add_option(
      "--target-height", options->target_height,
      "In its place, where the target's origin is along that axis, in the base (eye-in-hand) or the "
      "gripper");
  verb->add_option("--held-out-seed", options->held_out_seed,
                   "Draws by it the ten parts of the views that are left out in turn; 0: interleaved")
      ->check(CLI::Range(0, 1'000'000'000))
      ->capture_default_str();
  verb->add_flag_function(
      "--time-offset,!--no-time-offset",
      [options](std::int64_t asked) {
        options->clock_offset = asked > 0 ? calib::ClockOffset::solved : calib::ClockOffset::none;
      },
      "Solve for a constant time between pictures and poses, where the poses are a stream over time and "
      "pictures are named by their time, or take them to have one clock (default: solved for where the robot "
      "moves at the pictures)");
  verb->add_flag("--no-depth", options->dataset.no_depth, "Leave depth pictures out");
  verb->add_option("--parent-frame", options->parent, "Name of the gripper's or the base's frame");
  verb->add_option("--child-frame", options->child, "Name of the camera's frame")->capture_default_str();
  verb->add_option("--ros", options->ros, "File for a static_transform_publisher line");
  verb->add_option("--urdf", options->urdf, "File for a fixed joint");
  verb->add_option("--easy-handeye2", options->easy_handeye2, "File for easy_handeye2's .calib");
  verb->add_option("--camera-info", options->camera_info, "File for the lens that the answer is for");
  verb->add_option("-o,--out", options->out, "File for the extrinsics, JSON");
  verb->add_option("--report", options->report, "File for the report, HTML (default: OUT with .html)");
  add_calib_common_options(*verb, options->common);
  verb->footer(
      "Examples:\n"
      "  flash-calib handeye wrist --setup eye-in-hand --target chessboard:9x6:0.025 -o camera.json\n"
      "  flash-calib handeye left --setup eye-to-hand --target aruco:DICT_4X4_50:0:0.09 -o left.json");
  verb->callback(
      [verb, options, &action] { action = [verb, options] { return run_handeye(*verb, *options); }; });
}

}  // namespace flash
