#include <CLI/CLI.hpp>

#include "apps/calib/verbs.h"
#include "apps/command_line/command_line.h"

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
  flash::add_watch_verb(app, action);
  flash::add_export_verb(app, action);
  return flash::run_tool(app, argc, argv, [&] { return action(); });
}
