#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>

#include "apps/calib/options.h"
#include "apps/calib/verbs.h"
#include "apps/command_line/command_line.h"
#include "apps/command_line/doubts_option.h"
#include "apps/command_line/result_files.h"
#include "calib/calibrate/extrinsics.h"
#include "calib/check/cloud_check.h"
#include "calib/check/contradiction.h"
#include "calib/check/projection_check.h"
#include "calib/check/same_place.h"
#include "calib/check/touch_check.h"
#include "calib/report/overlay.h"
#include "data/camera/posed_lens.h"
#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/folder_lock.h"
#include "data/files/json_reader.h"
#include "data/files/text.h"
#include "data/files/writable.h"

namespace flash {
namespace {

namespace fs = std::filesystem;

struct ValidateOptions {
  CalibCommonOptions common;
  bool despite_doubts = false;
  DatasetChoice dataset;
  std::string extrinsics;
  std::string lens;  ///< "stated", "solved", a file; empty: they have to agree
  bool refit_target = false;
  std::string touched;
  calib::TouchSettings touch;
  std::string out;
};

/// A picture, what was seen in it and where the chain puts it.
struct ValidatedView {
  const calib::Frame* frame;
  calib::Observation observation;
};

/// The dataset with the robot where it was when the pictures were taken, as late as the calibration found.
calib::Dataset at_its_time(calib::Dataset dataset, const calib::Extrinsics& extrinsics,
                           const CalibCommonOptions& options) {
  const std::optional<calib::TimeOffset>& offset = extrinsics.inputs.time_offset;
  if (!offset || !dataset.stream) return dataset;
  std::vector<calib::Frame> frames;
  for (calib::Frame& frame : dataset.frames) {
    const std::optional<calib::Motion> motion =
        calib::motion_at(*dataset.stream, frame.stamp + offset->estimate);
    if (!motion) continue;
    frame.T_base_gripper = motion->pose;
    frames.push_back(std::move(frame));
  }
  if (frames.empty())
    throw data::InputError(dataset.source + ": no picture has poses about its time, " +
                           data::format_short(1e3 * offset->estimate) + " ms after its stamp");
  say(options, "pictures are taken to be " + data::format_short(1e3 * offset->estimate) +
                   " ms later than their stamps say, as the calibration found");
  dataset.frames = std::move(frames);
  return dataset;
}

std::vector<ValidatedView> views_of(const calib::Dataset& dataset, const calib::Target& target,
                                    const ValidateOptions& options) {
  std::vector<ValidatedView> views;
  if (dataset.frames.front().T_camera_target) {
    const std::vector<calib::Observation> pairs = calib::pair_observations(dataset);
    for (std::size_t i = 0; i < pairs.size(); ++i) views.push_back({&dataset.frames[i], pairs[i]});
    return views;
  }
  const std::vector<calib::Detection> detections =
      detect_all(dataset, target, options.dataset, options.common);
  const std::vector<calib::Observation> observations =
      calib::observations_of(detections, calib::rank_refiners(detections).front().refiner);
  auto next = observations.begin();
  for (std::size_t i = 0; i < detections.size(); ++i)
    if (!detections[i].readings.empty()) views.push_back({&dataset.frames[i], *next++});
  return views;
}

constexpr const char *kResult = "validation.json", *kPattern = "pattern.png", *kProfile = "profile.png",
                     *kPlacement = "placement.json", *kTouched = "touched.json";

std::string corner_path(const std::string& folder, const calib::Frame& frame) {
  return (fs::path(folder) / "corners" / (fs::path(frame.name).stem().string() + ".png")).string();
}

void draw_views(const std::vector<ValidatedView>& views, const calib::ProjectionCheck& check,
                const std::string& folder) {
  for (std::size_t i = 0; i < views.size(); ++i)
    if (!views[i].frame->image.empty())
      data::save_png(calib::corner_picture(calib::load_grey_image(views[i].frame->image),
                                           views[i].observation.pixels, check.views[i].projected),
                     corner_path(folder, *views[i].frame));
}

std::optional<calib::CloudCheck> check_clouds(const calib::Dataset& dataset,
                                              const calib::Extrinsics& extrinsics,
                                              const data::CameraIntrinsics& lens,
                                              const std::vector<ValidatedView>& views,
                                              const calib::ProjectionCheck& check) {
  std::vector<calib::TargetCloud> clouds;
  std::vector<Eigen::Isometry3d> poses;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (views[i].frame->depth.empty()) continue;
    calib::Observation observation = views[i].observation;
    observation.points = check.views[i].points;
    clouds.push_back(calib::target_cloud(data::load_depth(views[i].frame->depth, dataset.depth_scale),
                                         calib::load_grey_image(views[i].frame->image), lens, observation));
    poses.push_back(observation.T_base_gripper);
  }
  if (clouds.empty()) return std::nullopt;
  return calib::check_clouds(extrinsics.setup, extrinsics.transform.T, clouds, poses);
}

nlohmann::ordered_json cloud_json(const calib::CloudCheck& clouds) {
  nlohmann::ordered_json json = {{"thickness_mm", clouds.thickness_mm}, {"noise_mm", clouds.noise_mm},
                                 {"offset_mm", clouds.offset_mm},       {"pattern_shift_mm", clouds.shift_mm},
                                 {"trimmed", clouds.trimmed},           {"views", nlohmann::json::array()}};
  for (const calib::CloudView& view : clouds.views)
    json["views"].push_back({{"image", view.image},
                             {"offset_mm", view.offset_mm},
                             {"tilt_deg", view.tilt_deg},
                             {"noise_mm", view.noise_mm},
                             {"pattern_shift_mm", view.shift_mm},
                             {"points", view.points}});
  return json;
}

nlohmann::ordered_json result_json(const ValidateOptions& options, const std::vector<std::string>& warnings,
                                   const calib::ProjectionCheck& check, bool pixels,
                                   const std::optional<calib::CloudCheck>& clouds, int exit_code) {
  nlohmann::ordered_json json;
  json["schema"] = "flash-validation/1";
  json["extrinsics"] = options.extrinsics;
  json["dataset"] = options.dataset.path;
  json["target_pose"] = options.refit_target ? "from these views" : "of the calibration";
  const auto px = [&](double value) { return pixels ? nlohmann::json(value) : nlohmann::json(nullptr); };
  json["corner_rms_px"] = px(check.corner_rms);
  json["centre_rms_px"] = px(check.centre_rms);
  json["rms_mm"] = check.mm_rms;
  json["rms_deg"] = check.deg_rms;
  json["views"] = nlohmann::json::array();
  for (const calib::ViewProjection& view : check.views)
    json["views"].push_back({{"image", view.image},
                             {"corner_px", px(view.corner_rms)},
                             {"centre_px", px(view.centre)},
                             {"mm", view.mm},
                             {"deg", view.deg}});
  if (clouds) json["clouds"] = cloud_json(*clouds);
  json["warnings"] = warnings;
  json["exit_code"] = exit_code;
  return json;
}

/// pixels: pairs of poses have none.
void print_table(const calib::ProjectionCheck& check, bool pixels,
                 const std::optional<calib::CloudCheck>& clouds) {
  std::printf("%-24s %10s %10s %9s %9s\n", "view", "corners px", "centre px", "mm", "deg");
  const auto line = [&](const std::string& name, double corners, double centre, double mm, double deg) {
    if (pixels)
      std::printf("%-24s %10.2f %10.2f %9.2f %9.3f\n", name.c_str(), corners, centre, mm, deg);
    else
      std::printf("%-24s %10s %10s %9.2f %9.3f\n", name.c_str(), "-", "-", mm, deg);
  };
  for (const calib::ViewProjection& view : check.views)
    line(view.image, view.corner_rms, view.centre, view.mm, view.deg);
  line("rms", check.corner_rms, check.centre_rms, check.mm_rms, check.deg_rms);
  if (!clouds) return;
  std::printf(
      "\nclouds of %zu views laid on each other: %.2f mm thick (rms; a single view %.2f), offsets %.2f mm, "
      "pattern sharp to %.2f mm\n",
      clouds->views.size(), clouds->thickness_mm, clouds->noise_mm, clouds->offset_mm, clouds->shift_mm);
}

/// The files that --out makes.
std::vector<std::string> files_written(const calib::Dataset& dataset, const std::string& folder) {
  if (folder.empty()) return {};
  std::set<std::string> files;
  for (const char* name : {kResult, kPattern, kProfile}) files.insert((fs::path(folder) / name).string());
  for (const calib::Frame& frame : dataset.frames)
    if (!frame.image.empty()) files.insert(corner_path(folder, frame));
  return {files.begin(), files.end()};
}

/// That which the calibration holds with, else the dataset's; of pairs none.
data::PosedLens lens_of(const calib::Extrinsics& extrinsics, const calib::Dataset& dataset,
                        const ValidateOptions& options, data::LensChoice choice) {
  if (!dataset.camera) return {};
  const data::CameraPose pose{.transform = extrinsics.transform,
                              .lens = extrinsics.lens,
                              .stated = extrinsics.stated_lens,
                              .warnings = {}};
  return data::posed_lens(pose, options.extrinsics, data::LensOfFile{*dataset.camera, dataset.camera_path},
                          choice);
}

/// Whether a file is what flash-calib handeye has written.
bool is_calibration(const std::string& path) {
  if (!fs::is_regular_file(path) || fs::path(path).extension() != ".json") return false;
  const nlohmann::json file = data::load_json(path);
  const auto schema = file.is_object() ? file.find("schema") : file.end();
  return file.is_object() && schema != file.end() && schema->is_string() &&
         schema->get<std::string>().starts_with("flash-extrinsics/");
}

/// What is written is neither the calibration nor what it is held against.
void expect_own_file(const ValidateOptions& options, const char* name, const std::string& other) {
  if (options.out.empty()) return;
  expect_own_files({(fs::path(options.out) / name).string()}, {options.extrinsics, other});
  expect_folder_apart(options.out, {options.extrinsics, other});
}

/// Whether the camera of a second calibration stands where that of the first does.
int run_placement(const ValidateOptions& options) {
  const calib::Extrinsics first = calib::load_extrinsics(options.extrinsics, options.despite_doubts),
                          second = calib::load_extrinsics(options.dataset.path, options.despite_doubts);
  const calib::Placement found = calib::placement(first, second, options.extrinsics, options.dataset.path);
  const int exit_code = found.moved ? exit_unusable : exit_done;
  const nlohmann::ordered_json json = {{"schema", "flash-placement/1"},
                                       {"extrinsics", options.extrinsics},
                                       {"other", options.dataset.path},
                                       {"apart_mm", 1e3 * found.apart.head<3>().norm()},
                                       {"apart_deg", found.apart.tail<3>().norm() * 180 / M_PI},
                                       {"chi_square", found.chi_square},
                                       {"chance", found.chance},
                                       {"moved", found.moved},
                                       {"exit_code", exit_code}};
  const std::string text = data::format_json(json) + '\n';
  if (!options.out.empty()) data::write_atomically((fs::path(options.out) / kPlacement).string(), text);
  const std::string sentence = calib::describe(found);
  if (options.common.json)
    std::cout << text;
  else
    std::printf("%s\n", sentence.c_str());
  if (found.moved) say_unusable(sentence, "the second recording contradicts the calibration");
  return exit_code;
}

/// Places that the tool touched against where the camera sees them.
int run_touched(const ValidateOptions& options) {
  if (!options.dataset.path.empty())
    throw data::InputError("--touched: found " + options.dataset.path +
                           " beside it, expected one of the two");
  if (!options.out.empty()) data::check_folder_free(options.out, options.common.force);
  expect_own_file(options, kTouched, options.touched);
  const calib::Extrinsics extrinsics = calib::load_extrinsics(options.extrinsics, options.despite_doubts);
  for (const std::string& warning : extrinsics.warnings) warn_calib(options.extrinsics + ": " + warning);
  const calib::TouchCheck found = calib::check_touched(
      extrinsics, calib::load_touched_points(options.touched), options.touch, options.touched);
  const int exit_code = found.contradicts || !found.judges || !extrinsics.usable ? exit_unusable : exit_done;
  nlohmann::ordered_json json = {{"schema", "flash-touched/1"},
                                 {"extrinsics", options.extrinsics},
                                 {"touched", options.touched},
                                 {"rms_px", found.rms_px},
                                 {"rms_across_mm", 1e3 * found.rms_across},
                                 {"expected_across_mm", 1e3 * found.expected_across},
                                 {"chi_square", found.chi_square},
                                 {"chance", found.chance},
                                 {"shift_chance", found.shift_chance},
                                 {"contradicts", found.contradicts},
                                 {"judges", found.judges},
                                 {"points", nlohmann::ordered_json::array()},
                                 {"exit_code", exit_code}};
  for (int axis = 0; axis < 3; ++axis) {
    json["shift_mm"].push_back(1e3 * found.shift[axis]);
    json["shift_sd_mm"].push_back(1e3 * found.shift_sd[axis]);
  }
  for (const calib::TouchedResidual& point : found.points)
    json["points"].push_back(
        {{"error_px", {point.error.x(), point.error.y()}}, {"across_mm", 1e3 * point.across}});
  const std::string text = data::format_json(json) + '\n';
  if (!options.out.empty()) data::write_atomically((fs::path(options.out) / kTouched).string(), text);
  if (options.common.json) {
    std::cout << text;
  } else {
    for (std::size_t i = 0; i < found.points.size(); ++i)
      std::printf("point %zu: (%.2f, %.2f) px, %.2f mm across the line of sight\n", i + 1,
                  found.points[i].error.x(), found.points[i].error.y(), 1e3 * found.points[i].across);
    std::printf("%s\n", calib::describe(found).c_str());
  }
  if (found.contradicts)
    say_unusable(calib::describe(found), "the touched points contradict the calibration");
  else if (!found.judges)
    say_unusable("the touched points tell the camera's place to no better than " +
                     data::format_short(1e3 * found.shift_sd.maxCoeff()) +
                     " mm: touch six or more, spread over the workspace and its heights",
                 "they cannot judge the calibration");
  else if (!extrinsics.usable)
    say_unusable(options.extrinsics + ": it ended with exit code 3", "the calibration cannot be used");
  return exit_code;
}

int run_validate(const CLI::App& verb, ValidateOptions options) {
  if (!options.touched.empty()) return run_touched(options);
  if (options.dataset.path.empty())
    throw data::InputError(
        "dataset, --touched: found neither, expected a recording, or points that were touched");
  if (is_calibration(options.dataset.path)) {
    if (!options.out.empty()) data::check_folder_free(options.out, options.common.force);
    expect_own_file(options, kPlacement, options.dataset.path);
    return run_placement(options);
  }
  std::string own;
  const data::LensChoice choice = data::parse_lens_choice(options.lens, own);
  expect_no_camera({.own = own}, options.dataset.camera);
  if (!own.empty()) options.dataset.camera = own;
  data::expect_not_held(options.out);
  if (!options.out.empty()) data::check_folder_free(options.out, options.common.force);
  const calib::Extrinsics extrinsics = calib::load_extrinsics(options.extrinsics, options.despite_doubts);
  for (const std::string& warning : extrinsics.warnings) warn_calib(options.extrinsics + ": " + warning);
  const calib::Dataset dataset = at_its_time(load_dataset(options.dataset), extrinsics, options.common);
  expect_no_picture_options(verb, dataset);
  std::vector<std::string> read = files_read(options.dataset, dataset, options.common);
  read.push_back(options.extrinsics);
  expect_own_files(files_written(dataset, options.out), read);
  expect_folder_apart(options.out, read);
  const bool pairs = dataset.frames.front().T_camera_target.has_value();
  if (pairs && !options.lens.empty())
    throw data::InputError("--lens: found " + options.lens + ", expected none: of pairs of poses, " +
                           dataset.source + ", the lens has been used already");
  if (dataset.setup && *dataset.setup != extrinsics.setup)
    throw data::InputError(dataset.source + ": found " + calib::to_string(*dataset.setup) + ", expected " +
                           calib::to_string(extrinsics.setup) + " as in " + options.extrinsics);
  const calib::Target target = pairs ? calib::Target() : target_of(options.dataset, dataset);
  const std::vector<ValidatedView> views = views_of(dataset, target, options);

  std::vector<calib::Observation> observations;
  for (const ValidatedView& view : views) observations.push_back(view.observation);
  const data::PosedLens posed = lens_of(extrinsics, dataset, options, choice);
  if (!posed.notice.empty()) warn_calib(posed.notice);
  const data::CameraIntrinsics& lens = posed.lens;
  observations =
      pairs ? calib::with_scales(std::move(observations), {extrinsics.target.scale, extrinsics.focal_length})
            : calib::with_poses_for(lens, target, extrinsics.target, std::move(observations),
                                    extrinsics.edge_offset);
  calib::HandEyePoses poses{extrinsics.transform.T, extrinsics.target_pose.T};
  if (options.refit_target) poses.Z = calib::target_pose_from(extrinsics.setup, poses.X, observations);
  const calib::ProjectionCheck check = calib::check_projection(
      extrinsics.setup, poses, lens, target, observations, extrinsics.target, extrinsics.edge_offset);
  const calib::Contradiction contradiction =
      calib::contradiction(extrinsics, poses, options.refit_target, lens, target, observations, check);
  std::vector<std::string> warnings = extrinsics.warnings;
  if (!contradiction.sentence.empty()) {
    warnings.insert(warnings.begin(), contradiction.sentence);
    warn_calib(warnings.front());
  }
  const int exit_code = !contradiction.sentence.empty() || !extrinsics.usable ? exit_unusable : exit_done;

  const std::optional<calib::CloudCheck> clouds =
      pairs ? std::nullopt : check_clouds(dataset, extrinsics, lens, views, check);
  const std::string text =
      data::format_json(result_json(options, warnings, check, !pairs, clouds, exit_code)) + '\n';
  if (!options.out.empty()) {
    data::write_atomically((fs::path(options.out) / kResult).string(), text);
    draw_views(views, check, options.out);
    if (clouds) {
      data::save_png(clouds->pattern, (fs::path(options.out) / kPattern).string());
      data::save_png(clouds->profile, (fs::path(options.out) / kProfile).string());
    }
  }
  if (options.common.json)
    std::cout << text;
  else
    print_table(check, !pairs, clouds);
  if (!contradiction.sentence.empty())
    say_unusable(contradiction.sentence, "these views contradict the calibration");
  else if (!extrinsics.usable)
    say_unusable(
        options.extrinsics + ": " +
            (extrinsics.warnings.empty() ? "it ended with exit code 3" : extrinsics.warnings.front()),
        "the calibration cannot be used");
  return exit_code;
}

}  // namespace

