#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/command_line/command_line.h"
#include "apps/command_line/doubts_option.h"
#include "apps/command_line/option_checks.h"
#include "apps/sysid/frame_times.h"
#include "apps/sysid/import_options.h"
#include "apps/sysid/options.h"
#include "apps/sysid/verbs.h"
#include "data/files/error.h"
#include "data/files/json_reader.h"
#include "data/files/text.h"
#include "data/files/writable.h"
#include "data/recording/frame_files.h"
#include "sysid/capture/segment/segment_folder.h"

namespace flash {
namespace {

namespace fs = std::filesystem;

constexpr double kSmallestVoxel = 1e-4;  // finer than any depth camera sees [m]

struct SegmentOptions {
  CommonOptions common;
  std::vector<std::string> views;
  std::vector<std::string> masks, intrinsics, extrinsics;  ///< none, or one a view; lenses also one for all
  std::vector<std::string> lens;                           ///< words or files, likewise
  std::vector<double> depth_scales;
  std::string trajectory, times;
  double table_height = 0;
  std::array<std::string, 3> crop;
  bool no_table = false, despite_doubts = false;
  sysid::SegmentFolderSettings settings;
  std::string out;
};

/// The view's own value; where one stands for all, that.
template <class Value>
Value of_view(const std::vector<Value>& values, std::size_t view, std::size_t views, bool one_for_all,
              const char* option, const Value& absent) {
  if (values.empty()) return absent;
  if (values.size() == views) return values[view];
  if (one_for_all && values.size() == 1) return values[0];
  throw data::InputError(std::string(option) + ": found " + std::to_string(values.size()) + ", expected " +
                         (one_for_all ? "one or " : "") + std::to_string(views) +
                         (views == 1 ? " for the one view" : ", one a view"));
}

/// Of one view, "stated", "solved", a file or nothing.
void take_lens(const std::string& word, sysid::RawViewFiles& files) {
  std::string own;
  files.lens = data::parse_lens_choice(word, own);
  if (own.empty()) return;
  if (!files.intrinsics.empty())
    throw data::InputError("--lens: found " + own + ", expected stated or solved beside --intrinsics " +
                           files.intrinsics);
  files.intrinsics = own;
}

std::vector<sysid::RawView> open_views(const SegmentOptions& options) {
  std::vector<sysid::RawView> views;
  const std::size_t count = options.views.size();
  for (std::size_t view = 0; view < count; ++view) {
    sysid::RawViewFiles files;
    const std::string none;
    files.masks = of_view(options.masks, view, count, false, "--masks", none);
    files.intrinsics = of_view(options.intrinsics, view, count, true, "--intrinsics", none);
    take_lens(of_view(options.lens, view, count, true, "--lens", none), files);
    files.extrinsics = of_view(options.extrinsics, view, count, false, "--extrinsics", none);
    const double scale = of_view(options.depth_scales, view, count, true, "--depth-scale", 0.0);
    if (scale > 0) files.depth_scale = scale;
    files.accept_unusable = options.despite_doubts;
    views.push_back(sysid::open_raw_view(options.views[view], files));
  }
  const bool clouds = std::none_of(views.begin(), views.end(), [](const auto& view) { return view.camera; });
  if (clouds && !options.depth_scales.empty())
    throw data::InputError("--depth-scale: the views hold clouds, expected depth images");
  if (clouds && !options.lens.empty())
    throw data::InputError("--lens: the views hold clouds, expected depth images");
  return views;
}

/// One a frame; empty where they are not given. Without a gripper they do not count.
std::vector<double> times_of(const SegmentOptions& options, const std::vector<sysid::RawView>& views) {
  if (options.times.empty() && !options.trajectory.empty())
    throw data::InputError(
        "--trajectory: the frames need times by its clock, expected --times FILE.csv or rate:HZ:START, or "
        "rate:HZ where the first frame is at 0 s");
  std::vector<double> times;
  for (const sysid::RawView& view : views)
    if (!options.times.empty()) times = frame_times(options.times, view.files);
  return times;
}

void check_lengths(const SegmentOptions& options) {
  const sysid::SegmentSettings& segment = options.settings.segment;
  if (segment.voxel > 0 && segment.voxel < kSmallestVoxel)
    throw data::InputError("--voxel: found " + data::format_short(segment.voxel) +
                           ", expected 0 or at least " + data::format_short(kSmallestVoxel) + " m");
}

/// Files are never written over those that they are made from.
void check_places(const std::vector<sysid::RawView>& views, const std::string& out) {
  for (const sysid::RawView& view : views) {
    const fs::path folder = fs::weakly_canonical(fs::path(view.files.front()).parent_path());
    if (folder == fs::weakly_canonical(fs::path(out) / "frames"))
      throw data::InputError("-o: " + folder.string() + " holds the raw frames; choose another folder");
  }
}

int run_segment(const CLI::App& verb, SegmentOptions options) {
  sysid::SegmentFolderSettings& settings = options.settings;
  settings.segment.crop = parse_crop(options.crop);
  check_lengths(options);
  expect_each_once("views", options.views);
  expect_each_once("--masks", options.masks);
  expect_each_once("--extrinsics", options.extrinsics);  // two cameras do not stand in one place
  const std::vector<sysid::RawView> views = open_views(options);
  settings.find_table = !options.no_table;
  if (verb.count("--table-z") > 0) settings.table_height = options.table_height;
  if (!options.trajectory.empty()) {
    settings.gripper = data::load_trajectory(options.trajectory);
    settings.gripper_path = options.trajectory;
    for (const std::string& jumps : data::find_jumps(*settings.gripper, options.trajectory)) warn(jumps);
  }
  data::check_folder_free(options.out, options.common.force);
  check_places(views, options.out);
  settings.accept_fault = options.despite_doubts;
  settings.stop = &stop_on_signals();
  settings.told = [&](const std::string& text) { say(options.common, text); };
  const sysid::SegmentedFolder segmented =
      sysid::segment_folder(views, times_of(options, views), settings, options.out);
  for (const std::string& warning : segmented.warnings) warn(warning);  // those of the cameras too
  if (options.trajectory.empty())
    say(options.common,
        "no --trajectory: where a gripper or an arm is in view, it is not told from cloth and is kept");

  std::size_t points = 0;
  for (const sysid::Segmentation& frame : segmented.frames)
    points += static_cast<std::size_t>(frame.cloth.rows());
  const std::string picture = (fs::path(options.out) / segmented.picture).string();
  if (options.common.json) {
    nlohmann::ordered_json json = {{"schema", "flash-sysid-segment/1"},
                                   {"clouds", segmented.clouds},
                                   {"picture", picture},
                                   {"points", points},
                                   {"table", nullptr},
                                   {"warnings", segmented.warnings}};
    if (segmented.table) {
      const Eigen::Vector3d &p = segmented.table->plane.point, &n = segmented.table->plane.normal;
      json["table"] = {{"point", {p.x(), p.y(), p.z()}},
                       {"normal", {n.x(), n.y(), n.z()}},
                       {"tilt_deg", segmented.table->tilt * 180 / M_PI},
                       {"frames", segmented.table->frames},
                       {"agreeing", segmented.table->agreeing}};
    }
    std::cout << data::format_json(json);
  } else {
    if (segmented.table && segmented.table->frames > 0) {
      const Eigen::Vector3d &p = segmented.table->plane.point, &n = segmented.table->plane.normal;
      std::printf(
          "table through %.4f %.4f %.4f m, normal %.4f %.4f %.4f, %.1f deg from z, in %d of %d frames\n",
          p.x(), p.y(), p.z(), n.x(), n.y(), n.z(), segmented.table->tilt * 180 / M_PI,
          segmented.table->agreeing, segmented.table->frames);
    }
    std::printf("%zu frames, %s points of cloth\n%s\n", segmented.clouds.size(),
                data::format_count(points).c_str(), picture.c_str());
  }
  return exit_done;
}

}  // namespace

void add_segment_verb(CLI::App& app, Action& action) {
  const auto options = std::make_shared<SegmentOptions>();
  CLI::App* verb = app.add_subcommand(
      "segment", "Cut the cloth out of raw depth images or clouds, and show what was kept");
  sysid::SegmentSettings& segment = options->settings.segment;
  verb->add_option(
          "views", options->views,
          "Folders of raw frames, one a camera: clouds, or depth/ with camera_info.yaml and extrinsics.json")
      ->required();
  verb->add_option("--trajectory", options->trajectory,
                   "T_base_gripper over time, TUM, CSV or JSON: the arm above the gripper is cut away");
  verb->add_option("--times", options->times,
                   "Times of the frames: rate:HZ, rate:HZ:START, or a CSV with one time a frame");
  verb->add_option("--masks", options->masks, "Folder of masks of the depth images' names, one a view");
  verb->add_option("--intrinsics", options->intrinsics,
                   "camera_info, OpenCV, camchain, JSON or npz, one a view or one for all; without it "
                   "camera_info.yaml there");
  verb->add_option(
          "--lens", options->lens,
          "Where the extrinsics hold with another lens than the view's: solved takes theirs, stated the "
          "view's, a file that one; one a view or one for all. Without it such views are refused")
      ->type_name("stated|solved|FILE");
  verb->add_option("--extrinsics", options->extrinsics,
                   "T_base_camera, one a view: the extrinsics of flash-calib, or a file of poses; without it "
                   "extrinsics.json or .tum there");
  verb->add_option("--depth-scale", options->depth_scales,
                   "Metres per count of the depth images, one a view or one for all; without it 0.001")
      ->check(number_between(1e-7, 1));
  verb->add_option("--crop-x", options->crop[0], "Keep points in LOW:HIGH [m], either may be empty");
  verb->add_option("--crop-y", options->crop[1], "Keep points in LOW:HIGH [m], either may be empty");
  verb->add_option("--crop-z", options->crop[2], "Keep points in LOW:HIGH [m], either may be empty");
  verb->add_option("--arm-radius", options->settings.arm_radius,
                   "Points this close to the line above the gripper are the arm [m]")
      ->check(number_between(0, 1))
      ->capture_default_str();
  verb->add_option("--clearance", segment.table_clearance,
                   "Cloth is kept from this height above the table [m]")
      ->check(number_between(0, 0.5))
      ->capture_default_str();
  verb->add_option("--cluster-gap", segment.cluster_gap, "Points closer than this belong together [m]")
      ->check(number_between(1e-4, 0.1))
      ->capture_default_str();
  verb->add_option("--voxel", segment.voxel, "One point a cell of this edge [m]; 0: every point")
      ->check(number_between(0, 0.1))
      ->capture_default_str();
  CLI::Option* height =
      verb->add_option(
              "--table-z", options->table_height,
              "Height of a level table in the base frame [m]; without it one is sought, beyond the crop too")
          ->check(number_between(-20, 20));
  verb->add_flag("--no-table", options->no_table, "There is no table in view")->excludes(height);
  verb->add_option("-o,--out", options->out, "Folder for frames/ and segment.svg")->required();
  add_common_options(*verb, options->common);
  add_doubts_option(*verb, options->despite_doubts,
                    "Go on, and warn, where cameras, table and gripper are not of one cell, or with a "
                    "calibration that flash-calib ended with exit code 3");
  verb->footer(
      "Example:\n  flash-sysid segment raw/camera --trajectory gripper.tum --times rate:10 -o segmented");
  verb->callback(
      [verb, options, &action] { action = [verb, options] { return run_segment(*verb, *options); }; });
}

}  // namespace flash
