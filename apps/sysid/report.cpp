#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/command_line/command_line.h"
#include "apps/command_line/option_checks.h"
#include "apps/sysid/options.h"
#include "apps/sysid/verbs.h"
#include "data/files/json_reader.h"
#include "data/files/writable.h"
#include "sysid/report/recording_names.h"
#include "sysid/report/report.h"
#include "sysid/report/search_folder.h"

namespace flash {
namespace {

namespace fs = std::filesystem;

struct ReportOptions {
  CommonOptions common;
  std::string run;
  std::vector<std::string> map;
  int points = 3000;
  std::string out;
};

int run_report(const ReportOptions& options) {
  expect_ending("--out", options.out, {".html", ".htm"});
  auto [summary, results] = sysid::load_search_folder(options.run);
  std::vector<std::optional<double>> horizons;
  for (const sysid::SummaryRecording& recording : summary.recordings) horizons.push_back(recording.horizon_s);
  if (!horizons.empty()) sysid::drop_beyond_horizons(horizons, results);
  std::vector<sysid::Overlay> overlays;
  const std::vector<std::string> folders = sysid::file_names(results.recordings);
  for (std::size_t r = 0; r < folders.size(); ++r) {
    const fs::path folder = fs::path(options.run) / "best" / folders[r];
    if (!fs::exists(folder)) continue;
    overlays.push_back(sysid::load_overlay(folder.string()));
    overlays.back().name = results.recordings[r];
  }
  sysid::ReportSettings settings;
  settings.max_cloud_points = options.points;
  for (std::size_t k = 0; k < options.map.size() && k < 2; ++k) settings.map_axes[k] = options.map[k];
  // Its own report.html is the run's to replace; any other file is not.
  const std::string out =
      options.out.empty() ? (fs::path(options.run) / "report.html").string() : options.out;
  if (!options.out.empty()) data::check_file_free(out, options.common.force);
  sysid::write_report(summary, results, overlays, settings, out);
  if (options.common.json) {
    std::cout << data::format_json(
        nlohmann::ordered_json{{"schema", "flash-sysid-report/1"}, {"report", out}});
  } else {
    std::printf("%s\n", out.c_str());
  }
  return exit_done;
}

}  // namespace

void add_report_verb(CLI::App& app, Action& action) {
  const auto options = std::make_shared<ReportOptions>();
  CLI::App* verb =
      app.add_subcommand("report", "Write the report of a search again: one HTML file that opens anywhere");
  verb->add_option("run", options->run, "Folder of the search")->required();
  add_list_option(*verb, "--map", options->map, "The two parameters of the score map, as bending,friction",
                  {}, 2);
  verb->add_option("--points", options->points, "Observed points shown a keyframe at most")
      ->check(whole_number(1, 10000000))
      ->capture_default_str();
  verb->add_option("-o,--out", options->out, "The file; without it report.html in the folder of the search");
  add_common_options(*verb, options->common);
  verb->footer("Example:\n  flash-sysid report run --map bending,friction -o report.html");
  verb->callback([options, &action] { action = [options] { return run_report(*options); }; });
}

}  // namespace flash
