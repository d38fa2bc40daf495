#include <algorithm>
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
#include "data/recording/recording_digest.h"
#include "sysid/emulate/search_warnings.h"
#include "sysid/infer/held.h"
#include "sysid/infer/prediction.h"
#include "sysid/observe/registration_parameter.h"
#include "sysid/replay/memory_estimate.h"
#include "sysid/report/search_folder.h"

namespace flash {
namespace {

constexpr double kContradicts = 0.01;  // chance of what was observed, below which the search does not hold

struct PredictOptions {
  CommonOptions common;
  ReplayOptions replay;
  std::string run;
  std::string recording;
  std::string asset;
  std::vector<std::string> holds;
  int draws = 24;
  std::string out;
};

// What candidates of the search have in common, and the values of its estimate and of draws.
struct Found {
  sysid::Summary summary;
  sysid::GridSettings grid;
  std::vector<std::vector<double>> values;
  std::vector<std::optional<double>> weights;  // of each, where it is another than that of the search
};

// `holds` differ from what the search found or held, as the start yaw of another trial may.
Found take_search(const PredictOptions& options) {
  const sysid::SearchFolder search = sysid::load_search_folder(options.run);
  Found found{search.summary, {}, {}, {}};
  const sysid::Summary& summary = found.summary;
  if (summary.samples.rows() < 2 || summary.recordings.empty())
    throw data::InputError(options.run + ": found no posterior, expected a search that came to an estimate");
  const std::vector<sysid::Axis> holds = parse_values(options.holds);
  const auto held = [&](const std::string& name) {
    return std::find_if(holds.begin(), holds.end(),
                        [&](const sysid::Axis& axis) { return axis.name == name; });
  };
  found.grid.axes = search.results.axes;
  for (const sysid::Axis& axis : holds)
    if (std::none_of(found.grid.axes.begin(), found.grid.axes.end(),
                     [&](const sysid::Axis& searched) { return searched.name == axis.name; }))
      found.grid.axes.push_back(axis);
  for (const auto& [name, fixed] : summary.fixed) {
    if (held(name) != holds.end()) continue;
    if (fixed.source == "measured" || fixed.deviation)
      found.grid.fixed.push_back({name, {fixed.value}, false});
    if (fixed.deviation) found.grid.deviations[name] = *fixed.deviation;
  }
  // A column of the samples for each axis that was searched.
  const Eigen::Index samples = summary.samples.rows(), draws = std::min<Eigen::Index>(options.draws, samples);
  const bool weighed = summary.sample_weights.size() == 0 || held("areal_density") != holds.end() ||
                       held("density") != holds.end();
  for (Eigen::Index draw = -1; draw < draws; ++draw) {
    const Eigen::Index sample = draw * samples / draws;
    found.weights.emplace_back();
    if (draw >= 0 && !weighed) found.weights.back() = summary.sample_weights[sample];
    std::vector<double>& values = found.values.emplace_back();
    Eigen::Index column = 0;
    for (const sysid::Axis& axis : found.grid.axes) {
      const bool searched = axis.values.size() > 1;
      if (const auto hold = held(axis.name); hold != holds.end())
        values.push_back(hold->values.front());
      else if (!searched)
        values.push_back(axis.values.front());
      else
        values.push_back(draw < 0 ? summary.best.at(axis.name) : summary.samples(sample, column));
      column += searched ? 1 : 0;
    }
  }
  return found;
}

int exit_code_of(const sysid::Prediction& prediction) {
  return prediction.chance < kContradicts ? exit_unusable : exit_done;
}

std::string setting(const sysid::Summary& summary, const std::string& name) {
  const auto found = summary.settings.find(name);
  return found == summary.settings.end() ? "" : found->second;
}

// An option that is not that of the search makes another motion.
void warn_of_other_settings(const sysid::Summary& summary, const ReplayOptions& options) {
  const auto compare = [&](const char* name, const char* option, double value) {
    const std::optional<double> searched = data::parse_number(setting(summary, name));
    if (searched && std::abs(*searched - value) > 1e-9 * value)
      warn(std::string(option) + ": found " + data::format_short(value) + ", the search had " +
           data::format_short(*searched));
  };
  compare("time_step_s", "--time-step", options.time_step);
  compare("tolerance", "--tolerance", options.tolerance);
}

nlohmann::ordered_json prediction_json(const sysid::Prediction& prediction, const PredictOptions& options,
                                       const data::Recording& recording) {
  nlohmann::ordered_json json;
  json["schema"] = "flash-sysid-prediction/1";
  json["run"] = std::filesystem::absolute(options.run).lexically_normal().string();
  json["recording"] = recording.name;
  const sysid::Registration& fit = prediction.fit.registration;
  json["registration"] = {{"offset_m", {fit.offset[0], fit.offset[1], fit.offset[2]}},
                          {"yaw_rad", fit.yaw},
                          {"time_offset_s", fit.time_offset}};
  json["bounds_hit"] = prediction.fit.bounds_hit;
  json["score_m"] = prediction.fit.score;
  json["keyframes"] = nlohmann::ordered_json::array();
  for (const sysid::PredictedKeyframe& keyframe : prediction.keyframes)
    json["keyframes"].push_back({{"t", keyframe.t},
                                 {"distance_m", keyframe.distance},
                                 {"band95_m", keyframe.band},
                                 {"holds", keyframe.holds()}});
  json["held"] = std::count_if(prediction.keyframes.begin(), prediction.keyframes.end(),
                               [](const auto& keyframe) { return keyframe.holds(); });
  json["chance"] = prediction.chance;
  json["exit_code"] = exit_code_of(prediction);
  return json;
}

void print_prediction(const sysid::Prediction& prediction) {
  std::printf("%8s %12s %20s\n", "t [s]", "distance mm", "expected, 95 % mm");
  std::size_t held = 0;
  for (const sysid::PredictedKeyframe& keyframe : prediction.keyframes) {
    held += keyframe.holds() ? 1 : 0;
    std::printf("%8.3f %12.2f %9.2f to %7.2f%s\n", keyframe.t, 1e3 * keyframe.distance,
                1e3 * keyframe.band[0], 1e3 * keyframe.band[1], keyframe.holds() ? "" : "  outside");
  }
  std::printf("%zu of %zu keyframes are as expected; %s %% of what is expected is as far from its mean\n",
              held, prediction.keyframes.size(), data::format_short(100 * prediction.chance).c_str());
}

int run_predict(const CLI::App& verb, const PredictOptions& options) {
  stop_on_signals();
  expect_ending("--out", options.out, {".json"});
  Found found = take_search(options);
  const data::Recording recording = data::load_recording(options.recording);
  warn_of_doubts(recording);
  const data::Asset asset =
      load_asset_for(options.asset.empty() ? found.summary.asset : options.asset, recording);
  check_kind(asset, recording);
  check_options(options.replay, asset, {recording});
  sysid::ReplaySettings simulated = replay_settings(verb, options.replay, thread_count(options.common));
  simulated.element_order = asset.element_order;
  place_simulation(options.common, asset, simulated);
  if (simulated.mesh.empty()) take_mesh(found.summary, options.run, recording, simulated);
  std::vector<sysid::Replay> replays = {sysid::make_replay(recording, simulated)};
  const sysid::Replay& replay = replays.front();
  warn_of_other_settings(found.summary, options.replay);
  std::vector<std::string> notices;
  found.grid.base = material_base(asset, replay.sheet(), notices, found.grid.fixed);
  place_candidates(options.common, {sysid::candidate_at(found.values.front(), found.grid)}, replays);
  sysid::check_grasp_axes(found.grid.axes, {replay});
  found.grid.score = score_settings(options.replay);
  sysid::check_job({replay}, static_cast<double>(found.values.size()),
                   sysid::estimate_batch({replay}, found.values.size()));
  if (!options.out.empty()) data::check_file_free(options.out, options.common.force);
  for (const sysid::SummaryRecording& used : found.summary.recordings)
    if (used.sha256 == data::recording_sha256(recording))
      warn(recording.name + " is a recording that the search used: nothing is predicted");
  for (const std::string& warning : found.summary.warnings) say(options.common, "the search: " + warning);
  tell_known_before(options.common, replays, sysid::held_at(found.values.front(), found.grid),
                    sysid::Coming::estimate);

  std::vector<sysid::ReplayCandidate> candidates;
  for (std::size_t i = 0; i < found.values.size(); ++i)
    candidates.push_back(found.weights[i]
                             ? sysid::candidate_with(found.values[i], found.grid,
                                                     asset.element_type == data::ElementType::tetrahedron
                                                         ? "density"
                                                         : "areal_density",
                                                     *found.weights[i])
                             : sysid::candidate_at(found.values[i], found.grid));
  const std::string kept = (std::filesystem::path(options.run) / "motions").string();
  check_keeps_motions("run", kept);
  const sysid::MotionStore store(kept);
  std::vector<sysid::ReplayResult> motions(candidates.size());
  store.run(replay, candidates,
            [&](std::size_t i, sysid::ReplayResult result) { motions[i] = std::move(result); });
  end_after_signal();
  if (!motions.front().finite)
    throw std::runtime_error(recording.name + ": the simulation diverged; lower --time-step");
  std::erase_if(motions, [](const sysid::ReplayResult& motion) { return !motion.finite; });
  std::vector<sysid::Misfit> misfits;
  for (const sysid::SummaryRecording& used : found.summary.recordings) misfits.push_back(used.misfit);
  const sysid::SolvedAs solved{setting(found.summary, "score_of").starts_with("cells of no size"),
                               setting(found.summary, "solver_check") == "yes"};
  const sysid::Prediction prediction = sysid::predict(
      replay, motions,
      sysid::errors_of_prediction(replay, found.grid, found.values.front(), motions.front(), solved, store),
      misfits, found.grid.score, options.common.seed);
  end_after_signal();

  const std::string text = data::format_json(prediction_json(prediction, options, recording));
  if (!options.out.empty()) data::write_atomically(options.out, text);
  warn_of_camera(recording);
  warn_of_seams(replay.recording);
  for (const sysid::RegistrationParameter& parameter : sysid::registration_parameters)
    if (sysid::is_at_bound(prediction.fit.bounds_hit, parameter))
      warn(sysid::at_bound_text(parameter, recording.nuisance));
  if (options.common.json)
    std::cout << text;
  else
    print_prediction(prediction);
  if (exit_code_of(prediction) == exit_unusable)
    warn(recording.name + " contradicts the search: chance takes a recording so far once in " +
         data::format_short(std::round(1 / std::max(prediction.chance, 5e-4))) + " times, or less");
  return exit_code_of(prediction);
}

}  // namespace

void add_predict_verb(CLI::App& app, Action& action) {
  const auto options = std::make_shared<PredictOptions>();
  CLI::App* verb = app.add_subcommand(
      "predict",
      "Judge a search by a recording that it has not used: what it expects, and what was observed");
  verb->add_option("run", options->run, "Folder of the search")->required();
  verb->add_option("recording", options->recording, "Folder with recording.json")->required();
  verb->add_option("--asset", options->asset, "The object; without one, that of the search");
  add_hold_option(*verb, options->holds,
                  "A value in place of the search's, as start_yaw=0.1 of another trial");
  verb->add_option("--draws", options->draws, "Draws of the posterior that are simulated")
      ->check(whole_number(1, 64))
      ->capture_default_str();
  verb->add_option("-o,--out", options->out, "File for the prediction, as prediction.json");
  add_replay_options(*verb, options->replay);
  add_seed_option(*verb, options->common);
  add_device_option(*verb, options->common);
  add_common_options(*verb, options->common);
  verb->footer(
      "The mesh is that of the search. Grasp, times, step and tolerance are not: give the options of the "
      "search.\n"
      "Exit code 3: the recording contradicts the search (chance below 1 %).\n"
      "Example:\n  flash-sysid predict run lift_again -o prediction.json");
  verb->callback(
      [verb, options, &action] { action = [verb, options] { return run_predict(*verb, *options); }; });
}

}  // namespace flash
