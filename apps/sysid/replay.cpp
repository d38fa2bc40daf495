#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <regex>

#include "apps/command_line/command_line.h"
#include "apps/command_line/option_checks.h"
#include "apps/sysid/options.h"
#include "apps/sysid/verbs.h"
#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/json_reader.h"
#include "data/files/staged_folder.h"
#include "data/files/text.h"
#include "data/files/writable.h"
#include "data/mesh/mesh_io.h"
#include "data/mesh/procedural_mesh.h"
#include "sim/newton/accepted.h"
#include "sysid/observe/horizon.h"
#include "sysid/observe/registration_parameter.h"
#include "sysid/replay/memory_estimate.h"
#include "sysid/report/asset_replay.h"
#include "sysid/report/overlay.h"
#include "sysid/report/overlay_image.h"
#include "sysid/report/settings_texts.h"

namespace flash {
namespace {

namespace fs = std::filesystem;

struct ReplayVerbOptions {
  CommonOptions common;
  ReplayOptions replay;
  std::string recording;
  std::string asset;
  std::vector<std::string> holds;
  std::vector<int> frames;
  bool every_step = false;
  bool no_horizon = false;
  std::string out;
};

// Six frames, evenly spread over those that carry points.
std::vector<int> some_frames(const sysid::Overlay& overlay) {
  std::vector<int> seen;
  for (std::size_t k = 0; k < overlay.frames.size(); ++k)
    if (overlay.frames[k].cloud.rows() > 0) seen.push_back(static_cast<int>(k));
  std::vector<int> frames;
  for (std::size_t i = 1; i <= 6 && !seen.empty(); ++i) {
    const int frame = seen[(seen.size() - 1) * i / 6];
    if (frames.empty() || frames.back() != frame) frames.push_back(frame);
  }
  return frames;
}

std::string numbered(const std::string& folder, const char* format, int k) {
  char name[32];
  std::snprintf(name, sizeof name, format, k);
  return (fs::path(folder) / name).string();
}

// What a former replay left, killed or whole, the table first; no other folder is searched for it.
void remove_former(const std::string& folder) {
  static const std::regex name(R"(\d{3,}(_mesh\.ply|_cloud\.ply|\.png)|sequence\.png)");
  const fs::path first = fs::path(folder) / "000_mesh.ply";
  if (!fs::exists(first)) return;
  data::remove_leftovers(folder);
  fs::remove(fs::path(folder) / "overlay.csv");
  fs::remove_all(fs::path(folder) / "steps");
  std::vector<fs::path> old;
  for (const auto& entry : fs::directory_iterator(folder))
    if (std::regex_match(entry.path().filename().string(), name) && entry.path() != first)
      old.push_back(entry.path());
  old.push_back(first);  // last: till then it is known as a replay's
  for (const fs::path& path : old) fs::remove(path);
}

void draw_frames(const sysid::Overlay& overlay, const std::vector<int>& frames, const std::string& folder) {
  const Eigen::AlignedBox3d bounds = sysid::bounds_of(overlay, frames);
  for (const int k : frames) {
    end_after_signal();
    const sysid::OverlayFrame& frame = overlay.frames[static_cast<std::size_t>(k)];
    data::save_png(sysid::draw_overlay({frame.vertices, overlay.triangles}, frame.cloud, bounds),
                   numbered(folder, "%03d.png", k));
  }
  if (frames.size() > 1)
    data::save_png(sysid::draw_sequence(overlay, frames, bounds),
                   (fs::path(folder) / "sequence.png").string());
}

// Keyframes that the search behind the asset could not predict count here as little as there.
void keep_predictable(const sysid::IdentifiedRecording& identified, const CommonOptions& common,
                      sysid::Replay& replay) {
  if (const int dropped = sysid::drop_beyond_horizon(identified.horizon_s, replay); dropped > 0)
    say(common, replay.recording.name + ": the search behind the asset could not predict the motion from " +
                    data::format_short(*identified.horizon_s) + " s on: " + std::to_string(dropped) +
                    " keyframes do not count; --no-horizon keeps them");
}

bool is_of_material(const std::vector<sysid::Axis>& axes) {
  for (const sysid::Axis& axis : axes)
    for (const sysid::Parameter& info : sysid::known_parameters())
      if (info.material && info.name == axis.name) return true;
  return false;
}

nlohmann::ordered_json result_json(const sysid::CandidateResult& result, const sysid::ReplayResult& motion,
                                   const std::optional<sysid::IdentifiedRecording>& identified) {
  const sysid::RecordingScore& recording = result.recordings.front();
  nlohmann::ordered_json json;
  json["schema"] = "flash-sysid-replay/1";
  json["score"] = result.score;
  json["search_score"] = nullptr;
  if (identified && identified->score) json["search_score"] = *identified->score;
  json["converged"] = result.converged;
  json["unconverged_share"] = motion.unconverged_share;
  json["residual_max"] = result.residual_max;
  json["penetration_max_m"] = result.penetration_max;
  json["offset"] = {recording.offset.x(), recording.offset.y(), recording.offset.z()};
  json["yaw"] = recording.yaw;
  json["time_offset"] = recording.time_offset;
  json["bounds_hit"] = recording.bounds_hit;
  json["frames"] = nlohmann::ordered_json::array();
  for (const sysid::KeyframeScore& frame : recording.keyframes)
    if (frame.points > 0)
      json["frames"].push_back({{"t", frame.t}, {"score", frame.score}, {"weight", frame.weight}});
  return json;
}

int run_replay(const CLI::App& verb, const ReplayVerbOptions& options) {
  stop_on_signals();
  const data::Recording recording = data::load_recording(options.recording);
  warn_of_doubts(recording);
  const data::Asset asset = load_asset_for(options.asset, recording);
  check_kind(asset, recording);
  check_options(options.replay, asset, {recording});
  sysid::ReplaySettings simulated = replay_settings(verb, options.replay, thread_count(options.common));
  check_device(options.common, simulated);
  const sim::DeviceChoice device =
      sim::choose_device(options.common.device == "auto" ? "cpu" : options.common.device);
  simulated.device = device.device;
  simulated.cuda_devices = device.cuda_devices;
  sysid::AssetReplay ready = sysid::make_asset_replay(recording, asset, simulated);
  sysid::Replay& replay = ready.replay;
  const std::optional<sysid::IdentifiedRecording>& identified = ready.identified;
  if (ready.as_answered &&
      (replay.settings.cell_scale < 1 || replay.recording.mesh_spec != recording.mesh_spec))
    say(options.common, recording.name + ": the mesh is " +
                            sysid::settings_texts({replay}, sysid::GridSettings{}).at("mesh") +
                            ", that of the answer behind the asset; --mesh replaces that");
  if (options.common.verbose)
    for (const std::string& notice : replay.notices) say(options.common, notice);
  std::vector<std::string> notices;
  const std::vector<sysid::Axis> axes = parse_values(options.holds);
  const sysid::MaterialBase base = material_base(asset, replay.sheet(), notices, axes);
  const sysid::ReplayCandidate candidate = sysid::candidate_of(ready, base, axes);
  sysid::check_job({replay}, 1, sysid::estimate_batch({replay}, 1, options.every_step));
  data::check_folder_free(options.out, options.common.force);
  for (const std::string& notice : notices) say(options.common, notice);
  sysid::GridSettings grid;
  grid.base = base;
  grid.score = score_settings(options.replay);
  for (const std::string& line : sysid::unlike_the_search(asset, sysid::settings_texts({replay}, grid), axes))
    warn(line);

  if (identified && !options.no_horizon) keep_predictable(*identified, options.common, replay);
  if (sysid::has_found_grasp_size(ready, axes))
    say(options.common, replay.recording.name + ": the patch is " +
                            data::format_short(1e3 * *identified->grasp_size) +
                            " mm, as the search behind the asset found; --hold grasp_size=... replaces that");
  sysid::ReplayResult motion;
  sysid::run(replay, {candidate}, options.every_step ? every_step(replay) : scored_steps(replay),
             [&](std::size_t, sysid::ReplayResult result) { motion = std::move(result); });
  const sysid::CandidateResult result = sysid::score_motions({replay}, {motion}, grid.score);
  if (result.status == sysid::CandidateStatus::diverged)
    throw std::runtime_error(recording.name + ": the simulation diverged; lower --time-step");

  const sysid::Overlay overlay = sysid::make_overlay(replay, motion.motion, result.recordings.front());
  const std::vector<int> frames = options.frames.empty() ? some_frames(overlay) : options.frames;
  for (const int k : frames)
    if (k < 0 || k >= static_cast<int>(overlay.frames.size()))
      throw data::InputError("--frames: " + std::to_string(k) + " is not a keyframe; expected 0 to " +
                             std::to_string(overlay.frames.size() - 1));
  end_after_signal();
  data::StagedFolder staged(options.out);
  sysid::save_overlay(overlay, staged.path());
  if (options.every_step)
    for (std::size_t k = 0; k < motion.motion.positions.size(); ++k) {
      end_after_signal();
      data::save_triangle_mesh(
          {motion.motion.positions[k], overlay.triangles},
          numbered((fs::path(staged.path()) / "steps").string(), "%06d.ply", static_cast<int>(k)));
    }
  draw_frames(overlay, frames, staged.path());
  end_after_signal();
  remove_former(options.out);
  staged.publish("overlay.csv");

  warn_of_camera(recording);
  warn_of_seams(replay.recording);
  if (motion.penetration_max > 5e-3)
    warn("the gripper takes the sheet up to " + data::format_short(1e3 * motion.penetration_max) +
         " mm below the table: is the table's height right?");
  if (!result.converged)
    warn("not converged in " + data::format_short(100 * motion.unconverged_share) +
         " % of the steps, residual up to " + data::format_short(result.residual_max) +
         " (accepted: 1 %, and a residual of 1)" +
         (options.replay.self_contact > 0
              ? "; where it is small, layers kept what a gripper holds from its place"
              : ""));
  if (identified && !is_of_material(axes))
    if (const std::string line = sysid::unlike_its_score(*identified, result.score); !line.empty())
      warn(line);
  for (const sysid::RegistrationParameter& parameter : sysid::registration_parameters)
    if (sysid::is_at_bound(result.recordings.front().bounds_hit, parameter))
      warn(sysid::at_bound_text(parameter, recording.nuisance));
  if (options.common.json) {
    std::cout << data::format_json(result_json(result, motion, identified));
  } else {
    const sysid::RecordingScore& fit = result.recordings.front();
    for (const sysid::KeyframeScore& frame : fit.keyframes)
      if (frame.points > 0)
        std::printf("%8.3f s  %6.2f mm  %6d points%s\n", frame.t, 1000 * frame.score, frame.points,
                    frame.weight > 0 ? "" : "  not counted");
    std::printf("score %.2f mm, offset %.1f %.1f %.1f mm, yaw %.3f rad, clock %.0f ms\n%s\n",
                1000 * result.score, 1000 * fit.offset.x(), 1000 * fit.offset.y(), 1000 * fit.offset.z(),
                fit.yaw, 1000 * fit.time_offset, options.out.c_str());
  }
  return sim::accepted(motion.unconverged_share, result.residual_max) ? exit_done : exit_unusable;
}

}  // namespace

void add_replay_verb(CLI::App& app, Action& action) {
  const auto options = std::make_shared<ReplayVerbOptions>();
  CLI::App* verb = app.add_subcommand(
      "replay", "Replay one set of parameters: meshes, scores and pictures over the observation");
  verb->add_option("recording", options->recording, "Folder with recording.json")->required();
  verb->add_option("--asset", options->asset, "The object; without one, the asset the recording names");
  add_hold_option(*verb, options->holds, "A value in place of the asset's, as bending=1e-4");
  add_list_option(*verb, "--frames", options->frames,
                  "Keyframes to draw, counted from 0, each and together in sequence.png; without it six",
                  whole_number(0, 1'000'000));
  verb->add_flag("--every-step", options->every_step, "Write the mesh of every step too");
  verb->add_flag("--no-horizon", options->no_horizon,
                 "Count keyframes too that the search behind the asset could not predict");
  verb->add_option("-o,--out", options->out, "Folder for meshes, clouds, overlay.csv and pictures")
      ->required();
  add_replay_options(*verb, options->replay);
  add_device_option(*verb, options->common);
  add_common_options(*verb, options->common);
  verb->footer(
      "Exit code 3: more than 1 % of the steps did not converge, or one has a residual above 1; all files "
      "are\n"
      "written.\n"
      "Example:\n  flash-sysid replay lift_a --asset towel.json --hold bending=1e-4 --frames 12,16,20,24 -o "
      "overlay");
  verb->callback(
      [verb, options, &action] { action = [verb, options] { return run_replay(*verb, *options); }; });
}

}  // namespace flash
