#include "apps/sysid/search.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>

#include "apps/command_line/command_line.h"
#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/json_reader.h"
#include "data/files/message_line.h"
#include "data/files/text.h"
#include "sim/device_error.h"
#include "sysid/design/rank_experiments.h"
#include "sysid/report/next_steps.h"
#include "sysid/report/overlay.h"
#include "sysid/report/parameter_label.h"
#include "sysid/report/recording_names.h"
#include "sysid/report/report.h"
#include "sysid/report/residuals_file.h"
#include "sysid/report/summarize.h"

namespace flash {
namespace {

namespace fs = std::filesystem;

double seconds_now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// `by_points`: the interval tells all, and the estimate no more than the others within it.
std::string value_text(const sysid::ParameterFinding& finding, const std::string& unit, bool by_points) {
  const auto text = [&](double value) {
    return data::format_short(value) + (unit.empty() ? "" : " " + unit);
  };
  switch (finding.identifiable) {
    case sysid::Identifiable::yes:
      if (by_points)
        return data::format_short((*finding.interval95)[0]) + " to " + text((*finding.interval95)[1]) +
               "  (95 %; likeliest of those simulated: " + data::format_short(*finding.estimate) + ")";
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

// "; the best value is the lowest searched: search lower".
std::string edge_of(const sysid::ParameterFinding& finding) {
  const std::string edge = sysid::edge_text(finding.edge);
  return edge.empty() ? "" : "; " + edge;
}

// "1.59 mm from the observed points, on cells of no size (extrapolated), 1.64 mm on the mesh of the answer".
// Of markers alone it is their own distance, not what noise stated for them makes of it beside other terms.
std::string score_text(const sysid::Summary& summary, const sysid::SummaryRecording& recording) {
  const auto setting = [&](const char* name) {
    const auto found = summary.settings.find(name);
    return found == summary.settings.end() ? std::string() : found->second;
  };
  char number[32];
  // What `replay` gives.
  std::string on_mesh;
  if (std::isfinite(recording.score_on_mesh) && recording.score_on_mesh != recording.score) {
    std::snprintf(number, sizeof number, "%.2f mm", 1000 * recording.score_on_mesh);
    on_mesh = ", " + std::string(number) + " on the mesh of the answer";
  }
  // The setting names the mesh of the first recording.
  const bool is_named =
      recording.score_on_mesh != recording.score || recording.mesh == summary.recordings.front().mesh;
  const std::string observed = setting("observed");
  const bool of_markers = observed == "markers" && recording.markers;
  std::snprintf(number, sizeof number, "%.2f mm",
                1000 * (of_markers ? recording.markers->miss : recording.score));
  return number +
         (of_markers            ? " from the markers, root mean square"
          : observed == "cloud" ? " from the observed points"
                                : " over " + observed) +
         ", on " + (is_named ? setting("score_of") : "the mesh of the answer") + on_mesh;
}

/// "12 +- 3": how much later observations were made than their times say [ms].
std::string clock_text(const sysid::SummaryRecording& recording) {
  char text[48];
  if (recording.clock && recording.clock->sd > 0)
    std::snprintf(text, sizeof text, recording.clock->sd < 1e-3 ? "%.1f +- %.1f" : "%.0f +- %.0f",
                  1000 * recording.clock->estimate, 1000 * recording.clock->sd);
  else
    std::snprintf(text, sizeof text, "%.0f", 1000 * recording.time_offset);
  return text;
}

void print_solver_check(const sysid::Summary& summary) {
  if (!summary.solver_check.empty()) std::printf("Other solutions of the estimate:\n");
  for (const sysid::SolverCheck& check : summary.solver_check)
    std::printf("  %-30s moves the surface by %.2f mm\n", sysid::solver_check_label(check.what).c_str(),
                1000 * check.surface_change_m);
}

void print_answer(const sysid::Summary& summary, const std::string& out) {
  const bool has_thickness = sysid::young_is_in_pascal(summary);
  for (const sysid::ParameterFinding& finding : summary.parameters) {
    const sysid::ParameterLabel label = sysid::parameter_label(finding.name, has_thickness);
    std::printf("%-16s %s%s\n", finding.name.c_str(),
                value_text(finding, label.unit, summary.by_points).c_str(), edge_of(finding).c_str());
  }
  for (const sysid::SummaryRecording& recording : summary.recordings)
    std::printf("%-16s %s; offset %.1f %.1f %.1f mm, clock %s ms\n",
                data::message_line(recording.name).c_str(), score_text(summary, recording).c_str(),
                1000 * recording.offset.x(), 1000 * recording.offset.y(), 1000 * recording.offset.z(),
                clock_text(recording).c_str());
  print_solver_check(summary);
  if (!summary.next_experiments.empty() || summary.by_points || summary.exit_code != exit_done)
    for (const std::string& step : sysid::next_steps(summary)) std::printf("Next: %s\n", step.c_str());
  std::printf("%s\n%s\n", (fs::path(out) / "summary.json").c_str(), (fs::path(out) / "report.html").c_str());
}

// What all candidates had in common.
void tell_what_was_shared(const std::vector<sysid::Replay>& replays, const CommonOptions& options) {
  for (const sysid::Replay& replay : replays)
    say(options, replay.recording.name + ": one plan of the mesh, " +
                     std::to_string(sim::count_bending_operators(*replay.plan)) +
                     " bending operators; held " + std::to_string(sysid::scored_steps(replay).size()) +
                     " of " + std::to_string(replay.steps + 1) + " steps a candidate");
}

// The estimate over the observations, recording by recording; kept with the run.
std::vector<sysid::Overlay> keep_estimate(const std::vector<std::string>& recordings,
                                          const sysid::Answer& answer, const std::string& out) {
  std::vector<sysid::Overlay> overlays;
  if (answer.best < 0) return overlays;
  const std::vector<std::string> folders = sysid::file_names(recordings);
  for (std::size_t r = 0; r < answer.fit.replays.size(); ++r) {
    overlays.push_back(sysid::make_overlay(answer.fit.replays[r], answer.fit.motions[r].motion,
                                           answer.fit.score.recordings[r]));
    const fs::path picture = fs::path(answer.fit.replays[r].recording.source).parent_path() / "import.svg";
    std::error_code unknown;
    if (fs::is_regular_file(picture, unknown))
      overlays.back().start_picture = data::read_file(picture.string());
    sysid::save_overlay(overlays.back(), (fs::path(out) / "best" / folders[r]).string());
  }
  return overlays;
}

// What to record next, where the recordings do not tell every parameter.
std::vector<sysid::NextExperiment> next_experiments(const Search& search, const sysid::Answer& answer,
                                                    const CommonOptions& options) {
  std::vector<sysid::NextExperiment> ranked;
  const auto is_open = [](const sysid::ParameterFinding& finding) {
    return finding.values.size() > 1 && finding.identifiable != sysid::Identifiable::yes;
  };
  if (!search.plan || answer.misfits.empty() || search.settings.base.solid ||
      std::none_of(answer.parameters.begin(), answer.parameters.end(), is_open))
    return ranked;
  sysid::PlanSettings settings;
  settings.grid = search.settings;
  settings.grid.axes = sysid::in_own_coordinates(settings.grid.axes);
  settings.at = answer.values;
  settings.known = {sysid::covariance_of_draws(settings.grid.axes, answer.samples),
                    sysid::expected_misfit(answer.misfits), sysid::mean_duration(search.replays)};
  const sysid::MotionStore store(search.settings.rollouts, search.settings.shard);
  const auto spreads = [&](const std::vector<double>& of) {
    std::map<std::string, double> named;
    std::size_t k = 0;
    for (const sysid::Axis& axis : settings.grid.axes)
      if (axis.values.size() > 1) named[axis.name] = of[k++];
    return named;
  };
  const std::map<std::string, double> before = spreads(sysid::spread_before(settings));
  for (const sysid::PlannedExperiment& experiment : sysid::rank_experiments(
           search.replays, settings, store,
           [&](const std::string& name) { say(options, "what to record next: simulating " + name); }))
    ranked.push_back({experiment.name, experiment.bits, before, spreads(experiment.spread)});
  return ranked;
}

/// That a share which writes no answer has ended. `missing`: motions of the others that it was not to wait
/// for.
int end_of_share(const sysid::Shard& shard, const std::string& what, std::size_t missing,
                 const CommonOptions& options) {
  if (options.json)
    std::cout << data::format_json(nlohmann::ordered_json{{"schema", "flash-sysid-share/1"},
                                                          {"share", shard.index + 1},
                                                          {"of", shard.count},
                                                          {"missing", missing}});
  else
    say(options, "share " + std::to_string(shard.index + 1) + " of " + std::to_string(shard.count) +
                     " is done" + what);
  return exit_done;
}

// Judges what was found and writes the answer.
int conclude(Search& search, const sysid::ResultsStore& store, const sysid::TimeLeft& time,
             const CommonOptions& options) {
  sysid::GridResults results = store.results();
  const sysid::Answer answer = [&] {
    AnswerLine line(options,
                    sysid::most_work(search.settings, search.replays.size(), search.asked.solver_check), time,
                    sysid::SearchStage::first_look);
    return sysid::find_answer(
        results, search.replays, search.settings, search.asked,
        [&](const sysid::AnswerWork& done, const sysid::AnswerWork& spared) { line.take(done, spared); });
  }();
  std::vector<sysid::NextExperiment> experiments = next_experiments(search, answer, options);
  if (const sysid::Shard& shard = search.settings.shard; shard.index > 0) {
    return end_of_share(shard, "; the first writes the answer, " + search.out, 0, options);
  }
  sysid::Summary summary = sysid::summarize(results, answer, search.replays, search.settings, search.asked);
  summary.next_experiments = std::move(experiments);
  summary.asset = fs::absolute(search.asset.source).lexically_normal().string();
  summary.device = search.replays.front().settings.device == sim::Device::cuda ? "cuda" : "cpu";
  summary.wall_seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - search.begin).count();
  const fs::path residuals = fs::path(search.out) / "residuals.csv";
  if (!answer.residuals.empty()) {
    const std::string text = sysid::residuals_text(answer.residuals);
    summary.residuals_digest = sysid::residuals_digest(text);
    data::write_atomically(residuals.string(), text);
  } else {
    fs::remove(residuals);
  }
  sysid::save_summary(summary, (fs::path(search.out) / "summary.json").string());
  sysid::ReportSettings report;
  for (std::size_t k = 0; k < search.map.size() && k < 2; ++k) report.map_axes[k] = search.map[k];
  const std::vector<sysid::Overlay> overlays = keep_estimate(results.recordings, answer, search.out);
  sysid::write_report(summary, results, overlays, report, (fs::path(search.out) / "report.html").string());

  for (const std::string& warning : summary.warnings) warn(warning);
  if (options.json) {
    std::cout << sysid::summary_text(summary);
  } else {
    print_answer(summary, search.out);
  }
  // Of a long run this is what is left on the terminal.
  if (summary.exit_code == exit_unusable)
    std::cerr << "flash-sysid: the answer cannot be used (exit code 3): "
              << data::message_line(summary.warnings.front()) << '\n';
  return summary.exit_code;
}

}  // namespace

AnswerLine::AnswerLine(const CommonOptions& options, const sysid::AnswerWork& most,
                       const sysid::TimeLeft& time, sysid::SearchStage stage)
    : line_(options), meter_(most), time_(time) {
  time_.begin(stage, seconds_now());
}

void AnswerLine::take(const sysid::AnswerWork& done, const sysid::AnswerWork& spared) {
  const std::scoped_lock lock(mutex_);
  const double now = seconds_now();
  meter_.take(done, spared);
  if (done.lattices > 0) time_.begin(sysid::SearchStage::lattice, now);
  if (done.ends > 0) time_.begin(sysid::SearchStage::end, now);
  line_.show(meter_, time_.seconds(now));
}

int run_search(Search& search, sysid::ResultsStore& store, const CommonOptions& options) {
  const auto total = static_cast<std::size_t>(sysid::count_candidates(search.settings.axes));
  const auto expected_about = [&](const std::vector<double>& values) {
    return sysid::expected_work(search.replays, search.settings, search.asked.solver_check, values);
  };
  const sysid::ExpectedWork expected = expected_about(sysid::middle_of(search.settings.axes));
  say(options, "then the answer, which takes about as long as " +
                   data::format_count(static_cast<std::size_t>(
                       expected.first_look + expected.lattices * expected.lattice + expected.end)) +
                   " candidates more");
  sysid::TimeLeft time(expected);
  const auto kept = [&](const std::string& why = {}) {
    warn(why + "stopped with " + data::format_count(store.results().candidates.size()) + " of " +
         data::format_count(total) + " candidates, kept in " + search.out + "; --resume goes on");
    return exit_failed;
  };
  try {
    {
      ProgressLine line(options);
      if (!sysid::grid_search(
              search.replays, search.settings, store,
              [&](const sysid::Progress& progress) {
                time.take_candidates(progress.total - progress.done,
                                     std::max(1 / progress.candidates_per_second, search.candidate_seconds));
                line.show(progress, time.seconds(0));
              },
              &stop_on_signals()))
        return kept();
    }
    if (const int best = sysid::best_of(store.results()); best >= 0)
      time.expect(expected_about(store.results().candidates[static_cast<std::size_t>(best)].values));
    if (options.verbose) tell_what_was_shared(search.replays, options);
    return conclude(search, store, time, options);
  } catch (const data::Stopped&) {
    return kept();
  } catch (const sysid::OthersMissing& others) {
    return end_of_share(search.settings.shard,
                        std::string(", and ") + others.what() +
                            "; flash-sysid merge brings shares together, --resume goes on",
                        others.motions, options);
  } catch (const sim::DeviceError& error) {
    return kept(std::string(error.what()) + "; ");
  }
}

}  // namespace flash
