#include "apps/scene_run.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <future>
#include <map>
#include <memory>
#include <set>
#include <utility>

#include "apps/contact_tables.h"
#include "apps/csv_text.h"
#include "apps/hold_watch.h"
#include "apps/scene_warnings.h"
#include "data/atomic_file.h"
#include "data/error.h"
#include "data/memory_limit.h"
#include "data/mesh_io.h"
#include "data/text.h"
#include "data/worst.h"
#include "sim/newton/solver.h"
#include "sim/newton/solver_memory.h"
#include "sim/oracle/projective.h"
#include "sim/scene/scene.h"
#include "sim/scene/solid.h"
#include "sim/step/between_vertices.h"

namespace flash::sim {
namespace {

using Eigen::Vector3d;

/// What advances an environment, by either method.
struct Stepper {
  std::function<StepReport(Environment&)> step;
  std::function<std::vector<ContactForce>(const Environment&)> contacts;  ///< of the last step
};

template <class Method>
Stepper stepper_of(const std::shared_ptr<Method>& method) {
  return {[method](Environment& e) { return method->step(e); },
          [method](const Environment& e) { return method->contacts(e); }};
}

Stepper make_stepper(const data::SceneSolver& solver, double time_step, const SceneBody& body) {
  if (solver.integrator != "newton" && has_solids(body.sheet))
    throw data::InputError("solver.type " + solver.integrator + ": " + body.name +
                           " is a solid (element_type TETRAHEDRON), which type newton simulates alone");
  if (solver.integrator != "newton" && !body.environment.point_masses.empty())
    throw data::InputError("solver.type " + solver.integrator + ": " + body.name +
                           " has an attached_mass, which type newton simulates alone");
  if (solver.integrator == "newton") {
    SolverSettings settings;
    settings.time_step = time_step;
    settings.max_iterations = solver.max_iterations;
    settings.tolerance = solver.tolerance;
    settings.exit_speed = solver.exit_speed;
    return stepper_of(std::make_shared<Solver>(body.sheet, settings));
  }
  ProjectiveSettings settings;
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
  return stepper_of(std::make_shared<ProjectiveSolver>(body.sheet, settings));
}

/// Of what a method refuses, which knows no files.
template <class Function>
auto naming(const data::Scene& scene, const Function& function) {
  try {
    return function();
  } catch (const data::InputError& error) {
    throw data::InputError(scene.source + ": " + error.what());
  }
}

data::TriangleMesh merged(const std::vector<SceneBody>& bodies) {
  data::TriangleMesh mesh;
  Eigen::Index vertices = 0, triangles = 0;
  for (const SceneBody& body : bodies) {
    const data::Points& x = body.environment.state.positions;
    const data::Triangles t = visible_triangles(body.sheet);
    mesh.vertices.conservativeResize(vertices + x.rows(), 3);
    mesh.triangles.conservativeResize(triangles + t.rows(), 3);
    mesh.vertices.bottomRows(x.rows()) = x;
    mesh.triangles.bottomRows(t.rows()) = t.array() + int(vertices);
    vertices += x.rows();
    triangles += t.rows();
  }
  return mesh;
}

std::size_t vertices_of(const std::vector<SceneBody>& bodies) {
  std::size_t vertices = 0;
  for (const SceneBody& body : bodies) vertices += static_cast<std::size_t>(body.sheet.rest.vertices.rows());
  return vertices;
}

void check_memory(const data::Scene& scene, const std::vector<SceneBody>& bodies) {
  const std::size_t vertices = vertices_of(bodies);
  double needed = 0;
  for (const SceneBody& body : bodies) needed += solver_bytes(body.sheet);
  const double limit = data::memory_limit();
  if (limit > 0 && needed > limit)
    throw data::input_error(scene.source, "objects",
                            data::format_count(vertices) + " vertices take about " +
                                data::format_count(static_cast<std::size_t>(needed / 1e6)) +
                                " MB of memory, expected at most the " +
                                data::format_count(static_cast<std::size_t>(limit / 1e6)) +
                                " MB that there are; a coarser mesh is needed");
}

/// Whether bending yields in any of them.
bool any_yields(const std::vector<SceneBody>& bodies) {
  return std::any_of(bodies.begin(), bodies.end(), [](const SceneBody& body) {
    const auto& materials = body.environment.materials;
    return std::any_of(materials.begin(), materials.end(),
                       [](const auto& material) { return std::isfinite(material.yield_curvature); });
  });
}

std::string log_row(int step, double time, const std::vector<StepReport>& reports, bool self_contact,
                    bool yields) {
  StepReport largest, sum;
  bool converged = true;
  for (const StepReport& r : reports) {
    largest.residual = data::worst(largest.residual, r.residual);
    largest.penetration_max = data::worst(largest.penetration_max, r.penetration_max);
    largest.substeps = std::max(largest.substeps, r.substeps);
    largest.complementarity = data::worst(largest.complementarity, r.complementarity);
    sum.iterations += r.iterations;
    sum.kinetic += r.kinetic;
    sum.membrane += r.membrane;
    sum.bending += r.bending;
    sum.yielding += r.yielding;
    sum.solid += r.solid;
    sum.gravitational += r.gravitational;
    converged = converged && r.converged;
  }
  std::string row = std::to_string(step) + "," + time_text(time);
  row += "," + data::format_number(largest.residual) + "," + std::to_string(sum.iterations);
  for (double value : {largest.penetration_max, largest.complementarity, sum.kinetic,
                       sum.membrane + sum.bending + sum.solid, sum.gravitational})
    row += "," + data::format_number(value);
  row += converged ? ",1" : ",0";
  row += "," + data::format_number(sum.membrane) + "," + data::format_number(sum.bending) + "," +
         std::to_string(largest.substeps);
  if (self_contact) {
    const StepReport& r = reports.front();  // of all objects together
    row += "," + (r.layer_distance < no_layers ? data::format_number(r.layer_distance) : std::string()) +
           "," + std::to_string(r.layer_touches) + "," + std::to_string(r.layer_pairs) + "," +
           data::format_number(r.layers);
  }
  if (yields) row += "," + data::format_number(sum.yielding);
  return row + "\n";
}

std::string force_rows(double time, const std::vector<SceneBody>& bodies,
                       const std::vector<StepReport>& reports) {
  std::map<std::string, Vector3d> forces;
  const auto add = [&](const std::string& body, const Vector3d& force) {
    forces.try_emplace(body, Vector3d::Zero()).first->second += force;
  };
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const Environment& environment = bodies[b].environment;
    for (std::size_t k = 0; k < environment.holds.size(); ++k)
      add(environment.holds[k].name, reports[b].hold_forces[k]);
    for (std::size_t k = 0; k < environment.obstacles.size(); ++k)
      add(environment.obstacles[k].name, reports[b].obstacle_forces[k]);
  }
  std::string rows;
  for (const auto& [body, force] : forces) {
    rows += time_text(time) + "," + csv_field(body);
    for (double component : force) rows += "," + data::format_number(component);
    rows += "\n";
  }
  return rows;
}

/// The deepest vertex of a kind that a run has seen.
struct Deepest {
  Penetration penetration;
  std::size_t body = 0;
  double time = 0;  ///< at the end of its step [s]

