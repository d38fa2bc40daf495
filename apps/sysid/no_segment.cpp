#include <CLI/CLI.hpp>

#include "apps/sysid/verbs.h"
#include "data/files/error.h"

namespace flash {

void add_segment_verb(CLI::App& app, Action& action) {
  CLI::App* verb = app.add_subcommand(
      "segment",
      "Not in this build: cutting the cloth out of raw frames needs PCL, as a build from sources has");
  verb->allow_extras();
  verb->callback([&action] {
    action = []() -> int {
      throw data::InputError(
          "segment: this build of flash-sysid has none, as it needs PCL; build flash from "
          "its sources");
    };
  });
}

}  // namespace flash
