#include "sim/scene_worlds.h"

#include <algorithm>
#include <utility>

#include "data/files/error.h"
#include "data/files/text.h"
#include "data/machine/memory_limit.h"
#include "data/machine/parallel.h"
#include "data/numbers/worst.h"
#include "sim/newton/solver_memory.h"
#include "sim/step/body_law.h"

namespace flash::sim {
namespace {

void check_memory(const data::Scene& scene, const std::vector<SceneBody>& bodies, int environments) {
  double needed = 0;
  for (const SceneBody& body : bodies) needed += environments * solver_bytes(body.sheet);
  const double limit = data::memory_limit();
  if (limit <= 0 || needed <= limit) return;
  const auto megabytes = [](double bytes) {
    return data::format_count(static_cast<std::size_t>(1e-6 * bytes));
  };
  throw data::input_error(
      scene.source, "objects",
      data::format_count(vertices_of(bodies)) + " vertices" +
          (environments > 1 ? " in " + data::format_count(static_cast<std::size_t>(environments)) +
                                  " environments take about "
                            : " take about ") +
          megabytes(needed) + " MB of memory, expected at most the " + megabytes(limit) +
          " MB that there are; " +
          (environments > 1 ? "fewer environments or a coarser mesh are needed"
                            : "a coarser mesh is needed"));
}

void check_method(const data::SceneSolver& solver, const SceneBody& body) {
  if (solver.integrator == "newton") return;
  if (has_solids(body.sheet))
    throw data::InputError("solver.type " + solver.integrator + ": " + body.name +
                           " is a solid (element_type TETRAHEDRON), which type newton simulates alone");
  if (!body.environment.point_masses.empty())
    throw data::InputError("solver.type " + solver.integrator + ": " + body.name +
                           " has an attached_mass, which type newton simulates alone");
}

void check_variations(const std::vector<SceneBody>& bodies, const std::vector<Variation>& variations) {
  for (const Variation& variation : variations)
    if (std::none_of(bodies.begin(), bodies.end(),
                     [&](const SceneBody& body) { return applies(variation, body.environment); }))
      throw data::InputError("--vary " + variation.name +
                             ": no object has it, or only as 0, which no factor changes");
}

WorldSettings settings_of(const data::SceneSolver& solver, double time_step) {
  WorldSettings worlds;
  // A run is not to be gone on with from one of its states.
  worlds.restart_interval = 0;
  if (solver.integrator == "newton") {
    worlds.solver.time_step = time_step;
    worlds.solver.max_iterations = solver.max_iterations;
    worlds.solver.tolerance = solver.tolerance;
    worlds.solver.exit_speed = solver.exit_speed;
    return worlds;
  }
  ProjectiveSettings& settings = worlds.projective.emplace();
  settings.time_step = time_step;
  settings.iterations = solver.max_iterations;
  settings.tolerance = solver.tolerance;
  settings.metric = solver.constraint_solver.starts_with("Lite")        ? ContactMetric::inertia
                    : solver.constraint_solver.starts_with("NonSmooth") ? ContactMetric::full
                                                                        : ContactMetric::automatic;
  settings.constraints.iterations = solver.constraint_iterations;
  settings.constraints.tolerance = solver.constraint_tolerance;
  settings.constraints.max_force = solver.max_force;
  settings.constraints.linear.solver = dual_solver_from_name(solver.constraint_linear_solver);
  return worlds;
}

Worlds worlds_of(const SceneBody& body, int environments, const std::vector<Variation>& variations,
                 const WorldSettings& settings) {
  const auto plan = make_sheet_plan(body.sheet);
  body_laws(*plan, body.environment);  // refuses materials by their own name
  std::vector<Environment> all;
  for (int e = 0; e < environments; ++e) all.push_back(varied(body.environment, variations, e));
  return {plan, std::move(all), settings};
}

}  // namespace

std::size_t vertices_of(const std::vector<SceneBody>& bodies) {
  std::size_t vertices = 0;
  for (const SceneBody& body : bodies) vertices += static_cast<std::size_t>(body.sheet.rest.vertices.rows());
  return vertices;
}

std::vector<Worlds> scene_worlds(const data::Scene& scene, const std::vector<SceneBody>& bodies,
                                 int environments, const std::vector<Variation>& variations, int threads,
                                 const DeviceChoice& device, const std::atomic<bool>* stop) {
  if (device.device == Device::cpu) check_memory(scene, bodies, environments);
  std::vector<Worlds> worlds;
  try {
    check_variations(bodies, variations);
    WorldSettings settings = settings_of(scene.solver, scene.time_step);
    settings.threads = environments > 1 ? threads : 1;
    settings.solver.stop = stop;
    settings.device = device.device;
    if (!device.cuda_devices.empty()) settings.cuda_device = device.cuda_devices.front();
    for (const SceneBody& body : bodies) {
      check_method(scene.solver, body);
      worlds.push_back(worlds_of(body, environments, variations, settings));
    }
  } catch (const data::InputError& error) {
    throw data::InputError(scene.source + ": " + error.what());  // what refuses knows no files
  }
  return worlds;
}

void step(std::vector<Worlds>& worlds, int threads, int count) {
  const bool alone = worlds.empty() || worlds.front().size() == 1;  // else environments share the threads
  data::for_each_in_parallel(worlds.size(), alone ? threads : 1,
                             [&](std::size_t b) { worlds[b].step(count); });
}

double stop_motion(std::vector<Worlds>& worlds) {
  double fastest = 0;
  for (Worlds& of_object : worlds) {
    for (int e = 0; e < of_object.size(); ++e)
      fastest = std::max(fastest, of_object.environment(e).state.velocities.rowwise().norm().maxCoeff());
    const Tensor now = of_object.velocities();
    const std::vector<double> still(static_cast<std::size_t>(now.shape[0] * now.shape[1] * now.shape[2]),
                                    0.0);
    of_object.set_velocities({}, {.data = still.data(), .shape = now.shape});
  }
  return fastest;
}

void merge(const WorldStatus& other, WorldStatus& status) {
  status.converged = std::min(status.converged, other.converged);
  status.residual = data::worst(status.residual, other.residual);
  status.penetration = data::worst(status.penetration, other.penetration);
  status.parts = std::max(status.parts, other.parts);
  if (status.lost == 0) status.lost = other.lost;
}

}  // namespace flash::sim