  void see(const Penetration& seen, std::size_t in_body, double at) {
    if (seen.depth > penetration.depth) *this = {seen, in_body, at};
  }
  std::string place(const std::vector<SceneBody>& bodies) const {
    const SceneBody& in = bodies[body];
    return in.name + ": vertex " + std::to_string(penetration.vertex) + " is " +
           data::format_short(1e3 * penetration.depth) + " mm inside " +
           in.environment.obstacles[static_cast<std::size_t>(penetration.obstacle)].name + " at " +
           data::format_short(time) + " s";
  }
};

constexpr double told_depth = 1e-4;  ///< of vertices inside an obstacle [m]

std::set<int> frames_to_write(const data::Scene& scene, int steps) {
  std::set<int> frames;
  if (scene.keyframe_times.empty())
    for (int k = 0; k <= steps; ++k) frames.insert(k);
  for (double t : scene.keyframe_times) {
    const long k = std::lround(t / scene.time_step);
    if (k >= 0 && k <= steps) frames.insert(int(k));
  }
  return frames;
}

/// Takes away all velocity; returns the largest there was [m/s].
double stop_motion(std::vector<SceneBody>& bodies) {
  double fastest = 0;
  for (SceneBody& body : bodies) {
    data::Points& velocities = body.environment.state.velocities;
    fastest = std::max(fastest, velocities.rowwise().norm().maxCoeff());
    velocities.setZero();
  }
  return fastest;
}

}  // namespace

