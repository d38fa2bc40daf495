#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/calib/options.h"
#include "apps/calib/verbs.h"
#include "apps/command_line/command_line.h"
#include "apps/command_line/doubts_option.h"
#include "apps/command_line/result_files.h"
#include "calib/calibrate/extrinsics.h"
#include "calib/report/extrinsics_export.h"
#include "calib/report/robot_file.h"
#include "calib/report/urdf_origins.h"
#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/folder_lock.h"
#include "data/files/json_reader.h"
#include "data/files/writable.h"

namespace flash {
namespace {

namespace fs = std::filesystem;

struct ExportOptions {
  CalibCommonOptions common;
  bool despite_doubts = false;
  std::string extrinsics;
  std::string to;
  std::string into;            ///< a robot's file, to be changed; empty: none
  bool joint_origins = false;  ///< as the calibration corrects them, into that file too
  std::string parent, child;
  std::string out;
};

std::string exported(const ExportOptions& options, const calib::Extrinsics& extrinsics) {
  const data::NamedTransform& transform = extrinsics.transform;
  const calib::Lens& lens = extrinsics.lens;
  if (options.to == "tf") return calib::ros_static_transform(transform, lens);
  if (options.to == "easy_handeye2")
    return calib::easy_handeye2(transform, extrinsics.setup, lens, extrinsics.target_pose.parent);
  if (options.to == "mjcf") return calib::mjcf_camera(transform, lens);
  if (options.to == "usd") return calib::usd_stage(transform, lens);
  if (options.to == "opencv") return calib::opencv_yaml(transform, lens);
  return "<?xml version=\"1.0\"?>\n<robot name=\"" + transform.child + "\">\n<link name=\"" +
         transform.child + "\"/>\n" + calib::urdf_joint(transform, lens) + "</robot>\n";
}

// What the format has no words for.
std::vector<std::string> not_expressed(const ExportOptions& options, const calib::Extrinsics& extrinsics) {
  std::vector<std::string> lines;
  const bool renders = options.to == "mjcf" || options.to == "usd";
  if (!extrinsics.lens)
    lines.emplace_back("a lens: the calibration is of pairs of poses, which have none");
  else if (options.to != "opencv" && !renders)
    lines.emplace_back("the lens, but in a comment");
  else if (renders && extrinsics.lens->model != data::DistortionModel::none)
    lines.emplace_back("the distortion of the lens: undistort the pictures of the camera");
  if (!extrinsics.joint_origins.empty() && !options.joint_origins)
    lines.emplace_back("by how much joints and links are off, which the transform holds with" +
                       std::string(options.to == "urdf" ? ": --into with --joint-origins does" : ""));
  lines.emplace_back("the covariance of the transform, which is in " + options.extrinsics);
  return lines;
}

// What a link leads to, which is changed in its place.
std::string file_to_change(const std::string& path) {
  std::error_code missing;
  const fs::path file = fs::canonical(path, missing);
  if (missing) throw data::InputError(path + ": cannot be read: " + missing.message());
  const bool writable = (fs::status(file).permissions() & fs::perms::owner_write) != fs::perms::none;
  if (!fs::is_regular_file(file) || !writable)
    throw data::InputError(path + ": cannot be changed, expected a file that may be written to");
  return file.string();
}

// Beside the file, under the first name that is free: an earlier backup stays.
std::string backup_path(const std::string& path) {
  std::string backup = path + ".bak";
  for (int k = 2; fs::exists(fs::symlink_status(backup)); ++k) backup = path + ".bak" + std::to_string(k);
  return backup;
}

/// The robot's file with what the calibration has for it.
std::string changed(const std::string& robot, const ExportOptions& options,
                    const calib::Extrinsics& extrinsics) {
  const auto with_camera = options.to == "mjcf" ? calib::camera_in_mjcf : calib::camera_in_urdf;
  const std::string is = with_camera(robot, options.into, extrinsics.transform, extrinsics.lens);
  return options.joint_origins ? calib::with_joint_origins(is, options.into, extrinsics.joint_origins) : is;
}

int run_export(const ExportOptions& options) {
  const bool changes = !options.into.empty();
  if (changes == !options.out.empty())
    throw data::InputError("--into, --out: found " + std::string(changes ? "both" : "neither") +
                           ", expected the robot's file to change, or a file to write");
  if (changes && options.to != "urdf" && options.to != "xacro" && options.to != "mjcf")
    throw data::InputError("--into: found --to " + options.to + ", expected urdf, xacro or mjcf");
  if (options.joint_origins && !(changes && options.to == "urdf"))
    throw data::InputError("--joint-origins: found " +
                           (changes ? "--to " + options.to : std::string("no --into")) +
                           ", expected --to urdf --into the robot's file");
  if (!changes) data::check_file_free(options.out, options.common.force);
  expect_own_files({options.out}, {options.extrinsics, options.into});
  calib::Extrinsics extrinsics = calib::load_extrinsics(options.extrinsics, options.despite_doubts);
  if (options.joint_origins && extrinsics.joint_origins.empty())
    throw data::input_error(options.extrinsics, "joint_origins",
                            "found none, expected a calibration of joints (handeye --robot)");
  if (!options.parent.empty()) extrinsics.transform.parent = options.parent;
  if (!options.child.empty()) extrinsics.transform.child = options.child;
  expect_frame_names(extrinsics.transform.parent, extrinsics.transform.child);
  if (options.to == "easy_handeye2" && extrinsics.target_pose.parent == extrinsics.transform.parent)
    throw data::InputError("--parent-frame: found " + options.parent +
                           ", which is the robot's other frame, expected the one that carries the camera");
  for (const std::string& warning : extrinsics.warnings) warn_calib(warning);

  std::string backup;
  if (changes) {
    const std::string file = file_to_change(options.into);
    const data::FolderLock lock(file);  // of two at once, one waits
    const std::string was = data::read_file(options.into);
    const std::string is = changed(was, options, extrinsics);
    backup = backup_path(file);
    const fs::perms permissions = fs::status(file).permissions();
    data::write_together({{backup, was}, {file, is}});
    for (const std::string& path : {backup, file}) fs::permissions(path, permissions);
  } else {
    data::write_atomically(options.out, exported(options, extrinsics));
  }
  const std::string& written = changes ? options.into : options.out;
  const int exit_code = extrinsics.usable ? exit_done : exit_unusable;
  const std::vector<std::string> lost = not_expressed(options, extrinsics);
  if (options.common.json) {
    nlohmann::ordered_json json;
    json["schema"] = "flash-calib-export/1";
    json["file"] = written;
    json["backup"] = changes ? nlohmann::ordered_json(backup) : nlohmann::ordered_json(nullptr);
    json["parent"] = extrinsics.transform.parent;
    json["child"] = extrinsics.transform.child;
    json["not_expressed"] = lost;
    json["exit_code"] = exit_code;
    std::cout << data::format_json(json);
  } else {
    std::printf("%s\n", written.c_str());
    if (changes) std::printf("as it was: %s\n", backup.c_str());
    for (const std::string& line : lost) std::printf("it does not say: %s\n", line.c_str());
  }
  if (exit_code == exit_unusable && !extrinsics.warnings.empty()) say_unusable(extrinsics.warnings.front());
  return exit_code;
}

}  // namespace

void add_export_verb(CLI::App& app, Action& action) {
  const auto options = std::make_shared<ExportOptions>();
  CLI::App* verb = app.add_subcommand(
      "export",
      "Write a calibration as other programs read it, or put the camera into a robot's description");
  verb->add_option("extrinsics", options->extrinsics, "What handeye wrote, as extrinsics.json")->required();
  verb->add_option("--to", options->to, "Format: urdf, xacro, tf, mjcf, usd, easy_handeye2 or opencv")
      ->required()
      ->check(CLI::IsMember({"urdf", "xacro", "tf", "mjcf", "usd", "easy_handeye2", "opencv"}));
  verb->add_option("--into", options->into,
                   "The robot's file, which gets the camera; it is kept beside as FILE.bak");
  verb->add_flag("--joint-origins", options->joint_origins,
                 "Of a calibration with --robot: put the zeros of the joints, and the lengths of links where "
                 "they were solved for, into the origins of the URDF too");
  verb->add_option("--parent-frame", options->parent,
                   "The link or body that carries the camera; without it, as the calibration names it");
  verb->add_option("--child-frame", options->child, "The camera; without it, as the calibration names it");
  verb->add_option("-o,--out", options->out, "File to write, as camera.xml");
  add_doubts_option(*verb, options->despite_doubts, "Use a calibration that handeye ended with exit code 3");
  add_calib_common_options(*verb, options->common);
  verb->footer(
      "Exit code 3: of a calibration that handeye ended so.\n"
      "Example:\n  flash-calib export extrinsics.json --to urdf --into robot.urdf --parent-frame tool0");
  verb->callback([options, &action] { action = [options] { return run_export(*options); }; });
}

}  // namespace flash