void add_validate_verb(CLI::App& app, Action& action) {
  const auto options = std::make_shared<ValidateOptions>();
  CLI::App* verb = app.add_subcommand(
      "validate",
      "Project the target through robot and calibration; lay the clouds of all views on each other");
  add_dataset_options(*verb, options->dataset);
  verb->get_option("dataset")->required(false);
  verb->add_option("--extrinsics", options->extrinsics, "What flash-calib handeye has written")->required();
  verb->add_option(
          "--lens", options->lens,
          "Where the calibration holds with another lens than the dataset's: solved takes that of the "
          "calibration, stated the dataset's, a file that one. Without it such sets are refused")
      ->type_name("stated|solved|FILE");
  verb->add_flag("--refit-target", options->refit_target,
                 "The target stands elsewhere than at the calibration");
  verb->add_option(
          "--touched", options->touched,
          "Points that the tool touched, in place of a recording: a table x,y,z,u,v of the tip in the "
          "base [m] and its pixel in a picture of the camera")
      ->type_name("FILE");
  verb->add_option("--touch-sd", options->touch.touch_sd, "How well the tip's place is known, an axis [m]")
      ->check(CLI::Range(1e-6, 1.0))
      ->capture_default_str();
  verb->add_option("--pixel-sd", options->touch.pixel_sd, "How well its pixel is known, an axis [px]")
      ->check(CLI::Range(1e-2, 100.0))
      ->capture_default_str();
  verb->add_option("-o,--out", options->out, "Folder for validation.json and pictures");
  add_calib_common_options(*verb, options->common);
  add_doubts_option(*verb, options->despite_doubts, "Use a calibration that handeye ended with exit code 3");
  verb->footer(
      "In place of a recording it takes what handeye has written of a later one, and says whether the "
      "camera stands where it did. With --touched it takes points instead.\n"
      "Exit code 3: these views are missed by three times what the calibration states, the camera has moved, "
      "or the calibration cannot be used.\n"
      "Example:\n"
      "  flash-calib validate another_recording --target chessboard:9x6:0.025 --extrinsics camera.json -o "
      "checked");
  verb->callback(
      [verb, options, &action] { action = [verb, options] { return run_validate(*verb, *options); }; });
}

}  // namespace flash
