#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "apps/command_line/command_line.h"
#include "apps/sysid/options.h"
#include "apps/sysid/verbs.h"
#include "data/files/error.h"
#include "data/files/json_reader.h"
#include "data/files/text.h"
#include "sysid/emulate/fingerprint.h"
#include "sysid/emulate/grid_file.h"
#include "sysid/replay/motion_store.h"

namespace flash {
namespace {

namespace fs = std::filesystem;

struct MergeOptions {
  CommonOptions common;
  std::vector<std::string> runs;
  std::string out;
};

/// That all are of one search: else nobody would ask for the motions of some.
void expect_one_search(const std::vector<std::string>& runs, const std::string& out) {
  std::vector<std::string> files;
  for (const std::string& run : runs) {
    const std::vector<std::string> of_run = sysid::grid_files(run);
    if (of_run.empty())
      throw data::InputError(run +
                             ": found no search, expected a folder that flash-sysid grid --shard wrote");
    if (!fs::is_directory(fs::path(run) / "motions"))
      throw data::InputError(run +
                             ": found no folder motions in it, expected the motions of the search there, "
                             "where it keeps them without --rollouts");
    files.insert(files.end(), of_run.begin(), of_run.end());
  }
  for (const std::string& file : sysid::grid_files(out)) files.push_back(file);
  const sysid::Fingerprint first =
      sysid::load_grid_file(files.front()).fingerprint.value_or(sysid::Fingerprint());
  if (const auto other = sysid::other_search(first, files))
    throw data::InputError(other->file + ": this is not the search of " + files.front() + ": " +
                           other->difference);
}

int run_merge(const MergeOptions& options) {
  expect_one_search(options.runs, options.out);
  const std::string folder = (fs::path(options.out) / "motions").string();
  const sysid::MotionStore store(folder);
  int taken = 0;
  for (const std::string& run : options.runs) {
    const std::string from = (fs::path(run) / "motions").string();
    if (fs::equivalent(from, folder)) continue;
    end_after_signal();
    const int of_run = store.take_from(from);
    say(options.common, run + ": " + std::to_string(of_run) + " motions");
    taken += of_run;
  }
  if (options.common.json)
    std::cout << data::format_json(
        nlohmann::ordered_json{{"schema", "flash-sysid-merge/1"}, {"motions", folder}, {"taken", taken}});
  else
    std::printf("%s\n", folder.c_str());
  return exit_done;
}

}  // namespace

void add_merge_verb(CLI::App& app, Action& action) {
  const auto options = std::make_shared<MergeOptions>();
  CLI::App* verb = app.add_subcommand("merge", "Bring the motions of shares of one search together");
  verb->add_option("run", options->runs, "Folders that grid --shard I/N --own-share wrote")->required();
  verb->add_option("-o,--out", options->out, "Folder of the search, for grid --resume")->required();
  add_common_options(*verb, options->common);
  verb->footer(
      "Example:\n"
      "  flash-sysid merge run_1 run_2 run_3 -o run\n"
      "  flash-sysid grid lift_a --asset towel.json --bending 1e-6:1e-3:8:log --resume -o run");
  verb->callback([options, &action] { action = [options] { return run_merge(*options); }; });
}

}  // namespace flash
