#include "apps/calib/options.h"

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <limits>

#include "apps/command_line/option_checks.h"
#include "data/files/error.h"
#include "data/files/message_line.h"
#include "data/files/text.h"

namespace flash {

void add_calib_common_options(CLI::App& verb, CalibCommonOptions& options) {
  CLI::App& group = *verb.add_option_group("Common");
  group.add_flag("--json", options.json, "Print the result as JSON on stdout");
  CLI::Option* quiet = group.add_flag("--quiet", options.quiet, "Print nothing but the result and errors");
  group.add_flag("--verbose", options.verbose, "Print every notice, and the time of each part")
      ->excludes(quiet);
  group.add_flag("--force", options.force, "Overwrite what is there");
  group.add_option("--threads", options.threads, "Number of threads; 0: one per processor")
      ->check(thread_number())
      ->capture_default_str();
  options.config = verb.get_parent()->get_config_ptr();
}

void add_robot_options(CLI::App& group, DatasetChoice& choice) {
  CLI::Option* robot =
      group.add_option("--robot", choice.robot,
                       "URDF of the arm: the poses are then its joints, a CSV with a column of "
                       "each by its name or q1 q2 ... [rad], and their zeros are solved for");
  group.add_option("--base-link", choice.base_link, "Link of the URDF that stands still")->needs(robot);
  group.add_option("--tip-link", choice.tip_link, "Link of the URDF that is the gripper")->needs(robot);
}

void add_link_option(CLI::App& verb, DatasetChoice& choice) {
  verb.add_option_function<std::string>(
          "--link-lengths",
          [&choice](const std::string& text) {
            constexpr double kLeast = 1e-3;  // no link is known better [mm]
            constexpr double kMost = 50;     // none is farther off [mm]
            const std::optional<double> sd =
                text == "usual" ? 1e3 * calib::kUsualLinkLength : data::parse_number(text);
            if (!sd || !(*sd >= kLeast && *sd <= kMost))
              throw CLI::ValidationError(
                  "--link-lengths", "found \"" + text + "\", expected usual, or 0.001 to 50 millimetres");
            choice.link_length_sd = 1e-3 * *sd;
          },
          "Solve for the lengths of the arm's links too, each known to so many millimetres (one standard "
          "deviation); usual: 0.3, as machined parts")
      ->type_name("MM|usual")
      ->needs(verb.get_option("--robot"));
}

void add_dataset_options(CLI::App& verb, DatasetChoice& choice) {
  CLI::App& group = *verb.add_option_group("Dataset");
  group.add_option("dataset", choice.path, "Folder of pictures and poses, or a file of pose pairs")
      ->required();
  group.add_option("--target", choice.target,
                   "chessboard:9x6:0.025 (inner corners), charuco:5x7:0.036:0.018:DICT_6X6_250, "
                   "aruco:DICT_4X4_50:0:0.09, aruco_grid:5x7:0.04:0.01:DICT_4X4_50, apriltag:36h11:0:0.048, "
                   "aprilgrid:6x6:0.088:0.3, circles:10x10:0.0254:origin-dot, or a file; lengths in metres");
  group.add_option("--poses", choice.poses, "File or folder of T_base_gripper in place of the dataset's");
  group.add_option(
      "--angles", choice.angles,
      "What three angles of a pose are: xyz and the like about fixed axes, XYZ about turning ones "
      "(KUKA: ZYX, Staubli: XYZ, Kawasaki: ZYZ), rotvec");
  add_robot_options(group, choice);
  group
      .add_option("--camera", choice.camera,
                  "Intrinsics in place of the dataset's: camera_info, OpenCV, camchain, JSON, npz")
      ->type_name("FILE");
  group.add_option("--depth-scale", choice.depth_scale, "Metres per count of the depth pictures")
      ->check(number_between(1e-9, 10))
      ->capture_default_str();
  group.add_option("--cache", choice.cache, "Folder that keeps corners found, for the next run");
}

void add_target_size_options(CLI::App& verb, std::optional<double>& sd, bool& as_stated) {
  const CLI::Option* known =
      verb.add_option("--target-size-sd", sd,
                      "How well the size of the target is known, one standard deviation as "
                      "a share of it; 0: as stated, to the last digit. Else 0.3 %, and a ruler that is read "
                      "to a millimetre across its longer side")
          ->check(number_between(0, 1));
  verb.add_option_function<std::string>(
          "--target-size",
          [&sd, &as_stated, known](const std::string& name) {
            as_stated = name == "stated";
            if (!as_stated && known->count() > 0)
              throw CLI::ExcludesError("--target-size solved", "--target-size-sd");
            if (!as_stated) sd = std::numeric_limits<double>::infinity();
          },
          "stated: not solved for, and what it may be off is in the stated deviations; solved: not known at "
          "all")
      ->check(CLI::IsMember({"stated", "solved"}));
}

void add_lens_option(CLI::App& verb, LensOption& lens) {
  verb.add_option_function<std::string>(
          "--lens",
          [&lens](const std::string& word) {
            lens.knowledge = word == "solved" ? calib::LensKnowledge::unknown : calib::LensKnowledge::stated;
            if (word != "solved" && word != "stated") lens.own = word;
          },
          "stated: the dataset's, kept to the last digit; solved: nothing is known of it beforehand; a file: "
          "that lens, kept to the last digit. Without it the lens is solved for, near to the dataset's")
      ->type_name("stated|solved|FILE");
}

void expect_no_camera(const LensOption& lens, const std::string& camera) {
  if (!lens.own.empty() && !camera.empty())
    throw data::InputError("--lens: found " + lens.own + ", expected stated or solved beside --camera " +
                           camera);
}

void add_setup_option(CLI::App& verb, std::string& setup) {
  verb.add_option("--setup", setup, "Camera on the gripper, or beside the robot that holds the target")
      ->check(CLI::IsMember({"eye-in-hand", "eye-to-hand"}));
}

void add_plan_bounds(CLI::App& verb, PlanBounds& bounds) {
  add_vector_option(verb, "--lower", bounds.lower, "Least x,y,z of the gripper in the base [m]");
  add_vector_option(verb, "--upper", bounds.upper, "Greatest x,y,z of the gripper in the base [m]");
  verb.add_option("--reach", bounds.reach, "How far beyond the poses used, where the bounds allow [m]")
      ->check(number_between(0, 10))
      ->capture_default_str();
  verb.add_flag("--four-axes", bounds.four_axes,
                "Of an arm that turns about one axis alone: poses that it can take");
}

calib::PlanSettings plan_settings(const PlanBounds& bounds) {
  if (!bounds.lower.empty() && !bounds.upper.empty())
    for (std::size_t k = 0; k < 3; ++k)
      if (bounds.lower[k] > bounds.upper[k])
        throw data::InputError("--lower: found " + data::format_short(bounds.lower[k]) + " along " +
                               "xyz"[k] + ", expected at most --upper, " +
                               data::format_short(bounds.upper[k]));
  calib::PlanSettings settings;
  if (!bounds.lower.empty()) settings.lower = Eigen::Vector3d::Map(bounds.lower.data());
  if (!bounds.upper.empty()) settings.upper = Eigen::Vector3d::Map(bounds.upper.data());
  settings.reach = bounds.reach;
  settings.one_axis = bounds.four_axes;
  return settings;
}

calib::DatasetOptions dataset_options(const DatasetChoice& choice) {
  calib::DatasetOptions options;
  options.poses = choice.poses;
  options.camera = choice.camera;
  options.angles = choice.angles;
  options.robot = choice.robot;
  options.base_link = choice.base_link;
  options.tip_link = choice.tip_link;
  options.link_length_sd = choice.link_length_sd;
  options.depth_scale = choice.depth_scale;
  options.depth = !choice.no_depth;
  return options;
}

calib::Dataset load_dataset(const DatasetChoice& choice, bool needs_poses, bool needs_camera) {
  calib::DatasetOptions options = dataset_options(choice);
  options.needs_poses = needs_poses;
  options.needs_camera = needs_camera;
  calib::Dataset dataset = calib::load_dataset(choice.path, options);
  calib::take_picture_size(dataset);
  for (const std::string& guess : dataset.guesses) warn_calib(guess);
  for (const std::string& notice : dataset.notices) warn_calib(notice);
  return dataset;
}

std::string options_file(const CalibCommonOptions& options) {
  const bool given = options.config != nullptr && options.config->count() > 0;
  return given ? options.config->results().front() : "";
}

namespace {

/// Poses of a dataset, which a verb that needs none does not read: no result takes their place either.
std::vector<std::string> poses_beside(const std::string& folder) {
  std::vector<std::string> files;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    if (!entry.path().filename().string().starts_with("pose")) continue;
    if (entry.is_regular_file(error)) files.push_back(entry.path().string());
    for (const auto& pose : std::filesystem::directory_iterator(entry.path(), error))
      files.push_back(pose.path().string());
  }
  return files;
}

}  // namespace

