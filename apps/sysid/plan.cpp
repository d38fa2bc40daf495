#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "apps/command_line/command_line.h"
#include "apps/command_line/option_checks.h"
#include "apps/sysid/options.h"
#include "apps/sysid/search_inputs.h"
#include "apps/sysid/verbs.h"
#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/json_reader.h"
#include "data/files/text.h"
#include "data/files/writable.h"
#include "sysid/design/rank_experiments.h"
#include "sysid/design/usual_ranges.h"
#include "sysid/design/virtual_experiment.h"
#include "sysid/emulate/fingerprint.h"
#include "sysid/emulate/search_warnings.h"
#include "sysid/replay/memory_estimate.h"
#include "sysid/report/parameter_label.h"
#include "sysid/report/plan_start.h"

namespace flash {
namespace {

struct PlanOptions {
  CommonOptions common;
  ReplayOptions replay;
  std::vector<std::string> recordings;
  std::string asset;
  std::vector<std::pair<std::string, std::string>> axes;
  std::vector<std::string> holds;
  std::string run;  // of a search: what it left to be known
  double error = 1e-3;
  double keyframes = 10;
  std::string out;
};

// The parameters asked about; without options the four of a cloth, stiffnesses about those of the asset.
std::vector<sysid::Axis> axes_of(const PlanOptions& options, const sysid::MaterialBase& base,
                                 const std::vector<sysid::Axis>& held) {
  std::vector<sysid::Axis> axes;
  for (const auto& [name, text] : options.axes) axes.push_back(parse_searched(name, text));
  if (!axes.empty()) return axes;
  axes = sysid::usual_ranges(base);
  std::erase_if(axes, [&](const sysid::Axis& axis) {
    return std::any_of(held.begin(), held.end(),
                       [&](const sysid::Axis& hold) { return hold.name == axis.name; });
  });
  return axes;
}

// The parameters that a plan tells of.
std::vector<sysid::Axis> planned_axes(const sysid::PlanSettings& settings) {
  std::vector<sysid::Axis> axes = settings.grid.axes;
  if (settings.known) std::erase_if(axes, [](const sysid::Axis& axis) { return axis.values.size() < 2; });
  return axes;
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
                                 const sysid::PlanSettings& settings) {
  nlohmann::ordered_json json;
  json["schema"] = "flash-sysid-plan/1";
  if (settings.known) {
    json["noise_m"] = settings.known->misfit.noise;
    json["misfit_m"] = settings.known->misfit.size;
  } else {
    json["error_m"] = settings.error;
    json["keyframes"] = settings.keyframes;
  }
  for (const sysid::PlannedExperiment& experiment : experiments)
    json["bits"][experiment.name] = experiment.bits;
  const std::vector<sysid::Axis> axes = planned_axes(settings);
  const std::vector<double> before = sysid::spread_before(settings);
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

// A search brings its own parameters, and what it held.
void check_options(const CLI::App& verb, const PlanOptions& options) {
  expect_ending("--out", options.out, {".json"});
  if (options.run.empty()) return;
  const std::string beside = ": found it beside --run, whose search has its own, expected one of the two";
  if (!options.axes.empty()) throw data::InputError(sysid::option_of(options.axes.front().first) + beside);
  if (!options.holds.empty()) throw data::InputError("--hold" + beside);
  for (const std::string name : {"--error", "--keyframes"})
    if (verb.count(name) > 0) throw data::InputError(name + beside);
}

// What a search left to be known is of its object.
void check_asset(const PlanOptions& options, const data::Recording& recording,
                 const sysid::ReplaySettings& settings, const sysid::GridSettings& grid) {
  const std::vector<sysid::Replay> replays = {sysid::make_replay(recording, settings)};
  for (const std::string& line : unlike_the_asset_of(options.run, sysid::fingerprint(replays, grid)))
    warn("--asset: " + line);
}

int run_plan(const CLI::App& verb, const PlanOptions& options) {
  stop_on_signals();
  check_options(verb, options);
  const int threads = thread_count(options.common);
  std::vector<data::Recording> recordings = load_recordings(options.recordings, options.common);
  for (const data::Recording& recording : recordings)
    if (recording.is_solid())
      throw data::input_error(recording.source, "object.mesh",
                              "found a solid, expected a sheet: plan knows experiments with sheets alone");
  std::optional<sysid::SearchFolder> found;
  if (!options.run.empty()) found = sysid::load_search_folder(options.run);
  const data::Asset asset = load_asset_for(
      options.asset.empty() && found ? found->summary.asset : options.asset, recordings.front());
  check_kind(asset, recordings.front());
  check_options(options.replay, asset, recordings);
  const sysid::ReplaySettings replay = replay_settings(verb, options.replay, threads);
  std::vector<sysid::ReplaySettings> simulated(recordings.size(), replay);
  if (found && replay.mesh.empty())
    for (std::size_t r = 0; r < recordings.size(); ++r)
      take_mesh(found->summary, options.run, recordings[r], simulated[r]);
  if (!simulated.front().mesh.empty() || simulated.front().cell_scale < 1) {
    sysid::ReplaySettings plain = simulated.front();
    plain.grasp_cell = 0;  // what is simulated is graded towards grasps of its own
    recordings.front() = sysid::make_replay(recordings.front(), plain).recording;
  }
  std::vector<std::string> notices;
  sysid::PlanSettings settings;
  const std::vector<sysid::Axis> held = parse_values(options.holds);
  settings.grid.base = material_base(asset, sim::make_sheet(recordings.front().mesh), notices, held);
  settings.grid.score = score_settings(options.replay);
  settings.error = options.error;
  settings.keyframes = options.keyframes;
  if (options.run.empty()) {
    settings.grid.axes = axes_of(options, settings.grid.base, held);
    settings.grid.fixed = held;
    std::vector<sysid::Axis> all = settings.grid.axes;
    all.insert(all.end(), held.begin(), held.end());
    sysid::check_axes(all, settings.grid.base);
    settings.at = sysid::values_in_range(settings.grid.base, settings.grid.axes);
  } else {
    if (found->summary.samples.rows() < 2 || found->summary.recordings.empty())
      throw data::InputError(options.run +
                             ": found no posterior, expected a search that came to an estimate");
    if (found->summary.exit_code == exit_unusable)
      warn(options.run + " is a search that cannot be used: " + found->summary.warnings.front());
    sysid::start_plan(*found, settings);
  }
  data::check_file_free(options.out, options.common.force);
  if (found && !options.asset.empty()) check_asset(options, recordings.front(), replay, settings.grid);
  // Refused before anything is simulated.
  sysid::steps_in(sysid::longest_virtual_experiment, options.replay.time_step);

  const data::SheetMaterial material = sysid::candidate_at(settings.at, settings.grid).material;
  // Of a search: it keeps what is simulated there.
  std::optional<sysid::MotionStore> store;
  if (!options.run.empty()) {
    const std::string motions = (std::filesystem::path(options.run) / "motions").string();
    check_keeps_motions("--run", motions);
    store.emplace(motions);
  }
  const sysid::MotionStore* const kept = store ? &*store : nullptr;
  std::vector<sysid::PlannedExperiment> experiments;
  for (std::size_t r = 0; r < recordings.size(); ++r) {
    const std::vector<sysid::Replay> replays = {
        sysid::make_replay(data::load_recording(recordings[r].source), simulated[r])};
    tell_known_before(options.common, replays, sysid::held_at(settings.at, settings.grid),
                      sysid::Coming::estimate);
    const std::size_t batch = 2 * settings.at.size() + 1;
    sysid::check_job(replays, static_cast<double>(batch), sysid::estimate_batch(replays, batch));
    experiments.push_back(sysid::plan_experiment(recordings[r].name, replays, settings, kept));
  }
  for (const char* kind : sysid::virtual_experiments) {
    say(options.common, std::string("simulating ") + kind);
    const sysid::Replay made = sysid::virtual_experiment(
        kind, recordings.front(), material,
        {replay.solver, threads, options.common.seed, replay.clamp_slopes, replay.self_contact});
    experiments.push_back(sysid::plan_experiment(kind, {made}, settings, kept));
  }
  std::stable_sort(experiments.begin(), experiments.end(),
                   [](const auto& one, const auto& other) { return one.bits > other.bits; });
  const std::vector<sysid::Axis> axes = planned_axes(settings);
  const std::string text = data::format_json(plan_json(experiments, settings));
  end_after_signal();
  data::write_atomically(options.out, text);
  if (options.common.json) {
    std::cout << text;
    return exit_done;
  }
  std::printf("%-16s", "experiment");
  for (const sysid::Axis& axis : axes) std::printf(" %12s", axis.name.c_str());
  std::printf(" %8s\n%-16s", "bits", settings.known ? "(as known)" : "(range alone)");
  const std::vector<double> before = sysid::spread_before(settings);
  for (std::size_t k = 0; k < axes.size(); ++k) std::printf(" %12s", spread_text(axes[k], before[k]).c_str());
  for (const sysid::PlannedExperiment& experiment : experiments) {
    std::printf("\n%-16s", experiment.name.c_str());
    for (std::size_t k = 0; k < axes.size(); ++k)
      std::printf(" %12s", spread_text(axes[k], experiment.spread[k]).c_str());
    std::printf(" %8.1f", experiment.bits);
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
  verb->add_option("--asset", options->asset,
                   "The object; without one, that of --run, or the asset the recording names");
  verb->add_option("--run", options->run,
                   "Folder of a search: its parameters, what it left unknown of them, its noise and misfit");
  verb->add_option("--error", options->error, "Distance by which model and sheet differ in a keyframe [m]")
      ->check(positive_number())
      ->capture_default_str();
  verb->add_option("--keyframes", options->keyframes, "Number of independent keyframes assumed")
      ->check(positive_number())
      ->capture_default_str();
  verb->add_option("-o,--out", options->out, "plan.json")->required();
  add_parameter_options(*verb, options->axes);
  add_hold_option(*verb, options->holds,
                  "A value in place of the asset's, as bending=1e-4; it is not asked about");
  add_replay_options(*verb, options->replay);
  add_seed_option(*verb, options->common);
  add_cpu_option(*verb, options->common);
  add_common_options(*verb, options->common);
  verb->footer("Example:\n  flash-sysid plan lift --asset towel.json -o plan.json");
  verb->callback(
      [verb, options, &action] { action = [verb, options] { return run_plan(*verb, *options); }; });
}

}  // namespace flash
