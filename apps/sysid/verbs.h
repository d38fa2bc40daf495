#pragma once
#include <functional>

namespace CLI {
class App;
}

namespace flash {

/// What the chosen verb does; its result is the exit code.
using Action = std::function<int()>;

/// Each adds one verb to `flash-sysid`; parsing it sets `action`.
void add_grid_verb(CLI::App& app, Action& action);
void add_replay_verb(CLI::App& app, Action& action);
void add_merge_verb(CLI::App& app, Action& action);
void add_fit_verb(CLI::App& app, Action& action);
void add_plan_verb(CLI::App& app, Action& action);
void add_predict_verb(CLI::App& app, Action& action);
void add_compare_verb(CLI::App& app, Action& action);
void add_repeatability_verb(CLI::App& app, Action& action);
void add_synth_verb(CLI::App& app, Action& action);
void add_import_verb(CLI::App& app, Action& action);
void add_segment_verb(CLI::App& app, Action& action);
void add_export_verb(CLI::App& app, Action& action);
void add_report_verb(CLI::App& app, Action& action);

}  // namespace flash
