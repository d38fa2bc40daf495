#pragma once
#include <functional>

namespace CLI {
class App;
}

namespace flash {

/// What the chosen verb does; its result is the exit code.
using Action = std::function<int()>;

/// Each adds one verb to `flash-calib`; parsing it sets `action`.
void add_detect_verb(CLI::App& app, Action& action);
void add_intrinsics_verb(CLI::App& app, Action& action);
void add_validate_verb(CLI::App& app, Action& action);
void add_handeye_verb(CLI::App& app, Action& action);
void add_register_verb(CLI::App& app, Action& action);
void add_plan_verb(CLI::App& app, Action& action);
void add_watch_verb(CLI::App& app, Action& action);
void add_export_verb(CLI::App& app, Action& action);

}  // namespace flash
