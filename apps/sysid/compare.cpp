#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/command_line/command_line.h"
#include "apps/command_line/option_checks.h"
#include "apps/sysid/options.h"
#include "apps/sysid/verbs.h"
#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/json_reader.h"
#include "data/files/text.h"
#include "data/files/writable.h"
#include "sysid/report/compare.h"

namespace flash {
namespace {

struct CompareOptions {
  CommonOptions common;
  std::vector<std::string> runs;
  std::string out;
};

nlohmann::ordered_json comparison_json(const std::vector<sysid::FinishedSearch>& searches,
                                       const std::vector<sysid::ComparedSearch>& compared) {
  nlohmann::ordered_json json;
  json["schema"] = "flash-sysid-comparison/1";
  json["searches"] = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i < searches.size(); ++i)
    json["searches"].push_back({{"run", searches[i].name},
                                {"score_m", searches[i].summary.best_score},
                                {"excess", compared[i].excess},
                                {"log_occupied", compared[i].occupied},
                                {"probability", compared[i].probability},
                                {"differs", compared[i].differs}});
  return json;
}

void print_comparison(const std::vector<sysid::FinishedSearch>& searches,
                      const std::vector<sysid::ComparedSearch>& compared) {
  std::printf("%10s %14s %12s  %s\n", "score mm", "excess", "probability", "search");
  for (std::size_t i = 0; i < searches.size(); ++i) {
    std::string differs;
    for (const auto& [key, text] : compared[i].differs)
      differs += (differs.empty() ? "  " : ", ") + key + " " + text;
    std::printf("%10.2f %14.1f %12.3g  %s%s\n", 1e3 * searches[i].summary.best_score, compared[i].excess,
                compared[i].probability, searches[i].name.c_str(), differs.c_str());
  }
}

int run_compare(const CompareOptions& options) {
  expect_ending("--out", options.out, {".json"});
  expect_each_once("runs", options.runs);
  std::vector<sysid::FinishedSearch> searches;
  for (const std::string& run : options.runs) searches.push_back(sysid::load_finished_search(run));
  const std::vector<sysid::ComparedSearch> compared = sysid::compare(searches);
  if (!options.out.empty()) data::check_file_free(options.out, options.common.force);
  const std::string text = data::format_json(comparison_json(searches, compared));
  if (!options.out.empty()) data::write_atomically(options.out, text);
  const auto likeliest = static_cast<std::size_t>(
      std::max_element(compared.begin(), compared.end(),
                       [](const auto& a, const auto& b) { return a.probability < b.probability; }) -
      compared.begin());
  for (const sysid::FinishedSearch& search : searches)
    if (search.summary.exit_code != exit_done) warn(search.name + ": " + search.summary.warnings.front());
  for (const sysid::SummaryRecording& recording : searches[likeliest].summary.recordings)
    if (!sysid::model_fits(recording))
      warn(searches[likeliest].name + ": the likeliest of these models misses " + recording.name + " by " +
           data::format_short(std::round(1e5 * recording.misfit.size) / 100) +
           " mm apart from noise: it is the best of them, and does not fit");
  if (options.common.json)
    std::cout << text;
  else
    print_comparison(searches, compared);
  return exit_done;
}

}  // namespace

void add_compare_verb(CLI::App& app, Action& action) {
  const auto options = std::make_shared<CompareOptions>();
  CLI::App* verb = app.add_subcommand(
      "compare", "Say which of several searches of the same recordings has the likelier model");
  verb->add_option("runs", options->runs, "Folders of searches, as of other shapes of the grasp")
      ->required()
      ->expected(2, 64);
  verb->add_option("-o,--out", options->out, "File for the comparison, as comparison.json");
  add_common_options(*verb, options->common);
  verb->footer(
      "excess: -2 log likelihood over that of the search of least distance, with the model's own error in "
      "it. A "
      "model of more parameters pays for them.\n"
      "Example:\n"
      "  flash-sysid grid lift --asset cloth.json --bending 1e-5:1e-3:9:log --grasp-shape clamp --no-horizon "
      "-o clamp\n"
      "  flash-sysid grid lift --asset cloth.json --bending 1e-5:1e-3:9:log --grasp-shape pinch --no-horizon "
      "-o pinch\n"
      "  flash-sysid compare clamp pinch");
  verb->callback([options, &action] { action = [options] { return run_compare(*options); }; });
}

}  // namespace flash
