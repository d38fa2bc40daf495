#include "apps/sysid/options.h"

#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <thread>

#include "apps/command_line/command_line.h"
#include "apps/command_line/option_checks.h"
#include "data/files/error.h"
#include "data/files/message_line.h"
#include "data/files/text.h"
#include "data/files/writable.h"
#include "data/mesh/mesh_io.h"
#include "data/mesh/procedural_mesh.h"
#include "data/mesh/seams.h"
#include "data/recording/recording_digest.h"
#include "sim/scene/sheet.h"
#include "sysid/emulate/search_warnings.h"
#include "sysid/report/recording_names.h"

namespace flash {
namespace {

void set_sigma(const std::string& assignment, sysid::Objective& objective) {
  const std::size_t equals = assignment.find('=');
  const std::string name = assignment.substr(0, equals);
  double* const sigma = name == "cloud"     ? &objective.cloud_sigma
                        : name == "contour" ? &objective.contour_sigma
                        : name == "markers" ? &objective.marker_sigma
                        : name == "force"   ? &objective.force_sigma
                                            : nullptr;
  const std::optional<double> value =
      data::parse_number(equals == std::string::npos ? "" : std::string_view(assignment).substr(equals + 1));
  if (sigma == nullptr || !value || !(*value > 0) || !std::isfinite(*value))
    throw data::InputError(
        "--sigma: \"" + assignment +
        "\": expected cloud, contour, markers or force = a positive number, as force=0.02");
  constexpr double kLargest = 0.1;  // [m]
  if (sigma != &objective.force_sigma && *value >= kLargest)
    throw data::InputError("--sigma: " + assignment + ": found " + data::format_short(*value) +
                           " m, expected below 0.1 m; a millimetre is 0.001");
  *sigma = *value;
}

/// Noise of each kind of observation, stated once.
void set_sigmas(const std::vector<std::string>& assignments, sysid::Objective& objective) {
  std::set<std::string> names;
  for (const std::string& assignment : assignments) {
    set_sigma(assignment, objective);
    if (const std::string name = assignment.substr(0, assignment.find('=')); !names.insert(name).second)
      throw data::InputError("--sigma " + name + ": given twice, expected one value");
  }
}

/// Throws InputError where an option is of another --distance than the one that is taken.
void check_distance(const CLI::App& verb, const std::string& distance) {
  for (const auto& [option, of] : {std::pair("--trim", "trimmed"), std::pair("--huber", "huber")})
    if (verb.count(option) > 0 && distance != of)
      throw data::InputError(std::string(option) + ": found --distance " + distance +
                             ", expected --distance " + of + " beside it");
}

bool observes(const data::RecordedKeyframe& keyframe, const std::string& term) {
  return (term == "cloud" && !(keyframe.cloud + keyframe.depth).empty()) ||
         (term == "contour" && !keyframe.contour.empty()) ||
         (term == "markers" && (!keyframe.markers.empty() || keyframe.sample >= 0)) ||
         (term == "force" && keyframe.force);
}

/// Throws InputError where an option is of what no recording has.
void check_observed(const ReplayOptions& options, const std::vector<data::Recording>& recordings) {
  const auto expect = [&](const std::string& option, const std::string& term) {
    for (const data::Recording& recording : recordings)
      for (const data::RecordedKeyframe& keyframe : recording.keyframes)
        if (observes(keyframe, term)) return;
    throw data::InputError(option + ": found no " + term + " in a keyframe of " + recordings.front().source +
                           (recordings.size() > 1 ? " and the other recordings" : "") +
                           ", expected an option of what was observed");
  };
  sysid::Objective stated;
  set_sigmas(options.sigmas, stated);  // which refuses other words
  for (const std::string& sigma : options.sigmas)
    expect("--sigma " + sigma, sigma.substr(0, sigma.find('=')));
  if (options.two_sided) expect("--two-sided", "cloud");
  if (!options.shared.empty() && recordings.size() < 2)
    throw data::InputError("--share " + options.shared.front() +
                           ": found one recording, expected two or more");
}

}  // namespace

void add_common_options(CLI::App& verb, CommonOptions& options) {
  CLI::App& group = *verb.add_option_group("Common");
  group.add_flag("--json", options.json, "Print the result as JSON on stdout");
  CLI::Option* quiet = group.add_flag("--quiet", options.quiet, "Print nothing but the result and errors");
  group.add_flag("--verbose", options.verbose, "Print every notice")->excludes(quiet);
  group.add_flag("--force", options.force, "Overwrite what is there");
  group.add_option("--threads", options.threads, "Number of threads; 0: one per processor")
      ->check(thread_number())
      ->capture_default_str();
}

void add_seed_option(CLI::App& verb, CommonOptions& options) {
  verb.add_option("--seed", options.seed, "Random seed: the same one gives the same result")
      ->check(whole_number(0, std::numeric_limits<unsigned>::max()))
      ->capture_default_str();
}

void add_device_option(CLI::App& verb, CommonOptions& options) {
  verb.add_option("--device", options.device,
                  "Where the simulation runs: cpu, cuda, cuda:1, cuda:0,2, cuda:all, or auto: a CUDA device "
                  "where there is one")
      ->capture_default_str();
}

void add_cpu_option(CLI::App& verb, CommonOptions& options) {
  verb.add_option("--device", options.device, "Where the simulation runs")
      ->check(cpu_alone("this verb simulates on the CPU alone"))
      ->capture_default_str();
}

void add_grasp_cell_option(CLI::App& verb, std::optional<double>& grasp_cell) {
  verb.add_option(
          "--grasp-cell", grasp_cell,
          "Edge length of the cells at the grasps [m]; without it, a fifth of those of the mesh or of "
          "the patch, where the mesh names no pattern; 0: the mesh as it is")
      ->check(number_from(0));
}

void add_max_hours_option(CLI::App& verb, double& hours) {
  verb.add_option("--max-hours", hours, "End after so long, with what was simulated kept for --resume [h]")
      ->check(positive_number());
}

void add_replay_options(CLI::App& verb, ReplayOptions& options) {
  CLI::App& group = *verb.add_option_group("Replay and score");
  group.add_option("--mesh", options.mesh, "Mesh in place of the recording's, as sheet:0.4x0.4:0.02");
  group.add_option("--time-step", options.time_step, "Time step of the simulation [s]")
      ->check(time_step())
      ->capture_default_str();
  group.add_option("--iterations", options.iterations, "Maximum Newton iterations per time step")
      ->check(whole_number(1, 10000))
      ->capture_default_str();
  group
      .add_option("--tolerance", options.tolerance,
                  "Largest residual of a step that counts as converged, over the weight of the sheet")
      ->check(number_between(1e-12, 1))  // of numbers with 16 digits; at 1 nothing is solved
      ->capture_default_str();
  group
      .add_option("--grasp-shape", options.grasp_shape,
                  "How the patch sits in the fingers, in place of what the recording says")
      ->check(CLI::IsMember({"clamp", "point", "pinch"}));
  group
      .add_option("--grasp-within", options.grasp_within,
                  "Size of the grasped patch in place of the recording's [m]")
      ->check(positive_number());
  add_grasp_cell_option(group, options.grasp_cell);
  group.add_flag("--clamp-slopes", options.clamp_slopes,
                 "A clamped patch does not bend: it holds the sheet's slope as well as its place");
  CLI::Option* const layers =
      group
          .add_option(
              "--self-contact", options.self_contact,
              "The object meets itself: distance from which on its layers feel each other, as 0.001 [m]; "
              "without it, it passes through itself")
          ->check(positive_number());
  group
      .add_option("--layer-friction", options.layer_friction,
                  "Coulomb coefficient of layer on layer; without it, that of the object")
      ->check(number_from(0))
      ->needs(layers);
  group.add_option("--from", options.from, "Keyframes before do not count, from the recording's start [s]")
      ->check(any_number());
  group.add_option("--until", options.to, "Keyframes after do not count, from the recording's start [s]")
      ->check(any_number());
  group.add_option("--distance", options.distance, "How point distances become one number")
      ->check(CLI::IsMember({"mean", "trimmed", "huber"}))
      ->capture_default_str();
  group.add_option("--trim", options.trim, "trimmed: share of the largest distances left out")
      ->check(number_between(0, 0.5))
      ->capture_default_str();
  group.add_option("--huber", options.huber, "huber: where the distance stops counting in full [m]")
      ->check(positive_number())
      ->capture_default_str();
  group
      .add_option("--sigma", options.sigmas,
                  "Noise of what was observed, as force=0.02: cloud, contour, markers [m] or force [N]; "
                  "terms count by it")
      ->allow_extra_args(false);
  group.add_flag(
      "--two-sided", options.two_sided,
      "Simulated cloth inside the crop where none was seen counts too: for recordings that see all of it");
  add_list_option(group, "--share", options.shared,
                  "Errors of registration that all recordings have in common",
                  CLI::IsMember({"offset", "yaw", "time-offset"}));
}

sysid::ReplaySettings replay_settings(const CLI::App& verb, const ReplayOptions& options, int threads) {
  check_distance(verb, options.distance);
  sysid::ReplaySettings settings;
  settings.solver.time_step = options.time_step;
  settings.solver.max_iterations = options.iterations;
  settings.solver.tolerance = options.tolerance;
  settings.mesh = options.mesh;
  settings.threads = threads;
  settings.clamp_slopes = options.clamp_slopes;
  if (options.self_contact > 0)
    settings.self_contact =
        sim::SelfContact{.thickness = options.self_contact, .friction = options.layer_friction};
  if (options.grasp_within > 0) settings.grasp_within = options.grasp_within;
  settings.grasp_cell = options.grasp_cell;
  settings.grasp_shape = data::parse_grasp_shape(options.grasp_shape);  // empty: as recorded
  settings.solver.stop = &stop_on_signals();
  if (verb.count("--from") > 0) settings.score_from = options.from;
  if (verb.count("--until") > 0) settings.score_to = options.to;
  return settings;
}

sysid::ScoreSettings score_settings(const ReplayOptions& options) {
  sysid::ScoreSettings settings;
  settings.objective.robust.kind = options.distance == "mean"    ? sysid::RobustKind::plain
                                   : options.distance == "huber" ? sysid::RobustKind::huber
                                                                 : sysid::RobustKind::trimmed;
  settings.objective.robust.trim_fraction = options.trim;
  settings.objective.robust.huber_delta = options.huber;
  set_sigmas(options.sigmas, settings.objective);
  settings.objective.two_sided = options.two_sided;
  const auto shares = [&](const char* name) {
    return std::find(options.shared.begin(), options.shared.end(), name) != options.shared.end();
  };
  settings.shared = {shares("offset"), shares("yaw"), shares("time-offset")};
  return settings;
}

void add_parameter_options(CLI::App& verb, std::vector<std::pair<std::string, std::string>>& values) {
  CLI::App& group = *verb.add_option_group("Searched parameters",
                                           "low:high:count[:log] or a list a,b,c; --hold takes one value");
  for (const sysid::Parameter& info : sysid::known_parameters()) {
    const std::string unit = info.unit.empty() ? "" : " [" + info.unit + "]";
    group
        .add_option_function<std::string>(
            sysid::option_of(info.name),
            [&values, name = info.name](const std::string& text) { values.emplace_back(name, text); },
            info.meaning + unit)
        ->type_name("VALUES");
  }
}

void add_hold_option(CLI::App& verb, std::vector<std::string>& holds, const std::string& meaning) {
  verb.add_option("--hold", holds, meaning)->allow_extra_args(false);
}

std::vector<sysid::Hold> parse_holds(const std::vector<std::string>& texts) {
  std::vector<sysid::Hold> holds;
  std::set<std::string> names;
  for (const std::string& text : texts) {
    holds.push_back(sysid::parse_hold(text));
    const std::string& name = holds.back().axis.name;
    if (!names.insert(name).second)
      throw data::InputError("--hold " + name + ": given twice, expected one value");
  }
  return holds;
}

std::vector<sysid::Axis> axes_of(const std::vector<sysid::Hold>& holds) {
  std::vector<sysid::Axis> axes;
  for (const sysid::Hold& hold : holds) axes.push_back(hold.axis);
  return axes;
}

std::vector<sysid::Axis> parse_values(const std::vector<std::string>& texts) {
  const std::vector<sysid::Hold> holds = parse_holds(texts);
  for (const sysid::Hold& hold : holds)
    if (hold.deviation)
      throw data::InputError("--hold " + hold.axis.name +
                             ": found a standard deviation, expected one value: nothing is estimated here");
  return axes_of(holds);
}

sysid::Axis parse_searched(const std::string& name, const std::string& specification) {
  sysid::Axis axis = sysid::parse_axis(name, specification);
  if (axis.values.size() < 2)
    throw data::InputError(sysid::option_of(name) +
                           ": found one value, expected a range, as low:high:count; hold it as --hold " +
                           name + "=" + data::format_short(axis.values.front()));
  return axis;
}

void say(const CommonOptions& options, const std::string& line) {
  if (!options.quiet) std::cerr << data::message_line(line) << '\n';
}

void warn(const std::string& line) {
  std::cerr << "flash-sysid: warning: " << data::message_line(line) << '\n';
}

void warn_of_doubts(const data::Recording& recording) {
  for (const std::string& doubt : recording.doubts) warn(recording.source + ": " + doubt);
}

void warn_of_camera(const data::Recording& recording) {
  if (!recording.camera) return;
  for (const std::string& warning : recording.camera->warnings)
    warn(recording.name + ": calibration of its camera: " + warning);
}

void warn_of_seams(const data::Recording& recording) {
  if (recording.is_solid()) return;
  // Of a file as it stands, not as it is refined about a grasp.
  const bool of_file = !recording.mesh_spec.empty() && !data::is_made_on_the_spot(recording.mesh_spec);
  const std::string seams =
      data::seam_warning(of_file ? data::load_triangle_mesh(recording.mesh_spec) : recording.mesh);
  if (!seams.empty()) warn(recording.name + ": " + recording.mesh_spec + ": " + seams);
}

void tell_known_before(const CommonOptions& options, const std::vector<sysid::Replay>& replays,
                       const sysid::GridSettings& settings, sysid::Coming coming) {
  const sysid::KnownBefore known = sysid::known_before(replays, settings, coming);
  for (const std::string& warning : known.warnings) warn(warning);
  for (const std::string& notice : known.notices) say(options, notice);
}

int thread_count(const CommonOptions& options) {
  return options.threads > 0 ? options.threads
                             : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

void check_keeps_motions(const std::string& option, const std::string& folder) {
  try {
    data::check_folder_writable(folder);
  } catch (const data::InputError& error) {
    throw data::InputError(option + ": " + error.what() + ", expected a folder that takes files");
  }
}

void check_device(const CommonOptions& options, const sysid::ReplaySettings& settings) {
  if (settings.self_contact && options.device.starts_with("cuda"))
    throw data::InputError("--device " + options.device +
                           ": --self-contact is simulated on the CPU alone; use --device cpu or auto");
}

void place_simulation(const CommonOptions& options, const data::Asset& asset,
                      sysid::ReplaySettings& settings) {
  check_device(options, settings);
  const bool on_cpu = asset.element_type == data::ElementType::tetrahedron || settings.self_contact;
  const sim::DeviceChoice choice =
      sim::choose_device(options.device == "auto" && on_cpu ? "cpu" : options.device);
  settings.device = choice.device;
  settings.cuda_devices = choice.cuda_devices;
}

void place_candidates(const CommonOptions& options, const std::vector<sysid::ReplayCandidate>& candidates,
                      std::vector<sysid::Replay>& replays) {
  if (replays.front().settings.device != sim::Device::cuda) return;
  const std::string why = sysid::why_not_on_device(replays.front(), candidates);
  if (why.empty()) return;
  if (options.device != "auto")
    throw data::InputError("--device " + options.device + ": " + why + "; use --device cpu or auto");
  say(options, "--device auto takes the CPU: " + why);
  for (sysid::Replay& replay : replays) {
    replay.settings.device = sim::Device::cpu;
    replay.settings.cuda_devices.clear();
  }
}

std::vector<data::Recording> load_recordings(const std::vector<std::string>& paths,
                                             const CommonOptions& options) {
  std::vector<data::Recording> recordings;
  std::map<std::string, std::string> known;  // sources by content
  std::vector<std::string> names;
  for (const std::string& path : paths) {
    recordings.push_back(data::load_recording(path));
    const data::Recording& recording = recordings.back();
    warn_of_doubts(recording);
    names.push_back(recording.name);
    if (paths.size() == 1) break;
    const auto [same, is_new] = known.emplace(data::observed_sha256(recording), recording.source);
    if (!is_new)
      throw data::InputError(recording.source + ": is the same recording as " + same->second +
                             ", expected each once: twice would count as two trials");
  }
  names = sysid::told_apart(names);
  for (std::size_t r = 0; r < recordings.size(); ++r) {
    if (names[r] == recordings[r].name) continue;
    say(options, recordings[r].source + ": is called " + names[r] + " here, as another recording is named " +
                     recordings[r].name + " too");
    recordings[r].name = names[r];
  }
  return recordings;
}

data::Asset load_asset_for(const std::string& path, const data::Recording& recording) {
  if (!path.empty()) return data::load_asset(path);
  if (recording.asset.empty())
    throw data::InputError("--asset: none given, and " + recording.source + " names none in object.asset");
  return data::load_asset(recording.asset);
}

void check_options(const ReplayOptions& options, const data::Asset& asset,
                   const std::vector<data::Recording>& recordings) {
  check_observed(options, recordings);
  if (asset.element_type == data::ElementType::tetrahedron && options.clamp_slopes)
    throw data::InputError(
        "--clamp-slopes: found a solid, expected a sheet: a solid has no slopes of its own");
}

}  // namespace flash
