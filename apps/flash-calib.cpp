#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <string>
#include <vector>

#include "apps/calib_verbs.h"
#include "apps/command_line.h"
#include "data/json_reader.h"

int main(int argc, char** argv) {
  CLI::App app("Where the cameras are: from pictures and robot poses to a transform, with how sure it is.",
               "flash-calib");
  app.set_version_flag("--version", FLASH_VERSION);
  app.set_config("--config", "", "Read options from a TOML file; the command line counts more");
  app.require_subcommand(1);
  app.footer(
      "Exit codes: 0 done; 1 failed; 2 bad usage or input; 3 finished, but the answer cannot be used.");
  flash::Action action;
  flash::add_detect_verb(app, action);
  flash::add_intrinsics_verb(app, action);
  flash::add_validate_verb(app, action);
  flash::add_handeye_verb(app, action);
  flash::add_register_verb(app, action);
  flash::add_plan_verb(app, action);
  // CLI11 would only say that a verb is missing.
  std::vector<std::string> verbs;
  for (const CLI::App* verb : app.get_subcommands(nullptr)) verbs.push_back(verb->get_name());
  if (argc > 1 && argv[1][0] != '-' && std::find(verbs.begin(), verbs.end(), argv[1]) == verbs.end()) {
    const std::string nearest = flash::data::nearest_name(argv[1], verbs);
    std::cerr << "flash-calib: " << argv[1] << ": unknown verb"
              << (nearest.empty() ? " (see --help)" : " (did you mean \"" + nearest + "\"?)") << '\n';
    return flash::exit_bad_input;
  }
  return flash::run_tool(app, argc, argv, [&] { return action(); });
}
