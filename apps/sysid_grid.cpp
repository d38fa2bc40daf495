#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>

#include "apps/command_line.h"
#include "apps/sysid_options.h"
#include "apps/sysid_verbs.h"
#include "data/error.h"
#include "data/text.h"
#include "sysid/next_steps.h"
#include "sysid/overlay.h"
#include "sysid/parameter_label.h"
#include "sysid/predictability.h"
#include "sysid/report.h"
#include "sysid/solver_check.h"
#include "sysid/summarize.h"

namespace flash {
namespace {

namespace fs = std::filesystem;

struct GridOptions {
  CommonOptions common;
  ReplayOptions replay;
  std::vector<std::string> recordings;
  std::string asset;
  std::vector<std::pair<std::string, std::string>> axes;
  std::vector<std::string> fixed;
  int envs = 64;
  double repeatability = 0;  ///< [m]; 0: the residual stands for it
  bool no_solver_check = false;
  bool no_horizon = false;
  bool resume = false;
  std::vector<std::string> map;
  std::string out;
};

std::vector<sysid::Axis> parse_axes(const GridOptions& options) {
  std::vector<sysid::Axis> axes;
  for (const auto& [name, text] : options.axes) axes.push_back(sysid::parse_axis(name, text));
  if (axes.empty()) throw data::InputError("no parameter to search; add one, as --bending 1e-6:1e-3:8:log");
  return axes;
}

// The order the loaded results have, so that a resumed search reads its own folder.
void clear_results(const std::string& folder) {
  for (const char* file :
       {"results.csv", "registrations.csv", "keyframes.csv", "grid.json", "summary.json", "report.html"})
    fs::remove(fs::path(folder) / file);
  fs::remove_all(fs::path(folder) / "best");
}

std::string value_text(const sysid::ParameterFinding& finding, const std::string& unit) {
  const auto text = [&](double value) {
    return data::format_short(value) + (unit.empty() ? "" : " " + unit);
  };
  switch (finding.identifiable) {
    case sysid::Identifiable::yes:
      return text(*finding.estimate) + "  (95 %: " + data::format_short((*finding.interval95)[0]) + " to " +
             data::format_short((*finding.interval95)[1]) + ")";
    case sysid::Identifiable::lower_bound:
      return "at least " + text((*finding.interval95)[0]);
    case sysid::Identifiable::upper_bound:
      return "at most " + text((*finding.interval95)[1]);
    case sysid::Identifiable::no:
      break;
  }
  return "not identifiable from the recordings";
}

void print_answer(const sysid::Summary& summary, const std::string& out) {
  const bool has_thickness = summary.settings.count("thickness_m") > 0;
  for (const sysid::ParameterFinding& finding : summary.parameters) {
    const sysid::ParameterLabel label = sysid::parameter_label(finding.name, has_thickness);
    std::printf("%-16s %s\n", finding.name.c_str(), value_text(finding, label.unit).c_str());
  }
  for (const sysid::SummaryRecording& recording : summary.recordings)
    std::printf("%-16s %.2f mm from the observed points, offset %.1f %.1f %.1f mm, clock %.0f ms\n",
                recording.name.c_str(), 1000 * recording.score, 1000 * recording.offset.x(),
                1000 * recording.offset.y(), 1000 * recording.offset.z(), 1000 * recording.time_offset);
  for (const sysid::SolverCheck& check : summary.solver_check)
    std::printf("%-24s moves the surface by %.2f mm, the score to %.2f mm\n", check.what.c_str(),
                1000 * check.surface_change_m, 1000 * check.score);
  std::printf("%s\n%s\n", (fs::path(out) / "summary.json").c_str(), (fs::path(out) / "report.html").c_str());
}

std::vector<sysid::Replay> make_replays(const std::vector<data::Recording>& recordings,
                                        const sysid::ReplaySettings& settings, const CommonOptions& options) {
  std::vector<sysid::Replay> replays;
  for (const data::Recording& recording : recordings) {
    replays.push_back(sysid::make_replay(recording, settings));
    if (!options.verbose) continue;
    for (const std::string& notice : recording.notices) say(options, recording.name + ": " + notice);
    for (const std::string& notice : replays.back().notices) say(options, recording.name + ": " + notice);
  }
  return replays;
}

int run_grid(const CLI::App& verb, const GridOptions& options) {
  const auto begin = std::chrono::steady_clock::now();
  const std::string device = choose_device(options.common);
  const int threads = thread_count(options.common);
  std::vector<data::Recording> recordings;
  std::vector<std::string> names;
  for (const std::string& path : options.recordings) {
    recordings.push_back(data::load_recording(path));
    names.push_back(recordings.back().name);
  }
  const data::Asset asset = load_asset_for(options.asset, recordings.front());
  const std::vector<sysid::Replay> replays =
      make_replays(recordings, replay_settings(verb, options.replay, threads), options.common);

  sysid::GridSettings settings;
  settings.base = material_base(asset, replays.front().sheet.rest, options.common);
  settings.axes = parse_axes(options);
  for (const std::string& assignment : options.fixed)
    settings.fixed.push_back(sysid::parse_fixed(assignment));
  settings.score = score_settings(options.replay);
  settings.envs = options.envs;
  settings.threads = threads;
  std::vector<sysid::Axis> all = settings.axes;
  all.insert(all.end(), settings.fixed.begin(), settings.fixed.end());
  sysid::check_axes(all, settings.base.material.constitutive);

  if (options.common.force && !options.resume) clear_results(options.out);
  sysid::ResultsStore store(options.out, settings.axes, names, sysid::fingerprint(replays, settings),
                            options.resume);
  say(options.common,
      data::format_count(sysid::cartesian_product(settings.axes).size()) + " candidates, " +
          data::format_count(static_cast<std::size_t>(replays.front().sheet.rest.vertices.rows())) +
          " vertices, " + std::to_string(threads) + " threads");
  bool complete = false;
  {
    ProgressLine line(options.common);
    complete = sysid::grid_search(
        replays, settings, store, [&](const sysid::Progress& p) { line.show(p); }, &stop_on_interrupt());
  }

  sysid::GridResults results = store.results();
  const std::optional<double> repeatability =
      options.repeatability > 0 ? std::optional(options.repeatability) : std::nullopt;
  sysid::GridVerdict verdict = sysid::profile_grid(results, repeatability);
  std::vector<std::optional<double>> horizons(replays.size());
  if (complete && !options.no_horizon && verdict.best >= 0) {
    const sysid::ReplayCandidate best = sysid::candidate_of(results.candidates[verdict.best], settings);
    for (std::size_t r = 0; r < replays.size(); ++r)
      horizons[r] = sysid::predictability_horizon(replays[r], best);
    sysid::drop_beyond_horizons(horizons, results);
    verdict = sysid::profile_grid(results, repeatability);
  }

  sysid::Summary summary = sysid::summarize(results, verdict, replays, settings);
  summary.asset = fs::absolute(asset.source).lexically_normal().string();
  summary.device = device;
  std::vector<sysid::Overlay> overlays;
  if (verdict.best >= 0) {
    const sysid::CandidateResult& best = results.candidates[static_cast<std::size_t>(verdict.best)];
    const sysid::ReplayCandidate candidate = sysid::candidate_of(best, settings);
    if (complete && !options.no_solver_check)
      summary.solver_check = sysid::check_solver(replays, candidate, settings.score);
    for (std::size_t r = 0; r < replays.size(); ++r) {
      summary.recordings[r].horizon_s = horizons[r];
      const sysid::ReplayResult motion = std::move(sysid::run(replays[r], {candidate}).front());
      overlays.push_back(sysid::make_overlay(replays[r], motion.motion, best.recordings[r]));
      sysid::save_overlay(overlays.back(), (fs::path(options.out) / "best" / names[r]).string());
    }
  }
  summary.wall_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  sysid::save_summary(summary, (fs::path(options.out) / "summary.json").string());
  sysid::ReportSettings report;
  for (std::size_t k = 0; k < options.map.size() && k < 2; ++k) report.map_axes[k] = options.map[k];
  sysid::write_report(summary, results, overlays, report, (fs::path(options.out) / "report.html").string());

  for (const std::string& warning : summary.warnings) warn(warning);
  if (options.common.json) {
    std::cout << sysid::summary_text(summary);
  } else {
    print_answer(summary, options.out);
  }
  return complete ? summary.exit_code : static_cast<int>(exit_failed);
}

}  // namespace

void add_grid_verb(CLI::App& app, Action& action) {
  const auto options = std::make_shared<GridOptions>();
  CLI::App* verb =
      app.add_subcommand("grid", "Search a grid of parameters: replay each, score it against the recordings");
  verb->add_option("recording", options->recordings, "Folders with recording.json")->required();
  verb->add_option("--asset", options->asset, "The object; without one, the asset the recording names");
  verb->add_option("-o,--out", options->out, "Folder for results.csv, summary.json, report.html")->required();
  verb->add_option("--fix", options->fixed, "A measured constant, as friction=0.3; carried into the asset")
      ->expected(1)
      ->allow_extra_args(false);
  verb->add_option("--envs", options->envs, "Candidates a batch")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  verb->add_option("--repeatability", options->repeatability, "Trial-to-trial distance of a keyframe [m]")
      ->check(CLI::PositiveNumber);
  verb->add_option("--map", options->map, "The two parameters of the report's score map")
      ->delimiter(',')
      ->expected(2);
  verb->add_flag("--no-solver-check", options->no_solver_check,
                 "Do not solve the best candidate again under finer settings");
  verb->add_flag("--no-horizon", options->no_horizon, "Keep keyframes beyond the predictable");
  verb->add_flag("--resume", options->resume, "Go on with the results in the folder");
  add_parameter_options(*verb, options->axes);
  add_replay_options(*verb, options->replay);
  add_common_options(*verb, options->common);
  verb->footer(
      "Example:\n"
      "  flash-sysid grid lift_a --asset towel.json --young 1e3:1e6:16:log --bending 1e-6:1e-3:8:log \\\n"
      "    --fix friction=0.3 --envs 64 -o run");
  verb->callback(
      [verb, options, &action] { action = [verb, options] { return run_grid(*verb, *options); }; });
}

}  // namespace flash