std::vector<std::string> files_read(const DatasetChoice& choice, const calib::Dataset& dataset,
                                    const CalibCommonOptions& options) {
  std::vector<std::string> files = dataset.files;
  const std::vector<std::string> others = poses_beside(dataset.source);
  files.insert(files.end(), others.begin(), others.end());
  for (const std::string& path : {choice.target, options_file(options)})
    if (!path.empty()) files.push_back(path);
  return files;
}

void expect_no_picture_options(const CLI::App& verb, const calib::Dataset& dataset) {
  if (!dataset.frames.front().T_camera_target) return;
  for (const char* name : {"--target", "--poses", "--angles", "--robot", "--camera", "--camera-info"}) {
    const CLI::Option* option = verb.get_option_no_throw(name);
    if (option != nullptr && option->count() > 0)
      throw data::InputError(std::string(name) + ": found pairs of poses, " + dataset.source +
                             ", expected pictures of the target beside it");
  }
}

void expect_pictures(const calib::Dataset& dataset) {
  if (std::any_of(dataset.frames.begin(), dataset.frames.end(),
                  [](const calib::Frame& frame) { return frame.image.empty(); }))
    throw data::InputError(dataset.source + ": found pairs of poses, expected pictures of the target");
}

calib::Target target_named(const std::string& text) {
  return std::filesystem::exists(text) ? calib::load_target(text) : calib::parse_target(text);
}