SceneSummary run_scene(const data::Scene& scene, const SceneRun& run, const std::string& output_dir) {
  const auto start = std::chrono::steady_clock::now();
  namespace fs = std::filesystem;
  SceneSummary summary;
  summary.notices = scene.notices;
  const int steps = run.steps >= 0 ? run.steps : scene.steps;
  std::vector<SceneBody> bodies = scene_bodies(scene, steps, summary.notices);
  check_memory(scene, bodies);
  if (scene.steps_by_default && run.steps < 0)
    summary.notices.push_back(scene.source + ": names no length: " + std::to_string(scene.steps) +
                              " steps are run, the default");
  if (run.notice)
    for (const std::string& notice : summary.notices) run.notice(notice);

  const auto begins = [&](const std::string& what) {
    if (run.phase) run.phase(what);
  };
  const std::string size = data::format_count(vertices_of(bodies)) + " vertices";
  begins("setting up " + size);
  std::vector<Stepper> steppers;
  for (const SceneBody& body : bodies)
    steppers.push_back(naming(scene, [&] { return make_stepper(scene.solver, scene.time_step, body); }));

  const std::set<int> frames = frames_to_write(scene, steps);
  const auto path_of = [&](const char* folder, int step, const char* ending) {
    char name[32];
    std::snprintf(name, sizeof name, "%06d%s", step, ending);
    return (fs::path(output_dir) / folder / name).string();
  };
  const auto write_frame = [&](int step, const data::TriangleMesh& mesh) {
    data::save_triangle_mesh(mesh, path_of("frames", step, ".ply"));
    ++summary.frames;
  };
  std::string log =
      "step,t,residual,iterations,penetration_max_m,complementarity,kinetic_J,elastic_J,potential_J,"
      "converged,membrane_J,bending_J,substeps";
  if (scene.self_contact) log += ",layer_distance_m,layer_touches,layer_pairs,layers_J";
  const bool yields = any_yields(bodies);
  log += yields ? ",yielding_J\n" : "\n";
  std::string forces = "t,body,fx,fy,fz\n", resultants = resultant_columns;
  const auto write_tables = [&] {
    data::write_atomically((fs::path(output_dir) / "log.csv").string(), log);
    data::write_atomically((fs::path(output_dir) / "forces.csv").string(), forces);
    if (run.contacts) data::write_atomically((fs::path(output_dir) / "resultants.csv").string(), resultants);
  };
  const auto write_contacts = [&](int step, double time) {
    std::vector<std::vector<ContactForce>> contacts;
    for (std::size_t b = 0; b < bodies.size(); ++b)
      contacts.push_back(steppers[b].contacts(bodies[b].environment));
    data::write_atomically(path_of("contacts", step, ".csv"), contact_table(bodies, contacts));
    resultants += resultant_rows(time, bodies, contacts);
  };

  // A run that is killed leaves them as they were some seconds before.
  auto tables_written = start;
  const auto write_tables_at_times = [&] {
    const auto now = std::chrono::steady_clock::now();
    if (now - tables_written < std::chrono::seconds(10)) return;
    write_tables();
    tables_written = now;
  };

  std::vector<StepReport> reports(bodies.size());
  summary.self_contact = scene.self_contact.has_value();
  double nearest = no_layers;  // layers at the end of a step [m]
  Deepest held, started, squeezed;
  double inside_at_end = 0;  // depth at the start of the last step [m]
  std::string holder;
  std::vector<HoldWatch> watches(bodies.size());
  std::vector<ComingThrough> deepest(bodies.size());          // at any time
  std::map<std::pair<std::size_t, int>, Collapse> collapses;  // of solids
  const auto see_collapse = [&](std::size_t b, double time) {
    for (const auto& [number, material] : bodies[b].environment.solids) {
      const Body& body = bodies[b].sheet.bodies[static_cast<std::size_t>(number)];
      const int elements = count_collapsed(bodies[b].sheet, body, bodies[b].environment.state.positions);
      Collapse& worst = collapses[{b, number}];
      if (elements > worst.elements) worst = {elements, time};
      summary.collapsed_elements = std::max(summary.collapsed_elements, elements);
    }
  };
  const data::TriangleMesh at_start = merged(bodies);
  const auto begin_writing = [&] {
    // Of a former run; its tables first, so that they never stand beside frames of this one.
    for (const char* old : {"log.csv", "forces.csv", "resultants.csv", "contacts", "frames"})
      fs::remove_all(fs::path(output_dir) / old);
    if (frames.count(0)) write_frame(0, at_start);
  };
  try {
    if (run.progress && !run.progress(0, steps)) summary.interrupted = steps > 0;
    if (steps == 0) begin_writing();
    bool done = false;
    begins("solving the first step of " + size);
    for (int step = 1; step <= steps && !summary.interrupted && !done; ++step) {
      std::vector<std::future<void>> pending;
      const auto advance = [&](std::size_t b) {
        reports[b] = naming(scene, [&] { return steppers[b].step(bodies[b].environment); });
      };
      for (std::size_t b = 0; b < bodies.size(); ++b)
        if (run.threads > 1 && b + 1 < bodies.size())
          pending.push_back(std::async(std::launch::async, advance, b));
        else
          advance(b);
      for (std::future<void>& other : pending) other.get();
      if (step == 1) begin_writing();  // what the first step refuses leaves nothing behind

      const double time = bodies.empty() ? step * scene.time_step : bodies.front().environment.state.time;
      log += log_row(step, time, reports, summary.self_contact, yields);
      forces += force_rows(time, bodies, reports);
      bool converged = true, halved = false;
      inside_at_end = 0;
      for (std::size_t b = 0; b < reports.size(); ++b) {
        const StepReport& report = reports[b];
        watches[b].see(bodies[b].environment);
        const ComingThrough through =
            deepest_between_vertices(bodies[b].sheet, bodies[b].environment, told_coming_through);
        if (through.depth > deepest[b].depth) deepest[b] = through;
        see_collapse(b, time);
        converged = converged && report.converged;
        halved = halved || report.substeps > 1;
        started.see(report.start_penetration, b, time - scene.time_step);
        inside_at_end = std::max(inside_at_end, report.start_penetration.depth);
        if (report.held_penetration.depth > held.penetration.depth)
          holder = holder_of(bodies[b].environment, report.held_penetration.vertex);
        held.see(report.held_penetration, b, time);
        if (!report.converged) squeezed.see(report.no_room, b, time);
        summary.residual_max = data::worst(summary.residual_max, report.residual);
        summary.penetration_max = data::worst(summary.penetration_max, report.penetration_max);
        summary.complementarity_max = data::worst(summary.complementarity_max, report.complementarity);
        summary.iterations += report.iterations;
        summary.layer_touches_max = std::max(summary.layer_touches_max, report.layer_touches);
        nearest = std::min(nearest, report.layer_distance);
      }
      summary.unconverged_steps += !converged;
      summary.halved_steps += halved;
      summary.steps = step;
      if (scene.rest_motion) {
        summary.last_motion = scene.time_step * stop_motion(bodies);
        const bool over = std::all_of(bodies.begin(), bodies.end(),
                                      [](const SceneBody& body) { return motion_is_over(body.environment); });
        done = over && converged && summary.last_motion <= *scene.rest_motion;
        summary.at_rest = done;
      }
      if (frames.count(step) || (scene.rest_motion && (done || step == steps))) {
        write_frame(step, merged(bodies));
        if (run.contacts) write_contacts(step, time);
      }
      write_tables_at_times();
      if (run.progress && !run.progress(step, steps)) summary.interrupted = step < steps;
    }
  } catch (...) {
    if (summary.steps > 0) write_tables();
    throw;
  }
  write_tables();
  if (nearest < no_layers) summary.layer_distance_min = nearest;
  summary.warnings = seam_warnings(bodies);
  for (const std::string& warning : stiff_mesh_warnings(bodies)) summary.warnings.push_back(warning);
  for (const auto& [solid, worst] : collapses)
    if (worst.elements > 0)
      summary.warnings.push_back(collapse_warning(bodies[solid.first], solid.second, worst));
  for (std::size_t b = 0; b < bodies.size() && !summary.interrupted && summary.steps > 0; ++b)
    for (const std::string& warning : hold_warnings(watches[b], bodies[b].environment))
      summary.warnings.push_back(bodies[b].name + ": " + warning);
  for (const std::string& warning : coming_through_warnings(bodies, deepest))
    summary.warnings.push_back(warning);
  if (!scene.rest_motion && !summary.interrupted)
    for (const std::string& warning : keyframe_warnings(scene, summary.steps))
      summary.warnings.push_back(warning);
  summary.held_penetration_max = held.penetration.depth;
  summary.start_penetration_max = started.penetration.depth;
  if (held.penetration.depth > told_depth)
    summary.warnings.push_back(held.place(bodies) + ", where " + holder +
                               " holds it: is the height of the obstacle right, or the path?");
  if (squeezed.penetration.depth > 0)
    summary.warnings.push_back(
        squeezed.place(bodies) +
        ": obstacles leave it no room, and such steps are not solved; leave room where "
        "obstacles close");
  if (started.penetration.depth > told_depth)
    summary.warnings.push_back(started.place(bodies) + ", where a step starts: the obstacle lets it out at " +
                               data::format_short(scene.solver.exit_speed) + " m/s" +
                               (inside_at_end > told_depth
                                    ? "; at the end it is still inside, by " +
                                          data::format_short(1e3 * inside_at_end) +
                                          " mm: the run is too short, or its way out would tear it"
                                    : "") +
                               "; start outside, and leave room where obstacles close");
  summary.wall_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return summary;
}

}  // namespace flash::sim
