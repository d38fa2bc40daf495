#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>

#include "apps/calib/options.h"
#include "apps/calib/verbs.h"
#include "apps/command_line/command_line.h"
#include "apps/command_line/doubts_option.h"
#include "apps/command_line/option_checks.h"
#include "apps/command_line/result_files.h"
#include "calib/calibrate/calibrate_images.h"
#include "calib/calibrate/cell.h"
#include "calib/calibrate/cell_misfits.h"
#include "calib/calibrate/cell_motion.h"
#include "calib/detect/lens_doubt.h"
#include "calib/detect/read_depth.h"
#include "calib/report/cell_json.h"
#include "data/camera/posed_lens.h"
#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/json_reader.h"
#include "data/files/text.h"
#include "data/files/writable.h"

namespace flash {
namespace {

namespace fs = std::filesystem;

struct RegisterOptions {
  CalibCommonOptions common;
  bool despite_doubts = false;
  std::vector<std::string> calibrations;
  std::vector<std::string> cameras;
  std::string target, setup, cache;
  std::vector<double> workspace;
  DatasetChoice robot;  ///< of the datasets of --cameras: its URDF alone
  double depth_scale = 0.001;
  bool without_images = false, no_depth = false;
  LensOption lens;
  calib::Use use = calib::Use::workspace;
  std::optional<double> target_size_sd = {};
  bool size_as_stated = false;
  std::string out;
};

/// What the provenance says of the target: words, or a file.
std::string target_text(const std::string& target, const std::string& calibration) {
  const fs::path beside = fs::absolute(calibration).parent_path() / target;
  return fs::is_regular_file(beside) ? beside.string() : target;
}

/// What the calibrations of the members say against themselves.
struct Doubts {
  std::vector<std::string> warnings = {};  ///< each with the file or dataset it is of, once
  std::vector<std::string> refusals = {};  ///< why one that the cell stands on cannot be used

