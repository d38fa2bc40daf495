#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/calib/options.h"
#include "apps/calib/verbs.h"
#include "apps/calib/watch_server.h"
#include "apps/command_line/command_line.h"
#include "apps/command_line/option_checks.h"
#include "calib/watch/recordings_in.h"
#include "calib/watch/watch_folder.h"
#include "calib/watch/watch_page.h"
#include "data/files/error.h"

namespace flash {
namespace {

struct WatchOptions {
  CalibCommonOptions common;
  DatasetChoice dataset;
  std::string setup;
  LensOption lens;
  std::optional<double> target_size_sd = {};
  bool size_as_stated = false;
  PlanBounds bounds;
  int port = 8050;
};

void expect_one_camera(const std::string& folder) {
  if (!std::filesystem::is_directory(folder))
    throw data::InputError(folder + ": no such folder; watch follows one that is there, and may be empty");
  const std::vector<std::string> recordings = calib::recordings_in(folder);
  if (recordings.empty()) return;
  std::string names;
  for (const std::string& name : recordings) names += (names.empty() ? "" : ", ") + name;
  throw data::InputError(
      folder + ": found the recordings of cameras in " + names +
      ", expected one of them: " + (std::filesystem::path(folder) / recordings.front()).string());
}

calib::WatchSettings settings_of(const WatchOptions& options) {
  calib::WatchSettings settings;
  settings.folder = std::filesystem::path(options.dataset.path).lexically_normal().string();
  settings.dataset = dataset_options(options.dataset);
  if (!options.setup.empty()) settings.setup = calib::parse_setup(options.setup, "command line", "--setup");
  if (!options.dataset.target.empty()) settings.target = target_named(options.dataset.target);
  settings.detect.threads = 1;
  settings.detect.cache = options.dataset.cache;
  if (!options.common.quiet) settings.detect.tell = warn_calib;
  settings.calibrate.lens = options.lens.knowledge;
  settings.calibrate.target_size_sd = options.target_size_sd;
  settings.calibrate.size_as_stated = options.size_as_stated;
  settings.calibrate.threads = options.common.threads;
  settings.plan = plan_settings(options.bounds);
  return settings;
}

int run_watch(WatchOptions options) {
  expect_no_camera(options.lens, options.dataset.camera);
  if (!options.lens.own.empty()) options.dataset.camera = options.lens.own;
  expect_one_camera(options.dataset.path);
  for (const auto& [name, path] :
       {std::pair{"--camera", &options.dataset.camera}, {"--robot", &options.dataset.robot}})
    if (!path->empty() && !std::filesystem::exists(*path))
      throw data::InputError(std::string(name) + ": found " + *path + ", expected a file that is there");
  const calib::WatchSettings settings = settings_of(options);
  WatchServer server(calib::watch_page(settings.folder), options.port);
  const std::atomic<bool>& stop = end_on_signals();
  const std::string address = "http://127.0.0.1:" + std::to_string(server.port()) + "/";
  if (options.common.json)
    std::cout << nlohmann::ordered_json{{"schema", "flash-watch-address/1"}, {"address", address}}.dump()
              << std::endl;
  else
    std::cout << "watching " << settings.folder << " at " << address << " (Ctrl-C ends it)" << std::endl;
  calib::watch_folder(settings, stop, [&](calib::WatchMoment moment) {
    server.show(calib::to_json(moment.state).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace),
                std::move(moment.picture));
  });
  return exit_done;
}

}  // namespace

void add_watch_verb(CLI::App& app, Action& action) {
  const auto options = std::make_shared<WatchOptions>();
  CLI::App* verb = app.add_subcommand(
      "watch", "A page that follows a recording: what was found, what is not covered, the next pose");
  add_dataset_options(*verb, options->dataset);
  add_link_option(*verb, options->dataset);
  add_setup_option(*verb, options->setup);
  add_lens_option(*verb, options->lens);
  add_target_size_options(*verb, options->target_size_sd, options->size_as_stated);
  add_plan_bounds(*verb, options->bounds);
  verb->add_flag("--no-depth", options->dataset.no_depth, "Leave depth pictures out");
  verb->add_option("--port", options->port, "Of the page, at 127.0.0.1; 0: any that is free")
      ->check(whole_number(0, 65535))
      ->capture_default_str();
  add_calib_common_options(*verb, options->common);
  verb->footer(
      "Example:\n"
      "  flash-calib watch wrist --setup eye-in-hand --target chessboard:9x6:0.025");
  verb->callback([options, &action] { action = [options] { return run_watch(*options); }; });
}

}  // namespace flash
