#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <stop_token>
#include <thread>
#include <utility>

#include "apps/command_line/command_line.h"
#include "apps/command_line/option_checks.h"
#include "apps/sim/scene_run.h"
#include "apps/sim/verbs.h"
#include "data/files/error.h"
#include "data/files/folder_lock.h"
#include "data/files/json_reader.h"
#include "data/files/message_line.h"
#include "data/files/text.h"
#include "data/files/writable.h"
#include "data/scene/scene.h"
#include "sim/newton/accepted.h"

namespace flash {
namespace {

struct RunOptions {
  std::string scene, out, device = "auto";
  int threads = 0, steps = -1;
  std::optional<double> duration;  // [s]
  int environments = 1;
  std::string vary;
  bool no_self_contact = false, contacts = false, quiet = false, verbose = false, json = false, force = false;
};

/// A line on stderr about what is being done, where that takes longer than two seconds.
class SaidWhenSlow {
 public:
  explicit SaidWhenSlow(std::string line)
      : thread_([line = std::move(line)](const std::stop_token& done) {
          std::mutex mutex;
          std::unique_lock lock(mutex);
          std::condition_variable_any never;
          never.wait_for(lock, done, std::chrono::seconds(2), [] { return false; });
          if (!done.stop_requested()) std::cerr << data::message_line(line) << '\n';
        }) {}

 private:
  std::jthread thread_;
};

/// Rate and time left, drawn over itself, once a run has taken two seconds.
class ProgressLine {
 public:
  explicit ProgressLine(bool visible) : visible_(visible && isatty(STDERR_FILENO) != 0) {}
  ~ProgressLine() {
    if (drawn_) std::cerr << '\n';
  }
  void show(int done, int steps) {
    const auto now = std::chrono::steady_clock::now();
    const double seconds = std::chrono::duration<double>(now - start_).count();
    if (!visible_ || seconds < 2 || (now - last_ < std::chrono::milliseconds(100) && done < steps)) return;
    last_ = now;
    drawn_ = true;
    const double rate = done / seconds;
    std::fprintf(stderr, "\rstep %d of %d, %.0f/s, %.0f s left\033[K", done, steps, rate,
                 (steps - done) / rate);
  }

