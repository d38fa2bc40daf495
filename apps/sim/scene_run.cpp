#include "apps/sim/scene_run.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>
#include <utility>

#include "apps/sim/environment_table.h"
#include "apps/sim/scene_observer.h"
#include "apps/sim/scene_writer.h"
#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/text.h"
#include "sim/scene_worlds.h"

namespace flash::sim {
namespace {

/// A scene under way: the objects as environment 0 has them, their worlds, and what is said and written.
struct RunningScene {
  const data::Scene& scene;
  const SceneRun& run;
  int steps;
  std::vector<SceneBody> bodies;
  std::vector<Worlds> worlds;
  SceneWriter writer;
  SceneObserver observer;
  std::vector<EnvironmentFigures> figures;  ///< of each environment where there are several
  std::string environments_file;

  void write_tables() {
    writer.write_tables();
    if (!figures.empty())
      data::write_atomically(environments_file, environment_table(run.variations, figures));
  }
};

/// Throws for what the solver has refused, and for a grasp of nothing. Numbers that are none end the run:
/// true.
bool ends_here(const RunningScene& at, SceneSummary& summary) {
  for (std::size_t b = 0; b < at.worlds.size(); ++b) {
    const std::string& why = at.worlds[b].why_lost(0);
    if (why.empty()) continue;
    if (at.worlds[b].lost(0) != Lost::not_finite) throw data::InputError(at.scene.source + ": " + why);
    summary.warnings.push_back(at.bodies[b].name + ": " + why + ": the run ends there");
    return true;
  }
  return false;
}

/// Of an object of one body of triangles, as it stands [J].
double gravitational_energy(const SceneBody& body) {
  const Environment& environment = body.environment;
  const Eigen::VectorXd heights = environment.state.positions * environment.gravity;
  return -environment.materials[0].areal_density * body.sheet.vertex_area.dot(heights);
}

bool motions_are_over(const std::vector<Worlds>& worlds) {
  return std::all_of(worlds.begin(), worlds.end(), [](const Worlds& of_object) {
    for (int e = 0; e < of_object.size(); ++e)
      if (!motion_is_over(of_object.environment(e))) return false;
    return true;
  });
}

bool all_converged(const std::vector<Worlds>& worlds) {
  return std::all_of(worlds.begin(), worlds.end(), [](const Worlds& of_object) {
    for (int e = 0; e < of_object.size(); ++e)
      if (!of_object.report(e).converged) return false;
    return true;
  });
}

/// Takes step `number` and writes it. Returns whether the run is done.
bool take_step(RunningScene& at, int number, SceneSummary& summary) {
  step(at.worlds, at.run.threads);
  const bool ends = ends_here(at, summary);
  if (number == 1) at.writer.begin();  // what the first step refuses leaves nothing behind
  std::vector<StepReport> reports;
  for (std::size_t b = 0; b < at.bodies.size(); ++b) {
    at.bodies[b].environment.state = at.worlds[b].environment(0).state;
    reports.push_back(at.worlds[b].report(0));
    if (at.run.device.device == Device::cuda)
      reports.back().gravitational = gravitational_energy(at.bodies[b]);
  }
  const double time =
      at.bodies.empty() ? number * at.scene.time_step : at.bodies.front().environment.state.time;
  at.writer.add_step(number, time, at.bodies, reports);
  at.observer.see(at.bodies, reports, time, at.scene.time_step, summary);
  add_step(at.worlds, at.figures);
  summary.steps = number;
  bool done = ends;
  if (at.scene.rest_motion) {
    summary.last_motion = at.scene.time_step * stop_motion(at.worlds);
    summary.at_rest = motions_are_over(at.worlds) && all_converged(at.worlds) &&
                      summary.last_motion <= *at.scene.rest_motion;
    done = done || *summary.at_rest;
  }
  if (at.writer.wants_frame(number) || (at.scene.rest_motion && (done || number == at.steps))) {
    at.writer.write_frame(number, at.bodies);
    if (at.run.contacts) {
      std::vector<std::vector<ContactForce>> contacts;
      for (const Worlds& of_object : at.worlds) contacts.push_back(of_object.contacts(0));
      at.writer.write_contacts(number, time, at.bodies, contacts);
    }
  }
  at.writer.write_tables_at_times();
  return done;
}

void take_steps(RunningScene& at, const std::function<void()>& begins, SceneSummary& summary) {
  const auto goes_on = [&](int done) {
    if (at.run.progress && !at.run.progress(done, at.steps)) summary.interrupted = done < at.steps;
    return !summary.interrupted;
  };
  try {
    bool goes = goes_on(0);
    if (at.steps == 0) at.writer.begin();
    begins();
    for (int number = 1; number <= at.steps && goes; ++number) {
      const bool done = take_step(at, number, summary);
      goes = goes_on(number) && !done;
    }
  } catch (...) {
    if (summary.steps > 0) at.write_tables();
    throw;
  }
  at.write_tables();
}

}  // namespace

SceneSummary run_scene(const data::Scene& scene, const SceneRun& run, const std::string& output_dir) {
  const auto start = std::chrono::steady_clock::now();
  SceneSummary summary;
  summary.notices = scene.notices;
  summary.environments = run.environments;
  const int steps = run.steps >= 0 ? run.steps : scene.steps;
  std::vector<SceneBody> bodies = scene_bodies(scene, steps, summary.notices);
  if (scene.steps_by_default && run.steps < 0)
    summary.notices.push_back(scene.source + ": names no length: " + std::to_string(scene.steps) +
                              " steps are run, the default");
  if (run.device.device == Device::cuda)
    summary.notices.push_back(scene.source +
                              ": a CUDA device does not tell what is held inside obstacles or starts there");
  if (run.notice)
    for (const std::string& notice : summary.notices) run.notice(notice);

  const auto begins = [&](const std::string& what) {
    if (run.phase) run.phase(what);
  };
  const std::string size =
      data::format_count(vertices_of(bodies)) + " vertices" +
      (run.environments > 1 ? " in " + data::format_count(std::size_t(run.environments)) + " environments"
                            : "");
  begins("setting up " + size);
  std::vector<Worlds> worlds =
      scene_worlds(scene, bodies, run.environments, run.variations, run.threads, run.device);
  SceneWriter writer(scene, bodies, steps, run.contacts, output_dir);
  SceneObserver observer(bodies.size());
  RunningScene running{
      .scene = scene,
      .run = run,
      .steps = steps,
      .bodies = std::move(bodies),
      .worlds = std::move(worlds),
      .writer = std::move(writer),
      .observer = std::move(observer),
      .figures = {},
      .environments_file = (std::filesystem::path(output_dir) / "environments.csv").string()};
  if (run.environments > 1) running.figures.resize(std::size_t(run.environments));
  summary.self_contact = scene.self_contact.has_value();
  take_steps(
      running, [&] { begins("solving the first step of " + size); }, summary);
  running.observer.conclude(scene, running.bodies, summary);
  for (std::size_t e = 0; e < running.figures.size(); ++e) {
    if (is_usable(running.figures[e])) continue;
    if (summary.unusable_environments++ > 0) continue;
    const std::string& why = running.figures[e].why_lost;
    summary.first_unusable = "environment " + std::to_string(e) + (why.empty() ? "" : ": " + why);
  }
  summary.frames = running.writer.frames();
  summary.wall_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return summary;
}

}  // namespace flash::sim
