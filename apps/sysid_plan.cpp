#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <system_error>

#include "apps/command_line.h"
#include "apps/option_checks.h"
#include "apps/sysid_options.h"
#include "apps/sysid_verbs.h"
#include "data/atomic_file.h"
#include "data/error.h"
#include "data/json_reader.h"
#include "data/text.h"
#include "sysid/capture/render_depth.h"
#include "sysid/capture/synth.h"
#include "sysid/design/plan.h"
#include "sysid/replay/memory_estimate.h"
#include "sysid/report/parameter_label.h"

namespace flash {
namespace {

namespace fs = std::filesystem;

struct PlanOptions {
  CommonOptions common;
  ReplayOptions replay;
  std::vector<std::string> recordings;
  std::string asset;
  std::vector<std::pair<std::string, std::string>> axes;
  double error = 1e-3;
  double keyframes = 10;
  std::string out;
};

// A folder of its own, which nobody else can read; removed with all that is in it.
struct ScratchFolder {
  ScratchFolder() {
    if (mkdtemp(path.data()) == nullptr) throw std::system_error(errno, std::generic_category(), path);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  ~ScratchFolder() {
    std::error_code ignored;
    fs::remove_all(path, ignored);
  }
  std::string path = (fs::temp_directory_path() / "flash-plan-XXXXXX").string();
};

// What may be unknown of a cloth (618 fabrics measured: bending 1 to 110 uN m at 5 and 95 %), unless told.
const std::vector<std::pair<std::string, std::string>>& usual_ranges() {
  static const std::vector<std::pair<std::string, std::string>> ranges = {{"young", "0.2:5:2:log"},
                                                                          {"poisson", "0:0.45:2"},
                                                                          {"bending", "0.1:10:2:log"},
                                                                          {"friction", "0.15:0.6:2:log"}};
  return ranges;
}

double current_value(const sysid::MaterialBase& base, const std::string& name) {
  const data::SheetMaterial& m = base.material;
  if (name == "young") return m.membrane_stiffness / base.thickness.value_or(1.0);
  if (name == "poisson") return m.poissons_ratio;
  if (name == "bending") return sysid::make_candidate(base, {}, {}).material.bending_rigidity;
  if (name == "friction") return m.friction;
  if (name == "areal_density") return m.areal_density;
  if (name == "air_drag") return m.air_drag;
  if (name == "stiffness_damping") return m.stiffness_damping;
  return 0;
}

// The parameters asked about; without options the four of a cloth, stiffnesses about those of the asset.
std::vector<sysid::Axis> axes_of(const PlanOptions& options, const sysid::MaterialBase& base) {
  std::vector<sysid::Axis> axes;
  for (const auto& [name, text] : options.axes) axes.push_back(sysid::parse_axis(name, text));
  if (!axes.empty()) return axes;
  for (const auto& [name, text] : usual_ranges()) {
    axes.push_back(sysid::parse_axis(name, text));
    if (name == "young" || name == "bending")
      for (double& value : axes.back().values) value *= current_value(base, name);
  }
  return axes;
}

constexpr double kMotion = 2.0, kLongestExperiment = 3.0;  // of the experiments that synth knows [s]

// A sheet of the recording's size in each of the experiments that synth knows, seen by two cameras.
sysid::Replay virtual_replay(const std::string& kind, const data::Recording& like,
                             const data::SheetMaterial& material, const sysid::ReplaySettings& replay,
                             unsigned seed) {
  sysid::SynthSettings settings;
  settings.name = kind;
  settings.kind = kind;
  settings.duration = kMotion;
  settings.rest = kind == "hang" ? kLongestExperiment - kMotion : 0.0;
  settings.depth_noise = 0;
  settings.forces = kind == "bar_pull" || kind == "bias_pull" || kind == "drag";
  settings.seed = seed;
  const Eigen::Vector3d low = like.mesh.vertices.colwise().minCoeff(),
                        high = like.mesh.vertices.colwise().maxCoeff();
  const double size = (high - low).maxCoeff();
  settings.grasp_within = std::max(0.0201, 0.08 * size);
  const Eigen::Vector3d target = 0.5 * (low + high) + 0.3 * size * Eigen::Vector3d::UnitZ();
  sysid::SynthCamera camera;
  camera.intrinsics.width = 64;
  camera.intrinsics.height = 48;
  camera.intrinsics.fx = camera.intrinsics.fy = 55;
  camera.intrinsics.cx = 31.5;
  camera.intrinsics.cy = 23.5;
  for (const Eigen::Vector3d& from : {Eigen::Vector3d(0, -2.25, 1.6), Eigen::Vector3d(1.6, 1.6, 1.4)}) {
    camera.base_from_camera = sysid::look_at(target + size * from, target, Eigen::Vector3d::UnitZ());
    settings.cameras.push_back(camera);
  }
  data::TriangleMesh mesh = like.mesh;
  mesh.vertices.rowwise() -= low.transpose();
  sysid::SynthRecording made = sysid::synthesize(mesh, like.mesh_spec, material, settings, replay.solver);
  const ScratchFolder scratch;  // after the simulation, so that it stands for a moment only
  sysid::save_synthetic(made, scratch.path);
  return sysid::make_replay(data::load_recording(scratch.path), replay);
}

std::string spread_text(const sysid::Axis& axis, double spread) {
  if (!axis.logarithmic) return "+-" + data::format_short(spread);
  // What is beyond 1 has two digits at least.
  const double factor = std::exp(spread);
  const double digits = std::clamp(1 - std::floor(std::log10(factor - 1)), 2.0, 9.0);
  char text[32];
  std::snprintf(text, sizeof text, "x/: %.*f", static_cast<int>(digits), factor);
  return text;
}

nlohmann::ordered_json plan_json(const std::vector<sysid::PlannedExperiment>& experiments,
                                 const std::vector<sysid::Axis>& axes, const PlanOptions& options) {
  nlohmann::ordered_json json;
  json["schema"] = "flash-sysid-plan/1";
  json["error_m"] = options.error;
  json["keyframes"] = options.keyframes;
  const std::vector<double> before = sysid::spread_of_ranges(axes);
  for (std::size_t k = 0; k < axes.size(); ++k) {
    std::vector<const sysid::PlannedExperiment*> order;
    for (const sysid::PlannedExperiment& experiment : experiments) order.push_back(&experiment);
    std::stable_sort(order.begin(), order.end(),
                     [&](const auto* a, const auto* b) { return a->spread[k] < b->spread[k]; });
    nlohmann::ordered_json& parameter = json["parameters"][axes[k].name];
    parameter["range"] = {axes[k].values.front(), axes[k].values.back()};
    parameter["spread_of"] = axes[k].logarithmic ? "logarithm" : "value";
    parameter["before"] = before[k];
    for (const auto* experiment : order)
      parameter["ranking"].push_back({{"experiment", experiment->name}, {"spread", experiment->spread[k]}});
  }
  return json;
}

int run_plan(const CLI::App& verb, const PlanOptions& options) {
  stop_on_signals();
  choose_device(options.common);
  const int threads = thread_count(options.common);
  std::vector<data::Recording> recordings = load_recordings(options.recordings, options.common);
  const data::Asset asset = load_asset_for(options.asset, recordings.front());
  const sysid::ReplaySettings replay = replay_settings(verb, options.replay, threads);
  if (!replay.mesh.empty()) recordings.front() = sysid::make_replay(recordings.front(), replay).recording;
  std::vector<std::string> notices;
  sysid::PlanSettings settings;
  settings.grid.base = material_base(asset, recordings.front().mesh, notices);
  settings.grid.score = score_settings(options.replay);
  settings.grid.axes = axes_of(options, settings.grid.base);
  settings.error = options.error;
  settings.keyframes = options.keyframes;
  for (const sysid::Axis& axis : settings.grid.axes)
    settings.at.push_back(
        std::clamp(current_value(settings.grid.base, axis.name), axis.values.front(), axis.values.back()));
  check_output_file(options.out, options.common);
  sysid::steps_in(kLongestExperiment, options.replay.time_step);  // refused before anything is simulated

  const data::SheetMaterial material = sysid::candidate_at(settings.at, settings.grid).material;
  std::vector<sysid::PlannedExperiment> experiments;
  for (const data::Recording& recording : recordings) {
    const std::vector<sysid::Replay> replays = {
        sysid::make_replay(data::load_recording(recording.source), replay)};
    const std::size_t batch = 2 * settings.at.size() + 1;
    sysid::check_job(replays, static_cast<double>(batch), sysid::estimate_batch(replays, batch));
    experiments.push_back(sysid::plan_experiment(recording.name, replays, settings));
  }
  for (const char* kind : {"corner_lift", "hang", "bar_pull", "bias_pull", "drag"}) {
    say(options.common, std::string("simulating ") + kind);
    sysid::ReplaySettings own;
    own.solver = replay.solver;
    own.threads = threads;
    const sysid::Replay made = virtual_replay(kind, recordings.front(), material, own, options.common.seed);
    experiments.push_back(sysid::plan_experiment(kind, {made}, settings));
  }
  const std::vector<sysid::Axis>& axes = settings.grid.axes;
  const std::string text = data::format_json(plan_json(experiments, axes, options));
  end_after_signal();
  data::write_atomically(options.out, text);
  if (options.common.json) {
    std::cout << text;
    return exit_done;
  }
  std::printf("%-16s", "experiment");
  for (const sysid::Axis& axis : axes) std::printf(" %12s", axis.name.c_str());
  std::printf("\n%-16s", "(range alone)");
  const std::vector<double> before = sysid::spread_of_ranges(axes);
  for (std::size_t k = 0; k < axes.size(); ++k) std::printf(" %12s", spread_text(axes[k], before[k]).c_str());
  for (const sysid::PlannedExperiment& experiment : experiments) {
    std::printf("\n%-16s", experiment.name.c_str());
    for (std::size_t k = 0; k < axes.size(); ++k)
      std::printf(" %12s", spread_text(axes[k], experiment.spread[k]).c_str());
  }
  std::printf("\n%s\n", options.out.c_str());
  return exit_done;
}

}  // namespace

void add_plan_verb(CLI::App& app, Action& action) {
  const auto options = std::make_shared<PlanOptions>();
  CLI::App* verb = app.add_subcommand("plan", "Say which experiment would tell each parameter best");
  verb->add_option("recording", options->recordings,
                   "Folders with recording.json: the sheet, and what is there already")
      ->required();
  verb->add_option("--asset", options->asset, "The object; without one, the asset the recording names");
  verb->add_option("--error", options->error, "Distance by which model and sheet differ in a keyframe [m]")
      ->check(positive_number())
      ->capture_default_str();
  verb->add_option("--keyframes", options->keyframes, "That count as independent")
      ->check(positive_number())
      ->capture_default_str();
  verb->add_option("-o,--out", options->out, "plan.json")->required();
  add_parameter_options(*verb, options->axes);
  add_replay_options(*verb, options->replay);
  add_seed_option(*verb, options->common);
  add_device_option(*verb, options->common);
  add_common_options(*verb, options->common);
  verb->footer("Example:\n  flash-sysid plan lift --asset towel.json -o plan.json");
  verb->callback(
      [verb, options, &action] { action = [verb, options] { return run_plan(*verb, *options); }; });
}

}  // namespace flash
