#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <memory>

#include "apps/command_line/command_line.h"
#include "apps/command_line/option_checks.h"
#include "apps/sysid/options.h"
#include "apps/sysid/search.h"
#include "apps/sysid/shard_option.h"
#include "apps/sysid/verbs.h"
#include "data/files/error.h"
#include "data/files/text.h"
#include "data/files/writable.h"
#include "sysid/emulate/fingerprint.h"
#include "sysid/emulate/search_memory.h"
#include "sysid/replay/half_cell.h"

namespace flash {
namespace {

namespace fs = std::filesystem;

struct GridOptions {
  CommonOptions common;
  ReplayOptions replay;
  std::vector<std::string> recordings;
  std::string asset;
  std::vector<std::pair<std::string, std::string>> axes;
  std::vector<std::string> holds;
  int envs = 64;
  double repeatability = 0;  ///< [m]; 0: the residual stands for it
  bool no_solver_check = false;
  bool no_horizon = false;
  bool no_plan = false;
  double max_hours = 0;   ///< 0: without end
  std::string posterior;  ///< empty: by the number of parameters
  bool resume = false;
  std::string rollouts;
  ShardOptions shard;
  std::vector<std::string> map;
  std::string out;
};

std::vector<std::string> names_of(const std::vector<data::Recording>& recordings) {
  std::vector<std::string> names;
  for (const data::Recording& recording : recordings) names.push_back(recording.name);
  return names;
}

/// Of a hidden option, whose name the parser would leave out of what it says.
sysid::PosteriorMethod posterior_method(const std::string& name) {
  if (name.empty()) return sysid::PosteriorMethod::by_count;
  if (name == "grids") return sysid::PosteriorMethod::grids;
  if (name == "sampling") return sysid::PosteriorMethod::sampling;
  throw data::InputError("--posterior: found " + name + ", expected grids or sampling");
}

sysid::GridSettings grid_settings(const GridOptions& options, const sysid::MaterialBase& base, int threads) {
  sysid::GridSettings settings;
  settings.base = base;
  settings.score = score_settings(options.replay);
  settings.envs = options.envs;
  settings.threads = threads;
  settings.rollouts =
      options.rollouts.empty() ? (fs::path(options.out) / "motions").string() : options.rollouts;
  for (const auto& [name, text] : options.axes) settings.axes.push_back(parse_searched(name, text));
  if (settings.axes.empty())
    throw data::InputError("no parameter to search; add one, as --bending 1e-6:1e-3:8:log");
  sysid::add_holds(parse_holds(options.holds), settings);
  std::vector<sysid::Axis> all = settings.axes;
  all.insert(all.end(), settings.fixed.begin(), settings.fixed.end());
  sysid::check_axes(all, base);
  return settings;
}

void check_options(const GridOptions& options) {
  if (options.resume && options.common.force)
    throw data::InputError(
        "--resume: found --force beside it, which removes the results, expected one of the two");
  if (!options.shard.shard.empty() && options.common.force)
    throw data::InputError(
        "--shard: found --force beside it, which removes what others wrote; expected --resume");
  for (const std::string& name : options.map)
    if (std::none_of(options.axes.begin(), options.axes.end(),
                     [&](const auto& axis) { return axis.first == name; }))
      throw data::InputError("--map: found " + name + ", expected a parameter that is searched");
  if (options.map.size() == 2 && options.map[0] == options.map[1])
    throw data::InputError("--map: found " + options.map[0] + " twice, expected two parameters");
  if (!options.rollouts.empty()) check_keeps_motions("--rollouts", options.rollouts);
}

/// A search that goes on keeps the order of its recordings: its tables stand in it, and the first one names
/// the asset. Others come last.
void order_as(const std::vector<std::string>& names, std::vector<data::Recording>& recordings) {
  const auto place = [&](const data::Recording& recording) {
    return std::find(names.begin(), names.end(), recording.name);
  };
  std::stable_sort(recordings.begin(), recordings.end(),
                   [&](const auto& a, const auto& b) { return place(a) < place(b); });
}

std::vector<sysid::Replay> make_replays(const std::vector<data::Recording>& recordings,
                                        const sysid::ReplaySettings& settings, const CommonOptions& options) {
  std::vector<sysid::Replay> replays;
  for (const data::Recording& recording : recordings) {
    replays.push_back(sysid::make_replay(recording, settings));
    warn_of_seams(replays.back().recording);
    if (!options.verbose) continue;
    for (const std::string& notice : recording.notices) say(options, recording.name + ": " + notice);
    for (const std::string& notice : replays.back().notices) say(options, recording.name + ": " + notice);
  }
  return replays;
}

/// That the shares that are there are of this search: else each would wait for the others in vain.
void expect_shares_of(const sysid::Fingerprint& search, const std::string& out) {
  if (const auto other = sysid::other_search(search, sysid::grid_files(out)))
    throw data::InputError("--shard: " + other->file + " is of another search: " + other->difference +
                           "; name another folder, repeat the first command, or remove " +
                           fs::path(other->file).parent_path().string() + " where that was a slip");
}

int run_grid(const CLI::App& verb, const GridOptions& options) {
  const sysid::PosteriorMethod posterior = posterior_method(options.posterior);
  stop_on_signals();
  if (options.max_hours > 0) stop_after(options.max_hours);
  check_options(options);
  sysid::Shard shard = shard_of(options.shard);
  shard.told = [](const std::string& what) { warn(what); };
  const std::string folder = folder_of_shard(options.out, shard);
  const auto begin = std::chrono::steady_clock::now();
  const std::string grid_file = (fs::path(folder) / "grid.json").string();
  const bool goes_on = options.resume && fs::exists(grid_file);
  std::vector<data::Recording> recordings = load_recordings(options.recordings, options.common);
  if (goes_on) order_as(sysid::load_grid_file(grid_file).recordings, recordings);
  const data::Asset asset = load_asset_for(options.asset, recordings.front());
  for (const data::Recording& recording : recordings) check_kind(asset, recording);
  check_options(options.replay, asset, recordings);
  const int threads = thread_count(options.common);
  sysid::ReplaySettings simulated = replay_settings(verb, options.replay, threads);
  simulated.element_order = asset.element_order;
  place_simulation(options.common, asset, simulated);
  std::vector<sysid::Replay> replays = make_replays(recordings, simulated, options.common);

  std::vector<std::string> notices;
  sysid::GridSettings settings = grid_settings(
      options, material_base(asset, replays.front().sheet(), notices, axes_of(parse_holds(options.holds))),
      threads);
  settings.shard = shard;
  if (simulated.self_contact) sysid::on_half_the_cell(replays);  // refused before anything is simulated
  std::vector<sysid::ReplayCandidate> candidates;
  for (const std::vector<double>& values : sysid::cartesian_product(settings.axes))
    candidates.push_back(sysid::candidate_at(values, settings));
  place_candidates(options.common, candidates, replays);
  sysid::check_grasp_axes(settings.axes, replays);
  sysid::check_grasp_axes(settings.fixed, replays);
  if (!options.no_solver_check)  // which halves the step
    for (const sysid::Replay& replay : replays)
      sysid::steps_in(2.0 * replay.steps * options.replay.time_step, options.replay.time_step);
  const sysid::MemoryEstimate memory = sysid::estimate_memory(replays, settings, !options.no_solver_check);
  sysid::check_job(replays, sysid::count_candidates(settings.axes), memory);
  end_after_signal();
  sysid::Fingerprint print = sysid::fingerprint(replays, settings);
  if (!options.posterior.empty()) print["posterior (--posterior)"] = options.posterior;
  if (shard.count > 1) expect_shares_of(print, options.out);
  sysid::ResultsStore store(folder, settings.axes, names_of(recordings), print,
                            options.resume         ? sysid::Existing::resume
                            : options.common.force ? sysid::Existing::replace
                                                   : sysid::Existing::refuse,
                            shard.count > 1 ? sysid::Writers::several : sysid::Writers::one);
  if (options.resume && !goes_on) say(options.common, folder + ": holds no search yet, --resume begins one");
  for (const std::string& notice : notices) say(options.common, notice);
  tell_known_before(options.common, replays, settings,
                    options.no_solver_check ? sysid::Coming::search : sysid::Coming::answer);
  say(options.common,
      data::format_count(static_cast<std::size_t>(sysid::count_candidates(settings.axes))) + " candidates, " +
          data::format_count(static_cast<std::size_t>(replays.front().sheet().rest.vertices.rows())) +
          " vertices, " + std::to_string(threads) + " threads, about " +
          data::format_count(static_cast<std::size_t>(std::ceil(memory.total() / 1e6))) +
          " MB of memory, on the " +
          (replays.front().settings.device == sim::Device::cuda ? "CUDA device" : "CPU"));
  sysid::AnswerSettings asked;
  if (options.repeatability > 0) asked.repeatability = options.repeatability;
  asked.horizon = !options.no_horizon;
  asked.solver_check = !options.no_solver_check;
  asked.posterior = posterior;
  Search search{asset, std::move(replays), settings, asked, options.map, options.out, begin};
  search.plan = !options.no_plan;
  return run_search(search, store, options.common);
}

}  // namespace

void add_grid_verb(CLI::App& app, Action& action) {
  const auto options = std::make_shared<GridOptions>();
  CLI::App* verb =
      app.add_subcommand("grid", "Search a grid of parameters: replay each, score it against the recordings");
  verb->add_option("recording", options->recordings, "Folders with recording.json")->required();
  verb->add_option("--asset", options->asset, "The object; without one, the asset the recording names");
  verb->add_option("-o,--out", options->out, "Folder for results.csv, summary.json, report.html")->required();
  add_hold_option(
      *verb, options->holds,
      "Hold a parameter, as friction=0.3 where that is assumed, friction=0.3:measured where it is known");
  verb->add_option("--envs", options->envs, "Candidates that are simulated at a time")
      ->check(whole_number(1, 100000))
      ->capture_default_str();
  verb->add_option("--repeatability", options->repeatability, "Trial-to-trial distance of a keyframe [m]")
      ->check(positive_number());
  add_list_option(*verb, "--map", options->map,
                  "The two parameters of the report's score map, as bending,friction", {}, 2);
  verb->add_flag("--no-solver-check", options->no_solver_check,
                 "Do not solve the estimate again under finer settings");
  verb->add_flag("--no-horizon", options->no_horizon, "Keep keyframes beyond the predictable");
  verb->add_flag("--no-plan", options->no_plan, "Do not say what to record next, which takes simulations");
  verb->add_option("--posterior", options->posterior, "Posteriors on grids, or by importance sampling")
      ->group("");
  verb->add_option("--rollouts", options->rollouts,
                   "Folder that keeps the motions, for several searches; without it, motions/ of the run");
  verb->add_flag("--resume", options->resume, "Go on with the results in the folder");
  add_max_hours_option(*verb, options->max_hours);
  add_shard_options(*verb, options->shard);
  add_parameter_options(*verb, options->axes);
  add_replay_options(*verb, options->replay);
  add_device_option(*verb, options->common);
  add_common_options(*verb, options->common);
  verb->footer(
      "Example:\n"
      "  flash-sysid grid lift_a --asset towel.json --young 1e3:1e6:16:log --bending 1e-6:1e-3:8:log \\\n"
      "    --hold friction=0.3:measured --envs 64 -o run");
  verb->callback(
      [verb, options, &action] { action = [verb, options] { return run_grid(*verb, *options); }; });
}

}  // namespace flash