calib::Target target_of(const DatasetChoice& choice, const calib::Dataset& dataset) {
  if (!choice.target.empty()) return target_named(choice.target);
  expect_pictures(dataset);
  if (dataset.target.empty())
    throw data::InputError(dataset.source + ": names no target; add one, as --target chessboard:9x6:0.025");
  return calib::parse_target(dataset.target);
}

std::vector<calib::Detection> detect_all(const calib::Dataset& dataset, const calib::Target& target,
                                         const DatasetChoice& choice, const CalibCommonOptions& options,
                                         LeftOut left_out) {
  expect_pictures(dataset);
  calib::DetectSettings settings;
  settings.threads = options.threads;
  settings.cache = choice.cache;
  if (!options.quiet) settings.tell = warn_calib;
  Progress progress("looking for the target", options);
  std::vector<calib::Detection> detections =
      calib::detect(dataset, target, settings, [&](int done, int total) {
        progress.say(std::to_string(done) + " of " + std::to_string(total) + " pictures");
      });
  progress.end();
  if (left_out == LeftOut::told && !options.quiet) warn_of_left_out(detections);
  return detections;
}

Progress::Progress(const std::string& line, const CalibCommonOptions& options)
    : visible_(!options.quiet && isatty(STDERR_FILENO) != 0) {
  say(line);
}

void Progress::say(const std::string& line) const {
  if (visible_) std::cerr << "\r" << line << "\033[K" << std::flush;
}

void Progress::end() {
  if (visible_) std::cerr << "\r\033[K" << std::flush;
  visible_ = false;
}

void warn_of_left_out(const std::vector<calib::Detection>& detections) {
  for (const calib::Detection& detection : detections)
    if (!detection.reason.empty()) warn_calib(detection.image + ": left out: " + detection.reason);
}

void say(const CalibCommonOptions& options, const std::string& line) {
  if (!options.quiet) std::cerr << data::message_line(line) << '\n';
}

void say_unusable(const std::string& reason, const std::string& verdict) {
  std::cerr << "flash-calib: " << verdict << " (exit code 3): " << data::message_line(reason) << '\n';
}

void warn_calib(const std::string& line) {
  std::cerr << "flash-calib: warning: " << data::message_line(line) << '\n';
}

void expect_frame_names(const std::string& parent, const std::string& child) {
  for (const auto& [option, name] :
       {std::pair("--parent-frame", parent), std::pair("--child-frame", child)}) {
    const bool plain = std::all_of(name.begin(), name.end(), [](char c) {
      return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
             c == '/' || c == '-' || c == '.';
    });
    if (!plain)
      throw data::InputError(std::string(option) + ": expected letters, digits, _ / - and ., found \"" +
                             name + '"');
  }
  if (child.empty() || parent == child)
    throw data::InputError("--child-frame: expected a name other than that of the parent, found \"" + child +
                           '"');
}

}  // namespace flash