 private:
  bool visible_, drawn_ = false;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now(), last_{};
};

void print_json(const sim::SceneSummary& summary, const std::string& out, int exit_code) {
  std::vector<std::string> warnings = summary.notices;
  warnings.insert(warnings.end(), summary.warnings.begin(), summary.warnings.end());
  nlohmann::ordered_json json = {{"schema", "flash-sim-summary/1"},
                                 {"out", out},
                                 {"steps", summary.steps},
                                 {"unconverged_steps", summary.unconverged_steps},
                                 {"residual_max", summary.residual_max},
                                 {"halved_steps", summary.halved_steps},
                                 {"penetration_max_m", summary.penetration_max},
                                 {"held_penetration_max_m", summary.held_penetration_max},
                                 {"start_penetration_max_m", summary.start_penetration_max},
                                 {"collapsed_elements", summary.collapsed_elements},
                                 {"iterations", summary.iterations},
                                 {"frames", summary.frames},
                                 {"wall_seconds", summary.wall_seconds},
                                 {"interrupted", summary.interrupted},
                                 {"at_rest", nullptr},
                                 {"warnings", warnings},
                                 {"exit_code", exit_code}};
  if (summary.at_rest) json["at_rest"] = *summary.at_rest;
  if (summary.self_contact) {
    json["layer_distance_min_m"] = summary.layer_distance_min;
    json["layer_touches_max"] = summary.layer_touches_max;
  }
  if (summary.environments > 1) {
    json["environments"] = summary.environments;
    json["unusable_environments"] = summary.unusable_environments;
  }
  std::cout << data::format_json(json);
}

int steps_to_run(const RunOptions& options, const data::Scene& scene) {
  if (!options.duration) return options.steps;
  const int steps = data::steps_of(*options.duration, scene.time_step);
  if (steps < 0)
    throw data::InputError("--duration: found " + data::format_short(*options.duration) +
                           " s, expected at most the " +
                           data::format_short(data::max_steps * scene.time_step) + " s of " +
                           data::format_count(data::max_steps) + " steps");
  return steps;
}

/// What a run that was stopped leaves, and how to go on.
void say_what_is_left(const sim::SceneSummary& summary, int steps, const std::string& tables,
                      const std::string& out) {
  std::cerr << "flash-sim: stopped after " << data::format_count(std::size_t(summary.steps)) << " of "
            << data::format_count(std::size_t(steps)) << " steps; " << out << " holds their "
            << data::format_count(std::size_t(summary.frames)) << " frames, " << tables
            << "; a run begins again from the start, with --force in the same folder\n";
}

int run(const RunOptions& options) {
  namespace fs = std::filesystem;
  data::check_folder_free(options.out, options.force);
  std::optional<data::RunFolder> folder;
  const auto hold_folder = [&] {
    if (folder) return;
    folder.emplace(options.out);
    data::check_folder_free(options.out, options.force);  // a run that has just ended may have filled it
  };
  if (fs::exists(options.out)) hold_folder();  // else at the first step: until then a signal leaves nothing
  std::optional<SaidWhenSlow> phase;
  const auto begin = [&](const std::string& what) {
    if (!options.quiet) phase.emplace(what + " ...");
  };
  sim::SceneRun settings;
  settings.environments = options.environments;
  if (!options.vary.empty()) settings.variations = sim::parse_variations(options.vary, "--vary");
  if (!settings.variations.empty() && settings.environments < 2)
    throw data::InputError(
        "--vary: found one environment, expected --envs of 2 or more: the first is the scene itself");
  settings.device = sim::choose_device(options.device == "auto" ? "cpu" : options.device);
  if (settings.device.cuda_devices.size() > 1)
    throw data::InputError("--device " + options.device +
                           ": found several devices, expected one: a run is "
                           "not shared out");
  if (settings.device.device == sim::Device::cuda && options.contacts)
    throw data::InputError("--contacts: forces of each contact are told on the CPU alone; use --device cpu");
  begin("reading " + options.scene);
  data::Scene scene = data::load_scene(options.scene);
  const bool loses_layers = options.no_self_contact && scene.self_contact;
  if (loses_layers) scene.self_contact.reset();
  ProgressLine progress(!options.quiet);
  settings.steps = steps_to_run(options, scene);
  settings.contacts = options.contacts;
  settings.threads =
      options.threads > 0 ? options.threads : int(std::max(1u, std::thread::hardware_concurrency()));
  settings.notice = [&](const std::string& notice) {
    if (!options.quiet) std::cerr << data::message_line(notice) << '\n';
  };
  if (loses_layers)
    settings.notice("--no-self-contact: objects pass through themselves and each other, against " +
                    options.scene);
  settings.phase = begin;
  settings.progress = [&](int done, int steps) {
    phase.reset();
    const std::atomic<bool>& stop = stop_on_signals();  // until the first step there is nothing to keep
    hold_folder();
    progress.show(done, steps);
    return !stop;
  };
  const sim::SceneSummary summary = sim::run_scene(scene, settings, options.out);

  if (summary.interrupted)
    say_what_is_left(
        summary, settings.steps < 0 ? scene.steps : settings.steps,
        options.contacts ? "contacts, log.csv, forces.csv and resultants.csv" : "log.csv and forces.csv",
        options.out);
  const double unconverged_share = double(summary.unconverged_steps) / std::max(1, summary.steps);
  const bool moves = !summary.at_rest.value_or(true);
  const bool unusable = !sim::accepted(unconverged_share, summary.residual_max) || moves ||
                        summary.collapsed_elements > 0 || summary.unusable_environments > 0;
  const int exit_code = summary.interrupted ? exit_failed : unusable ? exit_unusable : exit_done;
  if (moves && !summary.interrupted)
    std::cerr << "flash-sim: warning: not at rest after " << summary.steps << " steps: "
              << (summary.last_motion > scene.rest_motion.value_or(0)
                      ? "a vertex still moves " + data::format_short(summary.last_motion) +
                            " m a step; allow more steps or longer ones\n"
                  : summary.unconverged_steps > 0
                      ? "nothing moves, but steps are not solved; take shorter ones\n"
                      : "nothing moves, but a grasp or a trajectory goes on; allow more steps\n");
  for (const std::string& warning : summary.warnings) std::cerr << "flash-sim: warning: " << warning << '\n';
  if (summary.unconverged_steps > 0)
    std::cerr << "flash-sim: warning: " << summary.unconverged_steps << " of " << summary.steps
              << " steps did not converge; worst residual " << data::format_short(summary.residual_max)
              << ", worst complementarity " << data::format_short(summary.complementarity_max)
              << " m; where both are small, energy came from nothing"
              << (summary.self_contact ? ", or layers kept what a hold carries from its place" : "")
              << " (accepted: 1 in 100, and 1; see " << (fs::path(options.out) / "log.csv").string() << ")\n";
  const std::string environments = (fs::path(options.out) / "environments.csv").string();
  if (summary.unusable_environments > 0)
    std::cerr << "flash-sim: warning: " << summary.unusable_environments << " of " << summary.environments
              << " environments are not to be used (" << environments << "); the first is "
              << summary.first_unusable << '\n';
  if (options.json) {
    print_json(summary, options.out, exit_code);
  } else if (!options.quiet) {
    const std::string in_parts =
        summary.halved_steps > 0 ? " (" + std::to_string(summary.halved_steps) + " of them in parts)" : "";
    std::printf(
        "%d steps%s in %.1f s, %.1f Newton iterations a step, residual at most %s, penetration at most %s "
        "m\n",
        summary.steps, in_parts.c_str(), summary.wall_seconds,
        double(summary.iterations) / std::max(1, summary.steps),
        data::format_short(summary.residual_max).c_str(),
        data::format_short(summary.penetration_max).c_str());
    if (summary.layer_touches_max > 0)
      std::printf("layers touched at up to %d places, no nearer than %s m\n", summary.layer_touches_max,
                  data::format_short(summary.layer_distance_min).c_str());
    if (summary.environments > 1)
      std::printf("%d environments, %.3g ms a step and environment; those above are of environment 0\n",
                  summary.environments,
                  1e3 * summary.wall_seconds / std::max(1, summary.steps) / summary.environments);
    std::printf("%s: %d frames, log.csv, forces.csv%s%s\n", options.out.c_str(), summary.frames,
                options.contacts ? ", contacts, resultants.csv" : "",
                summary.environments > 1 ? ", environments.csv" : "");
  }
  return exit_code;
}

}  // namespace

void add_run_verb(CLI::App& app, Action& action) {
  CLI::App& verb = *app.add_subcommand("run", "Run a scene; write its frames, log.csv and forces.csv");
  const auto options = std::make_shared<RunOptions>();
  verb.footer(
      "Up to 1 % of the steps may end above the tolerance, none out of balance by more than the weight (a\n"
      "residual of 1), and no tetrahedron below a thousandth of its rest volume: else the exit code is 3.\n"
      "A scene that names neither steps nor duration runs 100 steps.\n"
      "Examples:\n"
      "  flash-sim run scene.json -o out\n"
      "  flash-sim run scene.json -o out --envs 64 --vary bending=0.5:2:log,friction=0.2:0.8\n"
      "  flash-sim run scene.json -o out --envs 256 --device cuda");
  verb.add_option("scene", options->scene, "Scene file (.json)")->required();
  verb.add_option("-o,--out", options->out, "Folder to write")->required();
  verb.add_option("--device", options->device,
                  "Where the simulation runs: cpu, cuda or cuda:1, by number; auto: the CPU")
      ->capture_default_str();
  verb.add_option("--envs", options->environments,
                  "Environments of the scene, side by side; frames and tables are those of the first")
      ->check(whole_number(1, 100'000))
      ->capture_default_str();
  verb.add_option(
      "--vary", options->vary,
      "By which the others differ from the scene: factors on young, bending, density or friction, "
      "as bending=0.5:2:log,friction=0.2:0.8");
  verb.add_option("--threads", options->threads,
                  "Objects, or environments of each, that step at the same time; 0: one a processor")
      ->check(thread_number())
      ->capture_default_str();
  verb.add_option("--steps", options->steps, "In place of the scene's")
      ->check(whole_number(0, data::max_steps));
  verb.add_option("--duration", options->duration, "In place of the scene's [s]")
      ->check(number_from(0))
      ->excludes("--steps");
  verb.add_flag("--no-self-contact", options->no_self_contact,
                "Objects pass through themselves and each other, whatever the scene says");
  verb.add_flag(
      "--contacts", options->contacts,
      "Write contacts/, the force of each contact, and resultants.csv, of each body, at each frame");
  verb.add_flag("--json", options->json, "Print the summary as JSON on stdout");
  CLI::Option* quiet = verb.add_flag("--quiet", options->quiet, "Print nothing but errors and warnings");
  verb.add_flag("--verbose", options->verbose, "Print every notice (the default)")->excludes(quiet);
  verb.add_flag("--force", options->force, "Write over what is there");
  verb.callback([&action, options] { action = [options] { return run(*options); }; });
}

}  // namespace flash