  void add(const std::string& source, const std::vector<std::string>& more) {
    for (const std::string& warning : more)
      if (std::find(warnings.begin(), warnings.end(), source + ": " + warning) == warnings.end())
        warnings.push_back(source + ": " + warning);
  }
};

/// A recording of the cell, and which of its arms and cameras it is of.
struct Recording {
  std::string source;  ///< the file or dataset that the command line names
  std::string arm, camera;
  DatasetChoice choice;
  std::string setup = {};
  bool time_offset = false;
  calib::Dataset dataset = {};
};

calib::CellRecording solved_recording(const Recording& recording, const RegisterOptions& options) {
  const calib::Dataset& dataset = recording.dataset;
  const DatasetChoice& choice = recording.choice;
  const calib::Target target = target_of(choice, dataset);
  if (recording.setup.empty() && !dataset.setup)
    throw data::InputError(choice.path +
                           ": says nothing of the setup; add --setup eye-in-hand or eye-to-hand");
  const calib::Setup setup = recording.setup.empty()
                                 ? *dataset.setup
                                 : calib::parse_setup(recording.setup, "command line", "--setup");
  const std::vector<calib::Detection> detections = detect_all(dataset, target, choice, options.common);
  calib::CalibrateSettings settings;
  settings.target_size_sd = options.target_size_sd;
  settings.size_as_stated = options.size_as_stated;
  settings.use = options.use;
  settings.lens = options.lens.knowledge;
  if (dataset.lens_covariance) settings.lens_covariance = *dataset.lens_covariance;
  settings.threads = options.common.threads;
  settings.clock_offset = recording.time_offset ? calib::ClockOffset::solved : calib::ClockOffset::none;
  calib::CellRecording solved;
  for (const calib::Frame& frame : dataset.frames) {
    solved.T_base_gripper.push_back(frame.T_base_gripper);
    solved.stamps.push_back(frame.stamp);
  }
  const auto depth = calib::read_depth(dataset, detections);
  solved.solve = [=](const std::vector<Eigen::Isometry3d>& poses) {
    calib::Dataset moved = dataset;
    for (std::size_t i = 0; i < poses.size(); ++i) moved.frames[i].T_base_gripper = poses[i];
    return calib::calibrate_images(setup, moved, target, detections, depth, settings).calibration;
  };
  try {
    solved.calibration = solved.solve(solved.T_base_gripper);
  } catch (const data::InputError&) {
    const std::string doubt = calib::lens_doubt(dataset, target, detections);
    if (!doubt.empty()) throw data::InputError(doubt);
    throw;
  }
  solved.member = calib::cell_member(recording.arm, recording.camera, dataset, target, solved.calibration);
  return solved;
}

/// One recording is one witness.
void expect_different(const std::vector<std::string>& paths) {
  for (std::size_t i = 0; i < paths.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      std::error_code error;
      if (fs::equivalent(paths[i], paths[j], error)) throw data::InputError(paths[i] + ": given twice");
    }
}

std::string name_of(const std::string& path) {
  const fs::path normal = fs::path(path).lexically_normal();
  return normal.has_filename() ? normal.stem().string() : normal.parent_path().filename().string();
}

/// Names of files or folders; those that are alike are told apart by the folders that they lie in, or
/// numbered.
std::vector<std::string> names_of(const std::vector<std::string>& paths) {
  const auto alike = [](const std::vector<std::string>& names) {
    return std::set<std::string>(names.begin(), names.end()).size() < names.size();
  };
  std::vector<std::string> names;
  for (const std::string& path : paths) names.push_back(name_of(path));
  if (!alike(names)) return names;
  for (std::size_t i = 0; i < paths.size(); ++i) {
    const std::string folder = fs::absolute(paths[i]).lexically_normal().parent_path().filename().string();
    if (!folder.empty()) names[i] = folder + '/' + names[i];
  }
  for (std::size_t i = 0; alike(names) && i < paths.size(); ++i) names[i] += '_' + std::to_string(i + 1);
  return names;
}

/// Of a calibration that says so itself.
std::string first_of(const std::vector<std::string>& warnings) {
  return warnings.empty() ? "it ended with exit code 3" : warnings.front();
}

std::vector<calib::Extrinsics> load_calibrations(const RegisterOptions& options, Doubts& doubts) {
  std::vector<calib::Extrinsics> calibrations;
  for (const std::string& path : options.calibrations) {
    calibrations.push_back(calib::load_extrinsics(path, options.despite_doubts));
    doubts.add(path, calibrations.back().warnings);
  }
  return calibrations;
}

/// What the calibrations were made from.
std::vector<Recording> recordings_of_arms(const std::vector<std::string>& arms,
                                          const std::vector<calib::Extrinsics>& calibrations,
                                          const RegisterOptions& options) {
  std::vector<Recording> recordings;
  for (std::size_t i = 0; i < arms.size(); ++i) {
    const calib::ExtrinsicsInputs& inputs = calibrations[i].inputs;
    DatasetChoice choice;
    const std::string& file = options.calibrations[i];
    if (!calibrations[i].pixels)
      throw data::InputError(file +
                             ": found pairs of poses, expected pictures; --without-images composes the "
                             "transforms alone");
    try {
      choice.path = calib::resolved(inputs.dataset, file);
      choice.poses = calib::resolved(inputs.poses, file);
      choice.camera = options.lens.own.empty() ? calib::resolved(inputs.camera, file) : options.lens.own;
    } catch (const data::InputError& error) {
      throw data::InputError(std::string(error.what()) + "; --without-images composes the transforms alone");
    }
    if (!inputs.robot.empty()) choice.robot = calib::resolved(inputs.robot, file);
    choice.base_link = inputs.base_link;
    choice.tip_link = inputs.tip_link;
    choice.link_length_sd = inputs.link_length_sd;
    choice.target = target_text(inputs.target, file);
    choice.cache = options.cache;
    choice.no_depth = options.no_depth || !inputs.depth;
    if (inputs.depth) choice.depth_scale = inputs.depth->scale;
    recordings.push_back({file, arms[i], "camera", choice, calib::to_string(calibrations[i].setup),
                          inputs.time_offset.has_value()});
  }
  return recordings;
}

std::vector<Recording> recordings_of_cameras(const RegisterOptions& options) {
  std::vector<Recording> recordings;
  expect_each_once("--cameras", options.cameras);
  const std::vector<std::string> names = names_of(options.cameras);
  for (std::size_t i = 0; i < names.size(); ++i) {
    DatasetChoice choice;
    choice.path = options.cameras[i];
    choice.robot = options.robot.robot;
    choice.base_link = options.robot.base_link;
    choice.tip_link = options.robot.tip_link;
    choice.link_length_sd = options.robot.link_length_sd;
    choice.target = options.target;
    choice.cache = options.cache;
    choice.depth_scale = options.depth_scale;
    choice.no_depth = options.no_depth;
    recordings.push_back({choice.path, "base", names[i], choice, options.setup});
  }
  return recordings;
}

/// A camera has one lens, whatever arm it sees.
void expect_one_lens(const std::vector<Recording>& recordings) {
  for (std::size_t i = 0; i < recordings.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      const calib::Dataset &one = recordings[j].dataset, &other = recordings[i].dataset;
      if (recordings[i].camera != recordings[j].camera || data::same_lens(*one.camera, *other.camera))
        continue;
      throw data::InputError(other.camera_path + ": found " + data::describe_lens(*other.camera) + ", but " +
                             one.camera_path + ": " + data::describe_lens(*one.camera) +
                             ": expected one lens of the one camera; --lens FILE takes that one for all");
    }
}

bool same_bytes(const std::string& one, const std::string& other) {
  std::error_code error;
  return fs::file_size(one, error) == fs::file_size(other, error) && !error &&
         data::read_file(one) == data::read_file(other);
}

/// One recording is one witness, under whatever names its pictures stand.
void expect_different(const Recording& one, const Recording& other) {
  for (const calib::Frame& a : one.dataset.frames)
    for (const calib::Frame& b : other.dataset.frames)
      if (a.T_base_gripper.isApprox(b.T_base_gripper) && same_bytes(a.image, b.image))
        throw data::InputError(other.source + ": its picture " + b.name + " is picture " + a.name + " of " +
                               one.source +
                               ", at the same pose, expected each once: twice would count as two");
}

/// Pictures of several cameras that have one number are of one pose. Those that are not count by themselves.
void warn_of_numbers(const Recording& one, const Recording& other, Doubts& doubts) {
  std::size_t common = 0, apart = 0;
  double farthest = 0;  // [m]
  for (const calib::Frame& a : one.dataset.frames)
    for (const calib::Frame& b : other.dataset.frames) {
      if (a.stamp != b.stamp) continue;
      ++common;
      if (calib::same_pose(a.T_base_gripper, b.T_base_gripper)) continue;
      ++apart;
      farthest = std::max(farthest, (a.T_base_gripper.translation() - b.T_base_gripper.translation()).norm());
    }
  if (apart == 0) return;
  doubts.add(
      other.source,
      {std::to_string(apart) + " of " + std::to_string(common) + " pictures have the numbers of those of " +
       one.source + ", and other poses of the robot, up to " + data::format_short(1e3 * farthest) +
       " mm from them, expected picture 7 of every camera at pose 7: each counts by itself"});
}

void check_recordings(const std::vector<Recording>& recordings, bool of_cameras, Doubts& doubts) {
  for (std::size_t i = 0; i < recordings.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      expect_different(recordings[j], recordings[i]);
      if (of_cameras) warn_of_numbers(recordings[j], recordings[i], doubts);
    }
}

/// All recordings are read before the first is solved: the result must not take the place of one.
calib::Cell solved_cell(std::vector<Recording> recordings, const RegisterOptions& options, Doubts& doubts) {
  std::vector<std::string> read = options.calibrations;
  for (Recording& recording : recordings) {
    recording.dataset = load_dataset(recording.choice);
    const std::vector<std::string> files = files_read(recording.choice, recording.dataset, options.common);
    read.insert(read.end(), files.begin(), files.end());
  }
  expect_own_files({options.out}, read);
  expect_one_lens(recordings);
  check_recordings(recordings, !options.cameras.empty(), doubts);
  std::vector<calib::CellRecording> solved;
  for (const Recording& recording : recordings) solved.push_back(solved_recording(recording, options));
  const std::vector<std::string> settled = calib::settle_motions(solved);
  std::vector<calib::CellMember> members;
  for (std::size_t i = 0; i < solved.size(); ++i) {
    doubts.add(recordings[i].source, solved[i].calibration.warnings);
    for (const std::string& reason : solved[i].calibration.refusals)
      doubts.refusals.push_back(recordings[i].source + ": " + reason);
    members.push_back(solved[i].member);
  }
  calib::Cell cell = calib::solve_cell(
      members,
      {.refine = {},
       .target_size_sd = options.target_size_sd,
       .size_as_stated = options.size_as_stated,
       .lens = options.use == calib::Use::two_arms ? calib::LensKnowledge::stated : options.lens.knowledge});
  cell.notices.insert(cell.notices.begin(), settled.begin(), settled.end());
  return cell;
}

/// Where transforms are composed, each holds with a lens of its own.
void warn_of_lenses(const std::vector<std::string>& files, const std::vector<calib::Extrinsics>& calibrations,
                    Doubts& doubts) {
  for (std::size_t i = 1; i < files.size(); ++i) {
    const auto &first = calibrations.front().lens, &other = calibrations[i].lens;
    if (!first || !other || data::same_lens(*first, *other)) continue;
    doubts.add(files[i],
               {"holds with " + data::describe_lens(*other) + ", but " + files.front() + " with " +
                data::describe_lens(*first) +
                ": the camera's place differs between them by as much; without --without-images one "
                "lens is taken for both"});
  }
  constexpr double kApart = 0.01;  // twice what focal lengths that are stated are off by
  for (std::size_t i = 1; i < files.size(); ++i) {
    const double first = calibrations.front().focal_length, other = calibrations[i].focal_length;
    if (std::abs(other / first - 1) < kApart) continue;
    doubts.add(files[i], {"is for a focal length of " + data::format_short(other) +
                          " times that with which the target's poses were made, but " + files.front() +
                          " for " + data::format_short(first) +
                          ": one camera has one; calibrate its lens and make the poses of both with it"});
  }
}

calib::Cell cell_of_arms(RegisterOptions options, Doubts& doubts) {
  expect_each_once("calibrations", options.calibrations);
  const std::vector<std::string> arms = names_of(options.calibrations);
  const std::vector<calib::Extrinsics> calibrations = load_calibrations(options, doubts);
  const calib::Cell composed = calib::compose_cell(arms, calibrations);
  if (options.without_images) {
    warn_of_lenses(options.calibrations, calibrations, doubts);
    for (std::size_t i = 0; i < calibrations.size(); ++i)
      if (!calibrations[i].usable)
        doubts.refusals.push_back(options.calibrations[i] + ": " + first_of(calibrations[i].warnings));
    return composed;
  }
  // What one was calibrated with counts for all: a size that is not known.
  if (!options.target_size_sd && !options.size_as_stated &&
      std::any_of(calibrations.begin(), calibrations.end(),
                  [](const calib::Extrinsics& c) { return c.size_unknown; }))
    options.target_size_sd = std::numeric_limits<double>::infinity();
  const bool for_arms = std::any_of(calibrations.begin(), calibrations.end(),
                                    [](const calib::Extrinsics& c) { return c.use == calib::Use::two_arms; });
  if (for_arms && options.lens.knowledge == calib::LensKnowledge::near) options.use = calib::Use::two_arms;
  return solved_cell(recordings_of_arms(arms, calibrations, options), options, doubts);
}

void print(const calib::Cell& cell, const RegisterOptions& options) {
  const auto line = [&](const calib::CellFrame& frame) {
    // Along and about the axes of the parent, in which the translation is written.
    const calib::Vector6d sd = calib::parent_deviations(frame.transform.T, frame.covariance);
    const Eigen::Vector3d t = frame.transform.T.translation();
    std::printf("%s <- %s: (%.5f, %.5f, %.5f) m, +- (%.2f, %.2f, %.2f) mm, (%.3f, %.3f, %.3f) deg\n",
                frame.transform.parent.c_str(), frame.transform.child.c_str(), t.x(), t.y(), t.z(),
                1e3 * sd[0], 1e3 * sd[1], 1e3 * sd[2], sd[3] * 180 / M_PI, sd[4] * 180 / M_PI,
                sd[5] * 180 / M_PI);
  };
  std::printf("one standard deviation along and about the axes of the frame on the left:\n");
  for (const calib::CellFrame& base : cell.bases) {
    line(base);
    if (options.workspace.empty()) continue;
    const Eigen::Vector3d p(options.workspace[0], options.workspace[1], options.workspace[2]);
    const Eigen::Vector3d sd =
        calib::point_covariance(base, base.transform.T.inverse() * p).diagonal().cwiseSqrt();
    std::printf("  at (%.3f, %.3f, %.3f) m: +- (%.2f, %.2f, %.2f) mm\n", p.x(), p.y(), p.z(), 1e3 * sd.x(),
                1e3 * sd.y(), 1e3 * sd.z());
  }
  for (const calib::CellFrame& camera : cell.cameras) line(camera);
  if (cell.joint)
    std::printf("jointly: corners %.3f px, through the robots' chain %.3f px rms\n", cell.corner_rms,
                cell.chain_rms);
}

int run_register(const RegisterOptions& options) {
  if (options.calibrations.empty() == options.cameras.empty())
    throw data::InputError(
        "register: expected either two or more extrinsics files or --cameras with datasets");
  expect_different(options.calibrations);
  expect_different(options.cameras);
  if (!options.lens.own.empty() && (options.without_images || !options.cameras.empty()))
    throw data::InputError("--lens: found " + options.lens.own + ", expected stated or solved" +
                           (options.cameras.empty() ? "" : ": each of --cameras has a lens of its own"));
  if (options.calibrations.size() + options.cameras.size() < 2)
    throw data::InputError("register: found one calibration, expected two or more");
  if (!options.out.empty()) data::check_file_free(options.out, options.common.force);
  std::vector<std::string> named = options.calibrations;
  named.push_back(options_file(options.common));
  expect_own_files({options.out}, named);
  constexpr double kFarthest = 100;  // [m]
  for (const double place : options.workspace)
    if (std::abs(place) > kFarthest)
      throw data::InputError("--workspace: found " + data::format_short(place) +
                             ", expected metres from the first base, at most 100");
  Doubts doubts;
  calib::Cell cell = options.cameras.empty() ? cell_of_arms(options, doubts)
                                             : solved_cell(recordings_of_cameras(options), options, doubts);
  cell.notices.insert(cell.notices.begin(), doubts.warnings.begin(), doubts.warnings.end());
  std::vector<std::string> refusals = doubts.refusals;
  refusals.insert(refusals.end(), cell.refusals.begin(), cell.refusals.end());
  const int exit_code = refusals.empty() ? exit_done : exit_unusable;
  std::optional<Eigen::Vector3d> workspace;
  if (!options.workspace.empty())
    workspace = Eigen::Vector3d(options.workspace[0], options.workspace[1], options.workspace[2]);
  nlohmann::ordered_json json = calib::to_json(cell, workspace);
  json["exit_code"] = exit_code;
  const std::string text = data::format_json(json);
  if (!options.out.empty()) data::write_atomically(options.out, text);
  for (const std::string& notice : cell.notices) warn_calib(notice);
  if (options.common.json)
    std::cout << text;
  else
    print(cell, options);
  if (exit_code == exit_unusable) say_unusable(refusals.front());
  return exit_code;
}

}  // namespace

void add_register_verb(CLI::App& app, Action& action) {
  const auto options = std::make_shared<RegisterOptions>();
  CLI::App* verb =
      app.add_subcommand("register", "Several arms on one camera, or several cameras, in one world");
  verb->add_option("calibrations", options->calibrations,
                   "Extrinsics of two or more arms, eye-to-hand on one camera that stands still");
  verb->add_option("--cameras", options->cameras, "Datasets of one arm seen by several cameras");
  verb->add_option("--target", options->target, "Target, in place of what the datasets of --cameras say");
  verb->add_option("--setup", options->setup,
                   "eye-in-hand or eye-to-hand, where the datasets of --cameras do not say")
      ->check(CLI::IsMember({"eye-in-hand", "eye-to-hand"}));
  add_robot_options(*verb, options->robot);
  add_link_option(*verb, options->robot);
  add_vector_option(*verb, "--workspace", options->workspace,
                    "Point in the first base where the uncertainty is stated [m]");
  verb->add_flag("--without-images", options->without_images, "Compose the transforms; do not solve jointly");
  add_lens_option(*verb, options->lens);
  add_target_size_options(*verb, options->target_size_sd, options->size_as_stated);
  verb->add_option("--depth-scale", options->depth_scale,
                   "Metres per count of the depth pictures of --cameras")
      ->check(positive_number())
      ->capture_default_str();
  verb->add_flag("--no-depth", options->no_depth, "Leave depth pictures out");
  verb->add_option("--cache", options->cache, "Folder that keeps corners found, for the next run");
  verb->add_option("-o,--out", options->out, "File for the cell, JSON");
  add_calib_common_options(*verb, options->common);
  add_doubts_option(*verb, options->despite_doubts, "Use a calibration that handeye ended with exit code 3");
  verb->footer(
      "Examples:\n"
      "  flash-calib register left.json right.json --workspace 0.4,0,0.1 -o cell.json\n"
      "  flash-calib register --cameras camera1 camera2 camera3 -o cell.json");
  verb->callback([options, &action] { action = [options] { return run_register(*options); }; });
}

}  // namespace flash
