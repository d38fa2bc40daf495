#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "apps/command_line.h"
#include "apps/option_checks.h"
#include "apps/prior_option.h"
#include "apps/sysid_options.h"
#include "apps/sysid_verbs.h"
#include "data/atomic_file.h"
#include "data/error.h"
#include "data/json_reader.h"
#include "data/text.h"
#include "data/writable.h"
#include "sysid/infer/fit/fit.h"
#include "sysid/replay/memory_estimate.h"
#include "sysid/report/parameter_label.h"
#include "sysid/report/search_folder.h"

namespace flash {
namespace {

namespace fs = std::filesystem;

struct FitOptions {
  CommonOptions common;
  ReplayOptions replay;
  std::vector<std::string> recordings;
  std::string asset;
  std::string start;
  std::vector<std::string> freeze, priors;
  FixedTexts fixed;
  int iterations = 15;
  int generations = 0;
  std::string out;
};

bool contains(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

// A parameter that was not searched stays as it was in the search.
void hold(const std::string& name, const sysid::Summary& found, std::vector<sysid::Axis>& fixed) {
  const auto value = found.best.find(name);
  if (value == found.best.end())
    sysid::check_parameter("--freeze " + name, name);
  else if (std::none_of(fixed.begin(), fixed.end(),
                        [&](const sysid::Axis& axis) { return axis.name == name; }))
    fixed.push_back({name, {value->second}, false});
}

// 95 % of a normal distribution, within the range; empty where the covariance is.
std::optional<std::array<double, 2>> interval_of(const sysid::FitResult& result, const sysid::Axis& axis,
                                                 std::size_t k) {
  if (result.covariance.size() == 0) return std::nullopt;
  const auto i = static_cast<Eigen::Index>(k);
  const double reach = 1.96 * std::sqrt(result.covariance(i, i)), value = result.values[k];
  const double low = axis.logarithmic ? value * std::exp(-reach) : value - reach;
  const double high = axis.logarithmic ? value * std::exp(reach) : value + reach;
  return std::array<double, 2>{std::max(low, axis.values.front()), std::min(high, axis.values.back())};
}

// What the search looked for, over the range it searched; frozen ones stay where it found them.
sysid::FitSettings fit_settings(const FitOptions& options, const sysid::Summary& found) {
  sysid::FitSettings settings;
  settings.grid.fixed = parse_fixed(options.fixed);
  const auto is_fixed = [&](const std::string& name) {
    return std::any_of(settings.grid.fixed.begin(), settings.grid.fixed.end(),
                       [&](const sysid::Axis& axis) { return axis.name == name; });
  };
  for (const auto& [name, fixed] : found.fixed)
    if (!is_fixed(name) && fixed.source == "measured")
      settings.grid.fixed.push_back({name, {fixed.value}, false});
  std::vector<std::string> searched;
  for (const sysid::ParameterFinding& finding : found.parameters) {
    searched.push_back(finding.name);
    if (is_fixed(finding.name)) continue;
    const double value = finding.estimate.value_or(found.best.at(finding.name));
    if (contains(options.freeze, finding.name)) {
      settings.grid.fixed.push_back({finding.name, {value}, false});
      continue;
    }
    settings.grid.axes.push_back(
        {finding.name, {finding.values.front(), finding.values.back()}, finding.logarithmic});
    settings.start.push_back(value);
  }
  for (const std::string& name : options.freeze)
    if (!contains(searched, name)) hold(name, found, settings.grid.fixed);
  if (settings.grid.axes.empty()) throw data::InputError("--freeze, --fix: no parameter is left to fit");
  for (const std::string& text : options.priors) {
    settings.priors.push_back(parse_prior(text));
    const std::string& name = settings.priors.back().name;
    if (std::none_of(settings.grid.axes.begin(), settings.grid.axes.end(),
                     [&](const sysid::Axis& axis) { return axis.name == name; }))
      throw data::InputError("--prior: " + name + ": is not among the parameters fitted");
  }
  settings.iterations = options.iterations;
  settings.global.generations = options.generations;
  settings.global.seed = options.common.seed;
  settings.grid.score = score_settings(options.replay);
  return settings;
}

nlohmann::ordered_json fit_json(const sysid::FitResult& result, const sysid::FitSettings& settings) {
  nlohmann::ordered_json json;
  json["schema"] = "flash-sysid-fit/1";
  const std::vector<sysid::Axis>& axes = settings.grid.axes;
  for (std::size_t k = 0; k < axes.size(); ++k) {
    nlohmann::ordered_json parameter;
    parameter["estimate"] = result.values[k];
    parameter["start"] = settings.start[k];
    const auto interval = interval_of(result, axes[k], k);
    parameter["interval95"] = interval ? nlohmann::ordered_json(*interval) : nlohmann::ordered_json(nullptr);
    if (result.covariance.size() > 0) {
      const auto i = static_cast<Eigen::Index>(k);
      parameter["spread"] = std::sqrt(result.covariance(i, i));
      parameter["spread_of"] = axes[k].logarithmic ? "logarithm" : "value";
    } else {
      parameter["spread"] = nullptr;
    }
    json["parameters"][axes[k].name] = parameter;
  }
  for (const sysid::Axis& axis : settings.grid.fixed) json["fixed"][axis.name] = axis.values.front();
  json["score"] = result.best.score;
  json["converged"] = result.best.converged;
  json["refined"] = result.refined;
  json["termination"] = result.termination;
  json["path"] = nlohmann::ordered_json::array();
  for (const sysid::FitStep& step : result.path) {
    nlohmann::ordered_json entry;
    for (std::size_t k = 0; k < axes.size(); ++k) entry[axes[k].name] = step.values[k];
    entry["cost"] = step.cost;  // null where every candidate of a generation diverged
    entry["accepted"] = step.accepted;
    entry["stage"] = step.stage == sysid::FitStage::global ? "global" : "local";
    json["path"].push_back(entry);
  }
  return json;
}

int run_fit(const CLI::App& verb, const FitOptions& options) {
  stop_on_signals();
  require_cpu(options.common);
  const std::vector<data::Recording> recordings = load_recordings(options.recordings, options.common);
  const sysid::Summary found = sysid::load_search_folder(options.start).summary;
  const data::Asset asset =
      load_asset_for(options.asset.empty() ? found.asset : options.asset, recordings.front());
  sysid::FitSettings settings = fit_settings(options, found);
  std::vector<sysid::Replay> replays;
  for (const data::Recording& recording : recordings)
    replays.push_back(
        sysid::make_replay(recording, replay_settings(verb, options.replay, thread_count(options.common))));
  std::vector<std::string> notices;
  settings.grid.base = material_base(asset, replays.front().sheet().rest, notices);
  const std::size_t batch =
      std::max<std::size_t>(2 * settings.start.size() + 1, settings.global.generations > 0 ? 16 : 0);
  sysid::check_job(
      replays, static_cast<double>(batch) * (options.iterations + static_cast<double>(options.generations)),
      sysid::estimate_batch(replays, batch));
  data::check_folder_free(options.out, options.common.force);
  for (const std::string& notice : notices) say(options.common, notice);

  const std::vector<sysid::Axis>& axes = settings.grid.axes;
  int generation = 0, iteration = 0;
  auto last = std::chrono::steady_clock::now();
  const sysid::FitResult result = sysid::fit(replays, settings, [&](const sysid::FitStep& step) {
    const auto now = std::chrono::steady_clock::now();
    const double seconds = std::chrono::duration<double>(now - std::exchange(last, now)).count();
    std::string line =
        step.stage == sysid::FitStage::global
            ? "generation " + std::to_string(++generation) + " of " + std::to_string(options.generations)
            : "step " + std::to_string(iteration++) + " of at most " + std::to_string(options.iterations);
    line += ", took " + data::format_short(seconds) + " s: cost " + data::format_short(step.cost);
    for (std::size_t k = 0; k < axes.size(); ++k)
      line += "  " + axes[k].name + " " + data::format_short(step.values[k]);
    say(options.common, line + (step.accepted ? "" : "  (left)"));
  });
  const std::string text = data::format_json(fit_json(result, settings));
  end_after_signal();
  data::write_atomically((fs::path(options.out) / "fit.json").string(), text);
  if (options.common.json) {
    std::cout << text;
  } else {
    for (std::size_t k = 0; k < axes.size(); ++k) {
      const std::string unit = sysid::parameter_label(axes[k].name, asset.thickness.has_value()).unit;
      const auto interval = interval_of(result, axes[k], k);
      std::printf("%-16s %s%s%s  (%s)\n", axes[k].name.c_str(), data::format_short(result.values[k]).c_str(),
                  unit.empty() ? "" : " ", unit.c_str(),
                  interval ? ("95 %: " + data::format_short((*interval)[0]) + " to " +
                              data::format_short((*interval)[1]) + ", by the scatter of the residuals alone")
                                 .c_str()
                           : "the recordings do not determine it");
    }
    std::printf("%.3f mm from the observed points; %s\n%s\n", 1000 * result.best.score,
                result.termination.c_str(), (fs::path(options.out) / "fit.json").c_str());
  }
  for (const data::Recording& recording : recordings) warn_of_camera(recording);
  if (!result.best.converged)
    warn("the fitted candidate missed a step: raise --iterations or lower --time-step");
  if (result.stuck) warn(result.termination);
  return result.best.converged && !result.stuck ? exit_done : exit_unusable;
}

}  // namespace

void add_fit_verb(CLI::App& app, Action& action) {
  const auto options = std::make_shared<FitOptions>();
  CLI::App* verb =
      app.add_subcommand("fit", "Refine what a grid found, by Levenberg-Marquardt, between its values");
  verb->add_option("recording", options->recordings, "Folders with recording.json")->required();
  verb->add_option("--start", options->start, "Folder of the search to start from")->required();
  verb->add_option("--asset", options->asset, "The object; without one, that of the search");
  verb->add_option("--freeze", options->freeze,
                   "Parameters that stay where the search found them, or held them")
      ->delimiter(',');
  verb->add_option("--prior", options->priors,
                   "What is known beforehand, as bending=1e-5:2 (factor, one sigma)")
      ->allow_extra_args(false);
  add_fixed_options(*verb, options->fixed, "A measured constant, as friction=0.3");
  verb->add_option("--steps", options->iterations, "Of the optimizer at most")
      ->check(whole_number(1, 10000))
      ->capture_default_str();
  verb->add_option("--global", options->generations,
                   "Generations of a search over the whole ranges before, of 16 candidates each; 0: none")
      ->check(whole_number(0, 10000))
      ->capture_default_str();
  verb->add_option("-o,--out", options->out, "Folder for fit.json")->required();
  add_replay_options(*verb, options->replay);
  add_seed_option(*verb, options->common);
  add_device_option(*verb, options->common);
  add_common_options(*verb, options->common);
  verb->footer(
      "Exit code 3: a step did not converge, or nothing was refined, for the reason that is said.\n"
      "Example:\n  flash-sysid fit lift --start run --freeze poisson --prior bending=1e-5:2 -o fitted");
  verb->callback([verb, options, &action] { action = [verb, options] { return run_fit(*verb, *options); }; });
}

}  // namespace flash
