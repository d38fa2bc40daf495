#include <CLI/CLI.hpp>

#include "apps/command_line/command_line.h"
#include "apps/command_line/spared_inputs.h"
#include "apps/sysid/verbs.h"

int main(int argc, char** argv) {
  CLI::App app("From recorded interactions to the material of a deformable object, with how sure it is.",
               "flash-sysid");
  app.set_version_flag("--version", FLASH_VERSION);
  app.set_config("--config", "", "Read options from a TOML file; the command line counts more");
  app.require_subcommand(1);
  app.footer(
      "A first run, from nothing:\n"
      "  flash-sysid synth --asset cloth.json --mesh sheet:0.4x0.4:0.02 -o recording\n"
      "  flash-sysid grid recording --asset cloth.json --bending 1e-6:1e-3:8:log -o run\n"
      "  flash-sysid export run -o tuned.json\n"
      "Exit codes: 0 done; 1 failed; 2 bad usage or input; 3 finished, but the answer cannot be used.");
  flash::Action action;
  flash::add_grid_verb(app, action);
  flash::add_replay_verb(app, action);
  flash::add_fit_verb(app, action);
  flash::add_merge_verb(app, action);
  flash::add_predict_verb(app, action);
  flash::add_compare_verb(app, action);
  flash::add_plan_verb(app, action);
  flash::add_repeatability_verb(app, action);
  flash::add_synth_verb(app, action);
  flash::add_import_verb(app, action);
  flash::add_segment_verb(app, action);
  flash::add_export_verb(app, action);
  flash::add_report_verb(app, action);
  return flash::run_tool(app, argc, argv, [&] {
    flash::expect_spared_inputs(app);
    return action();
  });
}
