#pragma once
#include <functional>

namespace CLI {
class App;
}

namespace flash {

/// What the chosen verb does; its result is the exit code.
using Action = std::function<int()>;

/// Each adds one verb to `flash-sim`; parsing it sets `action`.
void add_run_verb(CLI::App& app, Action& action);
void add_bench_verb(CLI::App& app, Action& action);
void add_mesh_verb(CLI::App& app, Action& action);
void add_picture_verb(CLI::App& app, Action& action);

}  // namespace flash
