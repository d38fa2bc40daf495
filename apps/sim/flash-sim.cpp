#include <CLI/CLI.hpp>

#include "apps/command_line/command_line.h"
#include "apps/command_line/spared_inputs.h"
#include "apps/sim/verbs.h"
#include "sim/cpu/instruction_level.h"

int main(int argc, char** argv) {
  CLI::App app("Simulates sheets by implicit Euler with contact, friction and grasps.", "flash-sim");
  app.set_version_flag("--version", [] {
    return std::string(FLASH_VERSION) + ", kernels for " + to_string(flash::sim::highest_instruction_level());
  });
  app.set_config("--config", "", "Read options from a TOML file; the command line counts more");
  app.require_subcommand(1);
  app.footer(
      "Examples:\n"
      "  flash-sim run scene.json -o out\n"
      "  flash-sim bench --vertices 1000 --envs 64 --steps 250 --threads 2\n"
      "  flash-sim mesh scan.ply -o cloth.obj --flat cloth_flat.obj\n"
      "  flash-sim picture out/frames/000100.ply table.obj -o picture.png\n"
      "Exit codes: 0 done; 1 failed; 2 bad usage or input; 3 finished, but more than 1 % of "
      "the steps did not converge, or one is out of balance by more than the weight.");
  flash::Action action;
  flash::add_run_verb(app, action);
  flash::add_bench_verb(app, action);
  flash::add_mesh_verb(app, action);
  flash::add_picture_verb(app, action);
  return flash::run_tool(app, argc, argv, [&] {
    flash::expect_spared_inputs(app);
    return action();
  });
}
