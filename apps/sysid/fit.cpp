#include <algorithm>
#include <filesystem>
#include <memory>

#include "apps/command_line/command_line.h"
#include "apps/command_line/option_checks.h"
#include "apps/sysid/options.h"
#include "apps/sysid/search.h"
#include "apps/sysid/search_inputs.h"
#include "apps/sysid/verbs.h"
#include "data/files/error.h"
#include "data/files/text.h"
#include "data/files/writable.h"
#include "sysid/emulate/fingerprint.h"
#include "sysid/emulate/search_memory.h"
#include "sysid/emulate/search_warnings.h"
#include "sysid/replay/half_cell.h"
#include "sysid/report/fit_start.h"

namespace flash {
namespace {

namespace fs = std::filesystem;

struct FitOptions {
  CommonOptions common;
  ReplayOptions replay;
  std::vector<std::string> recordings;
  std::string asset;
  std::string start;
  std::vector<std::string> holds;
  double repeatability = 0;  ///< [m]; 0: not given
  bool no_solver_check = false;
  bool no_horizon = false;
  bool no_plan = false;
  double max_hours = 0;  ///< 0: without end
  bool resume = false;
  std::string rollouts;
  std::string out;
};

// Axes of one value, and constants.
std::vector<sysid::Axis> held_axes(const sysid::GridSettings& grid) {
  std::vector<sysid::Axis> held = grid.fixed;
  for (const sysid::Axis& axis : grid.axes)
    if (axis.values.size() == 1) held.push_back(axis);
  return held;
}

// What differs from the search, whose grasps, times and tolerances are not taken over by themselves.
std::vector<std::string> other_settings(const std::string& start, const sysid::Fingerprint& print) {
  const sysid::GridFile search = sysid::load_grid_file((fs::path(start) / "grid.json").string());
  std::vector<std::string> lines;
  if (!search.fingerprint) return lines;
  for (const char* name : {"self_contact_m", "layer_friction"}) {
    const auto of = [&](const sysid::Fingerprint& settings) {
      return settings.contains(name) ? settings.at(name) : "none";
    };
    if (of(print) != of(*search.fingerprint))
      lines.push_back(name + (": found " + of(print)) + ", the search had " + of(*search.fingerprint));
  }
  for (const auto& [name, value] : *search.fingerprint) {
    const auto here = print.find(name);
    if (here == print.end() || here->second == value || name.starts_with("ax") || name.starts_with("fixed") ||
        name == "self_contact_m" || name == "layer_friction")
      continue;
    // Data stand there as hashes.
    lines.push_back(
        name.starts_with("recording")
            ? name + ": not those of the search (--grasp-shape, --from and the like are not taken over)"
            : name + ": found " + here->second + ", the search had " + value);
  }
  return lines;
}

// On the cells that a search began with, where its answer is of smaller ones.
std::vector<sysid::Replay> on_first_cells(const std::vector<data::Recording>& recordings,
                                          const std::vector<sysid::Replay>& replays) {
  std::vector<sysid::Replay> first;
  for (std::size_t r = 0; r < replays.size(); ++r) {
    sysid::ReplaySettings settings = replays[r].settings;
    settings.cell_scale = 1;
    first.push_back(replays[r].settings.cell_scale < 1 ? sysid::make_replay(recordings[r], settings)
                                                       : replays[r]);
  }
  return first;
}

// The folder is free, or --resume goes on with what it holds.
void check_out(const FitOptions& options) {
  if (options.resume && options.common.force)
    throw data::InputError(
        "--resume: found --force beside it, which removes the results, expected one of the two");
  if (options.resume) return;
  try {
    data::check_folder_free(options.out, options.common.force);
  } catch (const data::InputError& error) {
    if (!fs::exists(fs::path(options.out) / "grid.json")) throw;
    throw data::InputError(options.out +
                           ": holds results already; go on with --resume, or name another folder");
  }
}

int run_fit(const CLI::App& verb, const FitOptions& options) {
  stop_on_signals();
  if (options.max_hours > 0) stop_after(options.max_hours);
  check_out(options);
  const auto begin = std::chrono::steady_clock::now();
  const std::vector<data::Recording> recordings = load_recordings(options.recordings, options.common);
  const sysid::SearchFolder found = sysid::load_search_folder(options.start);
  const data::Asset asset =
      load_asset_for(options.asset.empty() ? found.summary.asset : options.asset, recordings.front());
  for (const data::Recording& recording : recordings) check_kind(asset, recording);
  check_options(options.replay, asset, recordings);
  sysid::FitStart start = sysid::fit_start(found, options.holds);
  sysid::GridSettings& grid = start.grid;
  grid.score = score_settings(options.replay);
  const int threads = thread_count(options.common);
  grid.threads = threads;
  sysid::ReplaySettings replay = replay_settings(verb, options.replay, threads);
  replay.element_order = asset.element_order;
  place_simulation(options.common, asset, replay);
  std::vector<sysid::Replay> replays;
  std::vector<std::string> names;
  for (const data::Recording& recording : recordings) {
    sysid::ReplaySettings here = replay;
    if (replay.mesh.empty()) take_mesh(found.summary, options.start, recording, here);
    replays.push_back(sysid::make_replay(recording, here));
    names.push_back(recording.name);
  }
  if (replay.self_contact) sysid::on_half_the_cell(replays);  // refused before anything is simulated
  std::vector<std::string> notices;
  grid.base = material_base(asset, replays.front().sheet(), notices, held_axes(grid));
  place_candidates(options.common, {sysid::candidate_at(start.values, grid)}, replays);
  // One store of motions for the search and what goes on from it.
  grid.rollouts =
      options.rollouts.empty() ? (fs::path(options.start) / "motions").string() : options.rollouts;
  check_keeps_motions(options.rollouts.empty() ? "--start" : "--rollouts", grid.rollouts);
  sysid::AnswerSettings asked;
  if (options.repeatability > 0) asked.repeatability = options.repeatability;
  asked.horizon = !options.no_horizon;
  asked.solver_check = !options.no_solver_check;
  if (asked.solver_check)  // which halves the step
    for (const sysid::Replay& each : replays)
      sysid::steps_in(2.0 * each.steps * options.replay.time_step, options.replay.time_step);
  sysid::check_job(replays, sysid::count_candidates(grid.axes),
                   sysid::estimate_memory(replays, grid, asked.solver_check));
  for (const std::string& notice : notices) say(options.common, notice);
  tell_known_before(options.common, replays, sysid::held_at(start.values, grid),
                    asked.solver_check ? sysid::Coming::answer : sysid::Coming::search);
  // Before the long part. Axes, which that part finds, are not compared.
  for (const std::string& line :
       other_settings(options.start, sysid::fingerprint(on_first_cells(recordings, replays), grid)))
    warn(line);
  asked.ranges = grid.axes;
  const std::string grid_file = (fs::path(options.out) / "grid.json").string();
  double candidate_seconds = 0;
  if (options.resume && fs::exists(grid_file)) {
    grid.axes = sysid::load_grid_file(grid_file).axes;  // the fingerprint holds the rest to it
  } else {
    // The first lattice has all errors of the solution; the answer is by motions that are kept then.
    sysid::ExpectedWork expected = sysid::expected_work(replays, grid, asked.solver_check, start.values);
    expected.end += expected.first_look;
    AnswerLine line(options.common, sysid::most_design_work(grid, replays.size()), sysid::TimeLeft(expected),
                    sysid::SearchStage::candidates);
    grid.axes = sysid::design_about(
        replays, grid, start.values, start.around, asked,
        [&](const sysid::AnswerWork& done, const sysid::AnswerWork& spared) { line.take(done, spared); });
    candidate_seconds = line.time().seconds_each().value_or(0);
  }
  end_after_signal();
  const sysid::Fingerprint print = sysid::fingerprint(replays, grid);
  sysid::ResultsStore store(options.out, grid.axes, names, print,
                            options.resume         ? sysid::Existing::resume
                            : options.common.force ? sysid::Existing::replace
                                                   : sysid::Existing::refuse);
  Search search{asset, std::move(replays), grid, asked, {}, options.out, begin};
  search.plan = !options.no_plan;
  search.candidate_seconds = candidate_seconds;
  return run_search(search, store, options.common);
}

}  // namespace

void add_fit_verb(CLI::App& app, Action& action) {
  const auto options = std::make_shared<FitOptions>();
  CLI::App* verb = app.add_subcommand(
      "fit", "Go on from a search: simulate about its estimate, to the same kind of answer");
  verb->add_option("recording", options->recordings, "Folders with recording.json")->required();
  verb->add_option("--start", options->start, "Folder of the search to start from")->required();
  verb->add_option("--asset", options->asset, "The object; without one, that of the search");
  add_hold_option(
      *verb, options->holds,
      "Hold a parameter, as friction=0.3 where that is assumed, friction=0.3:measured where it is "
      "known, or poisson where the search found or held it");
  verb->add_option("--repeatability", options->repeatability, "Trial-to-trial distance of a keyframe [m]")
      ->check(positive_number());
  verb->add_flag("--no-solver-check", options->no_solver_check,
                 "Do not solve the estimate again under finer settings");
  verb->add_flag("--no-horizon", options->no_horizon, "Keep keyframes beyond the predictable");
  verb->add_flag("--no-plan", options->no_plan, "Do not say what to record next, which takes simulations");
  verb->add_option("--rollouts", options->rollouts,
                   "Folder that keeps the motions; without it, that of the search it starts from");
  verb->add_flag("--resume", options->resume, "Go on with the results in the folder");
  add_max_hours_option(*verb, options->max_hours);
  verb->add_option("-o,--out", options->out, "Folder for results.csv, summary.json, report.html")->required();
  add_replay_options(*verb, options->replay);
  add_device_option(*verb, options->common);
  add_common_options(*verb, options->common);
  verb->footer(
      "Exit code 3: the answer cannot be used, for the reason that is said.\n"
      "Example:\n  flash-sysid fit lift --start run --hold poisson -o fitted");
  verb->callback([verb, options, &action] { action = [verb, options] { return run_fit(*verb, *options); }; });
}

}  // namespace flash
