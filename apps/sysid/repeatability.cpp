#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/command_line/command_line.h"
#include "apps/command_line/option_checks.h"
#include "apps/sysid/options.h"
#include "apps/sysid/verbs.h"
#include "data/files/json_reader.h"
#include "data/files/text.h"
#include "sysid/observe/repeatability.h"

namespace flash {
namespace {

struct RepeatabilityOptions {
  CommonOptions common;
  std::vector<std::string> recordings;
  double from = 0, to = 0;
};

nlohmann::ordered_json json_of(const sysid::Repeatability& found,
                               const std::vector<data::Recording>& recordings) {
  nlohmann::ordered_json json;
  json["schema"] = "flash-sysid-repeatability/1";
  json["recordings"] = {recordings[0].name, recordings[1].name};
  json["distance_m"] = found.distance;
  const sysid::Registration& r = found.registration;
  json["registration"] = {{"offset_m", {r.offset[0], r.offset[1], r.offset[2]}},
                          {"yaw_rad", r.yaw},
                          {"time_offset_s", r.time_offset}};
  for (const sysid::TrialDistance& keyframe : found.keyframes)
    json["keyframes"].push_back(
        {{"t", keyframe.time}, {"distance_m", keyframe.distance}, {"seen", keyframe.seen}});
  return json;
}

int run_repeatability(const CLI::App& verb, const RepeatabilityOptions& options) {
  stop_on_signals();
  const std::vector<data::Recording> recordings = load_recordings(options.recordings, options.common);
  sysid::RepeatabilitySettings settings;
  if (verb.count("--from") > 0) settings.score_from = options.from;
  if (verb.count("--until") > 0) settings.score_to = options.to;
  const sysid::Repeatability found = sysid::measure_repeatability(recordings[0], recordings[1], settings);
  for (const std::string& name : found.bounds_hit)
    warn(name + " between the trials is at its bound in " + recordings[0].source +
         ": the distance is larger than that of shape and motion");
  if (options.common.json) {
    std::cout << data::format_json(json_of(found, recordings));
    return exit_done;
  }
  std::printf("%8s %12s %6s\n", "t [s]", "distance mm", "seen");
  for (const sysid::TrialDistance& keyframe : found.keyframes)
    std::printf("%8.3f %12.2f %5.0f %%\n", keyframe.time, 1e3 * keyframe.distance, 100 * keyframe.seen);
  std::printf("the trials differ by %s mm; for grid: --repeatability %s\n",
              data::format_short(1e3 * found.distance).c_str(), data::format_short(found.distance).c_str());
  return exit_done;
}

}  // namespace

void add_repeatability_verb(CLI::App& app, Action& action) {
  const auto options = std::make_shared<RepeatabilityOptions>();
  CLI::App* verb = app.add_subcommand("repeatability", "Measure how far two trials of one experiment differ");
  verb->add_option("recordings", options->recordings, "The folders of two trials with recording.json")
      ->required()
      ->expected(2);
  verb->add_option("--from", options->from, "Leave out keyframes before this time [s]")->check(any_number());
  verb->add_option("--until", options->to, "Leave out keyframes after this time [s]")->check(any_number());
  add_common_options(*verb, options->common);
  verb->footer("Example:\n  flash-sysid repeatability lift lift_again --from 1");
  verb->callback(
      [verb, options, &action] { action = [verb, options] { return run_repeatability(*verb, *options); }; });
}

}  // namespace flash
