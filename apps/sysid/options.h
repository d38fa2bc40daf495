#pragma once
#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "data/asset/asset.h"
#include "sim/device.h"
#include "sysid/emulate/grid_search.h"
#include "sysid/emulate/material_base.h"
#include "sysid/emulate/search_warnings.h"
#include "sysid/replay/replay.h"

namespace flash {

/// Options that every verb has.
struct CommonOptions {
  bool json = false;
  bool quiet = false;
  bool verbose = false;
  bool force = false;
  unsigned seed = 1;
  std::string device = "auto";
  int threads = 0;  ///< 0: one a processor
};
void add_common_options(CLI::App& verb, CommonOptions& options);
void add_seed_option(CLI::App& verb, CommonOptions& options);    ///< of verbs that draw at random
void add_device_option(CLI::App& verb, CommonOptions& options);  ///< of verbs that simulate
void add_cpu_option(CLI::App& verb, CommonOptions& options);     ///< of those that no device simulates for

/// How a recording is replayed and scored.
struct ReplayOptions {
  std::string mesh;
  double time_step = 0.01;
  int iterations = 60;
  double tolerance = 1e-3;
  std::string grasp_shape;
  double grasp_within = 0;  ///< 0: the recording's
  std::optional<double> grasp_cell{};
  bool clamp_slopes = false;
  double self_contact = 0;     ///< [m]; 0: none
  double layer_friction = -1;  ///< below 0: that of the object
  double from = 0, to = 0;
  std::string distance = "trimmed";
  double trim = 0.05, huber = 0.02;
  std::vector<std::string> sigmas;  ///< of the terms of the score, as force=0.02
  bool two_sided = false;
  std::vector<std::string> shared;
};
void add_grasp_cell_option(CLI::App& verb, std::optional<double>& grasp_cell);
/// Of searches, which keep what they have (stop_after).
void add_max_hours_option(CLI::App& verb, double& hours);
void add_replay_options(CLI::App& verb, ReplayOptions& options);
sysid::ReplaySettings replay_settings(const CLI::App& verb, const ReplayOptions& options, int threads);
sysid::ScoreSettings score_settings(const ReplayOptions& options);

/// Adds --young, --poisson, ...: one option a known parameter, its text kept by name.
void add_parameter_options(CLI::App& verb, std::vector<std::pair<std::string, std::string>>& values);

/// --hold NAME=VALUE or NAME=VALUE:measured, as often as wanted.
void add_hold_option(CLI::App& verb, std::vector<std::string>& holds, const std::string& meaning);
/// Throws data::InputError where a name is given twice.
std::vector<sysid::Hold> parse_holds(const std::vector<std::string>& texts);
/// Of all, whatever they rest on.
std::vector<sysid::Axis> axes_of(const std::vector<sysid::Hold>& holds);
/// Of values alone. Throws data::InputError where a standard deviation is given.
std::vector<sysid::Axis> parse_values(const std::vector<std::string>& texts);
/// Of a range that is searched. Throws data::InputError where it is one value, which --hold holds.
sysid::Axis parse_searched(const std::string& name, const std::string& specification);

/// What a verb says to people, on stderr, unless --quiet.
void say(const CommonOptions& options, const std::string& line);
void warn(const std::string& line);

/// What is likely wrong with the recording itself.
void warn_of_doubts(const data::Recording& recording);

/// What is known to be wrong with the calibration behind the recording's camera.
void warn_of_camera(const data::Recording& recording);

/// Where vertices of its sheet share a place and are not joined.
void warn_of_seams(const data::Recording& recording);

int thread_count(const CommonOptions& options);

/// Before anything is simulated: throws data::InputError naming `option` unless motions can be kept in
/// `folder`.
void check_keeps_motions(const std::string& option, const std::string& folder);

/// Throws data::InputError where --device wants a CUDA device that cannot simulate what the options ask for.
void check_device(const CommonOptions& options, const sysid::ReplaySettings& settings);

/// Has candidates simulated where --device wants it. No device simulates solids or self-contact: auto takes
/// the CPU for them. Throws data::InputError for a CUDA device that is not there, and as check_device does.
void place_simulation(const CommonOptions& options, const data::Asset& asset,
                      sysid::ReplaySettings& settings);
/// Takes the CPU where --device auto found a device that cannot simulate what is asked for, and says so.
/// Throws data::InputError where --device wants that device.
void place_candidates(const CommonOptions& options, const std::vector<sysid::ReplayCandidate>& candidates,
                      std::vector<sysid::Replay>& replays);

/// The recordings in the folders, told apart by name (a warning says where one was renamed). Throws
/// data::InputError where two of them are the same.
std::vector<data::Recording> load_recordings(const std::vector<std::string>& paths,
                                             const CommonOptions& options);

/// The asset named on the command line or, without one, by the recording.
data::Asset load_asset_for(const std::string& path, const data::Recording& recording);

using sysid::check_kind;
using sysid::material_base;

/// Throws InputError where an option is of sheets alone and the object is a solid, or of what no recording
/// has: the noise of forces where none was measured, an error in common with no other recording.
void check_options(const ReplayOptions& options, const data::Asset& asset,
                   const std::vector<data::Recording>& recordings);

/// Says what is known before a search and makes its answer worse.
void tell_known_before(const CommonOptions& options, const std::vector<sysid::Replay>& replays,
                       const sysid::GridSettings& settings, sysid::Coming coming);

}  // namespace flash
