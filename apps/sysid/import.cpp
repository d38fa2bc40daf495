#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/command_line/command_line.h"
#include "apps/command_line/doubts_option.h"
#include "apps/command_line/option_checks.h"
#include "apps/sysid/import_options.h"
#include "apps/sysid/options.h"
#include "apps/sysid/verbs.h"
#include "data/files/error.h"
#include "data/files/json_reader.h"
#include "data/files/text.h"
#include "sysid/capture/import.h"
#include "sysid/capture/import_tracks.h"

namespace flash {
namespace {

namespace fs = std::filesystem;

struct ImportVerbOptions {
  CommonOptions common;
  ImportOptions texts;
  sysid::ImportSettings settings;
  std::string offset;
  std::string shape = "clamp", tool_at = "corner";
  double within = 0, table_height = 0, heading_degrees = 0, from = 0, until = 0;
  sysid::TrackImportSettings tracks;
  std::array<std::string, 3> clamp;  // along x, y and z "LOW:HIGH" [m]
  std::string gravity;
};

// One bound for all axes, or x,y,z.
Eigen::Vector3d parse_bounds(const std::string& text) {
  const std::vector<std::string_view> words = data::split(text, ",");
  Eigen::Vector3d bounds;
  for (int k = 0; k < 3; ++k) {
    const std::size_t word = words.size() == 1 ? 0 : static_cast<std::size_t>(k);
    const auto number =
        words.size() == 1 || words.size() == 3 ? data::parse_number(words[word]) : std::nullopt;
    if (!number || !(*number >= 0) || !std::isfinite(*number))
      throw data::InputError("--offset-bound: found \"" + text +
                             "\", expected one bound or three, x,y,z, in metres, as 0.06");
    bounds[k] = *number;
  }
  return bounds;
}

Eigen::Vector3d parse_gravity(const std::string& text) {
  const std::vector<std::string_view> words = data::split(text, ",");
  Eigen::Vector3d gravity;
  for (int k = 0; k < 3; ++k) {
    const auto number =
        words.size() == 3 ? data::parse_number(words[static_cast<std::size_t>(k)]) : std::nullopt;
    if (!number || !std::isfinite(*number))
      throw data::InputError("--gravity: found \"" + text + "\", expected x,y,z in m/s^2, as 0,0,-9.81");
    gravity[k] = *number;
  }
  return gravity;
}

int tell_import(const data::Recording& recording, const std::string& out, const CommonOptions& options) {
  const std::string path = (fs::path(out) / "recording.json").string();
  constexpr std::string_view kDoubt = "import: warning: ";
  for (const std::string& notice : recording.notices)
    notice.starts_with(kDoubt) ? warn("import: " + notice.substr(kDoubt.size())) : say(options, notice);
  warn_of_doubts(recording);
  if (options.json) {
    std::cout << data::format_json(nlohmann::ordered_json{{"schema", "flash-sysid-import/1"},
                                                          {"recording", path},
                                                          {"keyframes", recording.keyframes.size()},
                                                          {"notices", recording.notices}});
  } else {
    std::printf("%s: %zu keyframes\n", path.c_str(), recording.keyframes.size());
  }
  return exit_done;
}

// A part that is clamped, from the tracks of its markers.
int import_markers(const CLI::App& verb, ImportVerbOptions options) {
  for (const char* name :
       {"--times", "--from", "--until", "--grasp", "--grasp-within", "--tool-at", "--grasp-shape", "--crop-x",
        "--crop-y", "--crop-z", "--table-z", "--heading", "--start-yaw-bound", "--table-height-bound",
        "--offset-bound", "--yaw-bound", "--time-offset-bound"})
    if (verb.count(name) > 0)
      throw data::InputError(std::string(name) +
                             ": found --markers, expected clouds or depth images beside it");
  sysid::TrackImportSettings& settings = options.tracks;
  const sysid::ImportSettings& shared = options.settings;
  if (options.clamp == std::array<std::string, 3>{})
    throw data::InputError(
        "import: --markers needs what is clamped, one or more of --clamp-x, --clamp-y and --clamp-z, as "
        "--clamp-x :0");
  settings.clamp = parse_box(options.clamp, "clamp");
  if (!options.gravity.empty()) settings.gravity = parse_gravity(options.gravity);
  if (verb.count("--kind") > 0) settings.kind = shared.kind;
  settings.mesh_spec = options.texts.mesh;
  settings.asset = shared.asset;
  settings.name = shared.name;
  settings.out = shared.out;
  settings.overwrite = options.common.force;
  settings.stop = &stop_on_signals();
  return tell_import(sysid::import_tracks(settings), settings.out, options.common);
}

int run_import(const CLI::App& verb, ImportVerbOptions options) {
  if (!options.tracks.tracks.empty()) return import_markers(verb, std::move(options));
  sysid::ImportSettings& settings = options.settings;
  settings.overwrite = options.common.force;
  if (!options.offset.empty()) settings.nuisance.offset = parse_bounds(options.offset);
  settings.tool_at_patch = options.tool_at == "patch";
  settings.shape = data::parse_grasp_shape(options.shape).value_or(settings.shape);
  if (verb.count("--grasp-within") > 0) options.texts.within = options.within;
  if (verb.count("--from") > 0) options.texts.from = options.from;
  if (verb.count("--until") > 0) options.texts.until = options.until;
  if (verb.count("--table-z") > 0) settings.table_height = options.table_height;
  if (verb.count("--heading") > 0) settings.heading = options.heading_degrees * M_PI / 180;
  read_options(options.texts, settings);
  settings.stop = &stop_on_signals();
  return tell_import(sysid::import_recording(settings), settings.out, options.common);
}

}  // namespace

void add_import_verb(CLI::App& app, Action& action) {
  const auto options = std::make_shared<ImportVerbOptions>();
  CLI::App* verb = app.add_subcommand(
      "import", "Make a recording from clouds or depth images and a trajectory, or from tracks of markers");
  ImportOptions& texts = options->texts;
  sysid::ImportSettings& settings = options->settings;
  CLI::Option* clouds =
      verb->add_option("clouds", texts.clouds, "Folder of .ply or .pcd, base frame [m], in order of name");
  CLI::Option* depth =
      verb->add_option("--depth", texts.depth,
                       "Folder of depth images, 16-bit .png or .npy or .tiff in metres, in place of clouds")
          ->excludes(clouds);
  verb->add_option("--masks", settings.masks, "Folder of masks of the same names")->needs(depth);
  verb->add_option("--intrinsics", settings.intrinsics,
                   "Lens of the camera: camera_info, OpenCV, camchain, JSON, npz")
      ->needs(depth);
  verb->add_option("--extrinsics", settings.extrinsics,
                   "T_base_camera: the extrinsics of flash-calib, or a file of poses whose first counts")
      ->needs(depth);
  verb->add_option(
          "--lens", texts.lens,
          "Where --extrinsics hold with another lens than --intrinsics: solved takes theirs, stated that "
          "of --intrinsics, a file that one. Without it such files are refused")
      ->needs(depth)
      ->type_name("stated|solved|FILE");
  verb->add_option("--depth-scale", settings.depth_scale, "Metres per count of the depth images")
      ->check(positive_number())
      ->capture_default_str();
  CLI::Option* trajectory = verb->add_option("--trajectory", texts.trajectory,
                                             "Poses of the gripper over time, T_base_gripper: TUM, CSV or "
                                             "JSON; without it as the clouds were segmented");
  sysid::TrackImportSettings& tracks = options->tracks;
  CLI::Option* markers = verb->add_option("--markers", tracks.tracks,
                                          "Tracks of markers on a part that is clamped, in place of clouds: "
                                          "CSV t,marker,x,y,z [s, m]");
  for (CLI::Option* other : {clouds, depth, trajectory}) markers->excludes(other);
  verb->add_option("--placed", tracks.placed,
                   "Where markers are on the part at rest, CSV marker,x,y,z [m]; three or more tell its pose")
      ->needs(markers);
  add_list_option(*verb, "--on-support", tracks.on_support, "Markers that stay where they are, A,B,...")
      ->needs(markers);
  for (const int axis : {0, 1, 2})
    verb->add_option(std::string("--clamp-") + "xyz"[axis], options -> clamp[static_cast<std::size_t>(axis)],
                     "The part is clamped in LOW:HIGH of its rest shape [m], either may be empty")
        ->needs(markers);
  verb->add_option("--gravity", options->gravity,
                   "Gravity in the frame of the markers, x,y,z [m/s^2]; without it 0,0,-9.81")
      ->needs(markers);
  verb->add_option("--every", tracks.every, "Keep one of so many times of the tracks")
      ->check(whole_number(1, 1'000'000))
      ->needs(markers);
  verb->add_option(
      "--times", texts.times,
      "Times of the frames: rate:HZ, rate:HZ:START, or a CSV with one time a frame; without it as the clouds "
      "were segmented, else rate:10");
  verb->add_option("--from", options->from,
                   "Leave out what was recorded before, as the approach; by the clock of the recording [s]")
      ->check(any_number());
  verb->add_option("--until", options->until,
                   "Leave out what was recorded after, as the retreat; by the clock of the recording [s]")
      ->check(any_number());
  verb->add_option("--mesh", texts.mesh,
                   "Mesh of the sheet, sheet:WIDTHxHEIGHT:CELL [m], of the part with --markers, as "
                   "box:LENGTHxWIDTHxHEIGHT:CELL, or a file; from corner 0,0 or 1,1, seen from "
                   "above, the width is on the right hand")
      ->required();
  verb->add_option("--grasp", texts.grasp,
                   "What is grasped: corner, corner:I,J, vertices:A,B,... or position")
      ->capture_default_str();
  verb->add_option("--grasp-within", options->within, "Size of the grasped patch [m]; without it 0.02")
      ->check(positive_number());
  verb->add_option("--tool-at", options->tool_at, "What is under the tool centre point at the start")
      ->check(CLI::IsMember({"corner", "patch"}))
      ->capture_default_str();
  verb->add_option("--grasp-shape", options->shape, "How the patch sits in the fingers")
      ->check(CLI::IsMember({"clamp", "point", "pinch"}))
      ->capture_default_str();
  verb->add_option("--crop-x", texts.crop[0], "Keep points in LOW:HIGH [m], either may be empty");
  verb->add_option("--crop-y", texts.crop[1], "Keep points in LOW:HIGH [m], either may be empty");
  verb->add_option("--crop-z", texts.crop[2], "Keep points in LOW:HIGH [m], either may be empty, as 0.075:");
  verb->add_option("--table-z", options->table_height,
                   "Height of the table in the base frame [m]; without it as segment found it, else from the "
                   "gripper's "
                   "start and the crop")
      ->check(any_number());
  verb->add_option("--heading", options->heading_degrees,
                   "Direction of the sheet's diagonal from the grasped corner, turned from x [deg]; without "
                   "it towards the clouds")
      ->check(number_between(-360, 360));
  verb->add_option("--offset-bound", options->offset, "Bound on the camera's offset, one or x,y,z [m]");
  verb->add_option("--yaw-bound", settings.nuisance.yaw, "Bound on the camera's yaw [rad]")
      ->check(number_from(0));
  verb->add_option("--time-offset-bound", settings.nuisance.time,
                   "Bound on the camera's clock against the robot's [s]")
      ->check(number_from(0));
  verb->add_option("--start-yaw-bound", settings.nuisance.start_yaw,
                   "Bound on the sheet's turn on the table [rad]")
      ->check(number_from(0));
  verb->add_option("--table-height-bound", settings.nuisance.table_height, "Bound on the table's height [m]")
      ->check(number_from(0));
  verb->add_option("--asset", settings.asset, "File of the object");
  verb->add_option("--kind", settings.kind,
                   "What was done: corner_lift, hang, bar_pull, bias_pull, drag, cantilever, free")
      ->capture_default_str();
  verb->add_option("--name", settings.name, "Name of the recording; without it that of the folder");
  verb->add_option("-o,--out", settings.out, "Folder of the recording")->required();
  add_common_options(*verb, options->common);
  add_doubts_option(
      *verb, settings.accept_unusable,
      "Go on, and warn, where what is given contradicts itself, is unusual, or is a calibration "
      "that flash-calib ended with exit code 3");
  verb->footer(
      "Example:\n"
      "  flash-sysid import clouds --trajectory tcp.tum --times rate:10 --mesh sheet:0.278x0.278:0.01 "
      "--grasp corner "
      "\\\n"
      "    --crop-z 0.075: --offset-bound 0.06 -o recording\n"
      "  flash-sysid import --markers tracks.csv --placed placed.csv --on-support base1,base2,base3 \\\n"
      "    --mesh box:0.1x0.03x0.03:0.015 --clamp-x :0 -o recording");
  verb->callback(
      [verb, options, &action] { action = [verb, options] { return run_import(*verb, *options); }; });
}

}  // namespace flash
