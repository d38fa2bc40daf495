#include "sim/scene.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <future>
#include <limits>
#include <map>
#include <memory>
#include <set>
#include <utility>

#include "data/asset.h"
#include "data/atomic_file.h"
#include "data/error.h"
#include "data/mesh_io.h"
#include "data/text.h"
#include "sim/projective.h"

namespace flash::sim {
namespace {

using Eigen::Vector3d;

Obstacle obstacle_of(const data::Scene& scene, const std::string& object, const data::SceneObstacle& other) {
  Obstacle obstacle;
  obstacle.friction = data::friction_between(scene, object, other.name).value_or(-1.0);
  if (const auto* plane = std::get_if<data::ScenePlane>(&other.shape))
    obstacle.shape = Plane{plane->point, plane->normal};
  else if (const auto* box = std::get_if<data::SceneBox>(&other.shape))
    obstacle.shape = Box{0.5 * box->size, box->pose, box->trajectory};
  else if (const auto* cylinder = std::get_if<data::SceneCylinder>(&other.shape))
    obstacle.shape = Cylinder{cylinder->point, cylinder->axis, cylinder->radius};
  return obstacle;
}

void check_vertices(const data::Scene& scene, const data::SceneObject& object, const char* field,
                    const std::vector<int>& vertices, Eigen::Index count) {
  for (int vertex : vertices)
    if (vertex < 0 || vertex >= count)
      throw data::input_error(
          scene.source, "objects." + object.name + "." + field,
          "vertex " + std::to_string(vertex) + ", expected 0 to " + std::to_string(count - 1));
}

data::Points start_positions(const data::Scene& scene, const data::SceneObject& object,
                             const data::Points& rest) {
  if (object.start_mesh.empty())
    return (rest * object.base_from_object.linear().transpose()).rowwise() +
           object.base_from_object.translation().transpose();
  const data::Points start = data::load_point_cloud(object.start_mesh);
  if (start.rows() != rest.rows())
    throw data::input_error(scene.source, "objects." + object.name + ".start",
                            object.start_mesh + " has " + std::to_string(start.rows()) +
                                " vertices, the mesh " + std::to_string(rest.rows()));
  return start;
}

void add_supports(const data::Scene& scene, const data::SceneObject& object, SceneBody& body) {
  Environment& environment = body.environment;
  const data::Points& start = environment.state.positions;
  for (const data::SceneFixed& fixed : object.fixed) {
    check_vertices(scene, object, "fixed", fixed.vertices, start.rows());
    std::vector<int> vertices = fixed.vertices;
    if (fixed.all)
      for (int i = 0; i < int(start.rows()); ++i) vertices.push_back(i);
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      const bool given = fixed.positions.rows() > 0;
      const Vector3d at = given ? fixed.positions.row(Eigen::Index(i)) : start.row(vertices[i]);
      environment.fixed.push_back({vertices[i], fixed.axes, at});
    }
  }
  for (const data::SceneLoad& load : object.loads) {
    check_vertices(scene, object, "loads", load.vertices, start.rows());
    for (int vertex : load.vertices) environment.loads.push_back({vertex, load.force});
  }
  for (const data::ScenePrescribed& prescribed : object.prescribed) {
    check_vertices(scene, object, "prescribed", prescribed.vertices, start.rows());
    Grasp grasp;
    grasp.vertices = prescribed.vertices;
    grasp.gripper = prescribed.trajectory;
    grasp.from = prescribed.from;
    grasp.to = prescribed.to;
    environment.grasps.push_back(grasp);
    body.grasp_names.push_back("prescribed");
  }
}

void add_end_effectors(const data::Scene& scene, const std::string& object, SceneBody& body) {
  for (const data::SceneEndEffector& effector : scene.end_effectors) {
    if (effector.collides) {
      const Eigen::Isometry3d pose = data::pose_at(effector.trajectory, 0.0);
      const data::SceneObstacle box{effector.name, data::SceneBox{effector.size, pose, effector.trajectory},
                                    effector.friction};
      body.environment.obstacles.push_back(obstacle_of(scene, object, box));
      body.obstacle_names.push_back(effector.name);
    }
    for (const data::SceneGrasp& wanted : effector.grasps) {
      if (wanted.object != object) continue;
      Grasp grasp;
      grasp.gripper = effector.trajectory;
      grasp.from = wanted.from;
      grasp.to = wanted.to;
      grasp.closing_time = wanted.zero_length ? wanted.closing_time : 0.0;
      body.pending.push_back({int(body.environment.grasps.size()), wanted.from, wanted.threshold,
                              0.5 * effector.size, wanted.zero_length});
      body.environment.grasps.push_back(grasp);
      body.grasp_names.push_back(effector.name);
    }
  }
}

double total_area(const Sheet& sheet) { return sheet.vertex_area.sum(); }

SceneBody make_body(const data::Scene& scene, const data::SceneObject& object,
                    std::vector<std::string>& notices) {
  const data::Asset asset = data::load_asset(object.asset);
  if (asset.element_type != data::ElementType::triangle)
    throw data::input_error(asset.source, "element_type",
                            "TETRAHEDRON, but only sheets (TRIANGLE) can be simulated");
  SceneBody body;
  body.name = object.name;
  body.sheet = make_sheet(data::load_asset_mesh(asset));
  const data::ResolvedSheet resolved = data::resolve_sheet(asset, total_area(body.sheet));
  for (const std::string& notice : resolved.notices) notices.push_back(object.name + ": " + notice);
  if (resolved.uniform_vertex_mass) body.sheet.vertex_area.setConstant(body.sheet.vertex_area.mean());

  Environment& environment = body.environment;
  environment.material = resolved.material;
  if (scene.bending_model) environment.material.bending_model = *scene.bending_model;
  environment.gravity = scene.gravity;
  environment.state.positions = start_positions(scene, object, body.sheet.rest.vertices);
  environment.state.velocities =
      object.start_velocity.transpose().replicate(environment.state.positions.rows(), 1);
  for (const data::SceneObstacle& other : scene.obstacles) {
    environment.obstacles.push_back(obstacle_of(scene, object.name, other));
    body.obstacle_names.push_back(other.name);
  }
  add_supports(scene, object, body);
  add_end_effectors(scene, object.name, body);
  return body;
}

/// Advances an environment by one step.
using Stepper = std::function<StepReport(Environment&)>;

Stepper make_stepper(const data::SceneSolver& solver, double time_step, const SceneBody& body) {
  if (solver.integrator == "newton") {
    SolverSettings settings;
    settings.time_step = time_step;
    settings.max_iterations = solver.max_iterations;
    settings.tolerance = solver.tolerance;
    return
        [newton = std::make_shared<Solver>(body.sheet, settings)](Environment& e) { return newton->step(e); };
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
  return [projective = std::make_shared<ProjectiveSolver>(body.sheet, settings)](Environment& e) {
    return projective->step(e);
  };
}

double distance_to_box(const Vector3d& half_extents, const Vector3d& point) {
  return (point.cwiseAbs() - half_extents).cwiseMax(0.0).norm();
}

data::TriangleMesh merged(const std::vector<SceneBody>& bodies) {
  data::TriangleMesh mesh;
  Eigen::Index vertices = 0, triangles = 0;
  for (const SceneBody& body : bodies) {
    const data::Points& x = body.environment.state.positions;
    const data::Triangles& t = body.sheet.rest.triangles;
    mesh.vertices.conservativeResize(vertices + x.rows(), 3);
    mesh.triangles.conservativeResize(triangles + t.rows(), 3);
    mesh.vertices.bottomRows(x.rows()) = x;
    mesh.triangles.bottomRows(t.rows()) = t.array() + int(vertices);
    vertices += x.rows();
    triangles += t.rows();
  }
  return mesh;
}

std::string log_row(int step, double time, const std::vector<StepReport>& reports) {
  StepReport worst, sum;
  bool converged = true;
  for (const StepReport& r : reports) {
    worst.residual = std::max(worst.residual, r.residual);
    worst.penetration_max = std::max(worst.penetration_max, r.penetration_max);
    worst.complementarity = std::max(worst.complementarity, r.complementarity);
    sum.iterations += r.iterations;
    sum.kinetic += r.kinetic;
    sum.membrane += r.membrane;
    sum.bending += r.bending;
    sum.potential += r.potential;
    converged = converged && r.converged;
  }
  std::string row = std::to_string(step) + "," + data::format_number(time);
  row += "," + data::format_number(worst.residual) + "," + std::to_string(sum.iterations);
  for (double value :
       {worst.penetration_max, worst.complementarity, sum.kinetic, sum.membrane + sum.bending, sum.potential})
    row += "," + data::format_number(value);
  return row + (converged ? ",1\n" : ",0\n");
}

std::string force_rows(double time, const std::vector<SceneBody>& bodies,
                       const std::vector<StepReport>& reports) {
  std::map<std::string, Vector3d> forces;
  const auto add = [&](const std::string& body, const Vector3d& force) {
    forces.try_emplace(body, Vector3d::Zero()).first->second += force;
  };
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    for (std::size_t k = 0; k < reports[b].grasp_forces.size(); ++k)
      add(bodies[b].grasp_names[k], reports[b].grasp_forces[k]);
    for (std::size_t k = 0; k < reports[b].obstacle_forces.size(); ++k)
      add(bodies[b].obstacle_names[k], reports[b].obstacle_forces[k]);
    if (!bodies[b].environment.fixed.empty()) add("fixed", reports[b].fixed_force);
  }
  std::string rows;
  for (const auto& [body, force] : forces) {
    rows += data::format_number(time) + "," + body;
    for (double component : force) rows += "," + data::format_number(component);
    rows += "\n";
  }
  return rows;
}

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

}  // namespace

std::vector<SceneBody> scene_bodies(const data::Scene& scene, std::vector<std::string>& notices) {
  std::vector<SceneBody> bodies;
  for (const data::SceneObject& object : scene.objects) bodies.push_back(make_body(scene, object, notices));
  if (bodies.size() > 1) notices.push_back("the objects of this scene do not touch each other");
  if (scene.solver.integrator == "newton" && scene.solver.constraint_solver.starts_with("Lite"))
    notices.push_back(
        "contacts are met exactly by the newton integrator; solver.type projective has the inertia metric");
  if (data::asks_for_cuda(scene.solver)) notices.push_back("no CUDA backend here: running on the CPU");
  return bodies;
}

void close_pending_grasps(SceneBody& body) {
  const State& state = body.environment.state;
  for (const SceneBody::PendingGrasp& pending : body.pending) {
    if (state.time < pending.from - 1e-9) continue;
    Grasp& grasp = body.environment.grasps[pending.grasp];
    const Eigen::Isometry3d base_to_effector = data::pose_at(grasp.gripper, state.time).inverse();
    double nearest = std::numeric_limits<double>::infinity();
    for (int i = 0; i < int(state.positions.rows()); ++i) {
      const double distance =
          distance_to_box(pending.half_extents, base_to_effector * Vector3d(state.positions.row(i)));
      nearest = std::min(nearest, distance);
      if (distance <= pending.threshold) grasp.vertices.push_back(i);
    }
    if (grasp.vertices.empty())
      throw data::input_error("end effector " + body.grasp_names[pending.grasp], "grasps",
                              "no vertex of " + body.name + " within " +
                                  data::format_short(pending.threshold) + " m of its box at " +
                                  data::format_short(state.time) + " s; the nearest is " +
                                  data::format_short(nearest) + " m away");
    if (pending.zero_length) grasp.targets = data::Points::Zero(Eigen::Index(grasp.vertices.size()), 3);
  }
  std::erase_if(body.pending, [&](const auto& pending) { return state.time >= pending.from - 1e-9; });
}

SceneSummary run_scene(const data::Scene& scene, const SceneRun& run, const std::string& output_dir) {
  const auto start = std::chrono::steady_clock::now();
  namespace fs = std::filesystem;
  SceneSummary summary;
  summary.notices = scene.notices;
  std::vector<SceneBody> bodies = scene_bodies(scene, summary.notices);
  if (run.notice)
    for (const std::string& notice : summary.notices) run.notice(notice);

  std::vector<Stepper> steppers;
  for (const SceneBody& body : bodies) steppers.push_back(make_stepper(scene.solver, scene.time_step, body));

  const int steps = run.steps >= 0 ? run.steps : scene.steps;
  const std::set<int> frames = frames_to_write(scene, steps);
  const auto write_frame = [&](int step) {
    if (!frames.count(step)) return;
    char name[32];
    std::snprintf(name, sizeof name, "%06d.ply", step);
    data::save_triangle_mesh(merged(bodies), (fs::path(output_dir) / "frames" / name).string());
    ++summary.frames;
  };
  std::string log =
      "step,t,residual,iterations,penetration_max_m,complementarity,kinetic_J,elastic_J,potential_J,"
      "converged\n";
  std::string forces = "t,body,fx,fy,fz\n";
  const auto write_tables = [&] {
    data::write_atomically((fs::path(output_dir) / "log.csv").string(), log);
    data::write_atomically((fs::path(output_dir) / "forces.csv").string(), forces);
  };

  std::vector<StepReport> reports(bodies.size());
  try {
    write_frame(0);
    for (int step = 1; step <= steps && !summary.interrupted; ++step) {
      for (SceneBody& body : bodies) close_pending_grasps(body);
      std::vector<std::future<void>> pending;
      const auto advance = [&](std::size_t b) { reports[b] = steppers[b](bodies[b].environment); };
      for (std::size_t b = 0; b < bodies.size(); ++b)
        if (run.threads > 1 && b + 1 < bodies.size())
          pending.push_back(std::async(std::launch::async, advance, b));
        else
          advance(b);
      for (std::future<void>& other : pending) other.get();

      const double time = bodies.empty() ? step * scene.time_step : bodies.front().environment.state.time;
      log += log_row(step, time, reports);
      forces += force_rows(time, bodies, reports);
      bool converged = true;
      for (const StepReport& report : reports) {
        converged = converged && report.converged;
        summary.residual_max = std::max(summary.residual_max, report.residual);
        summary.penetration_max = std::max(summary.penetration_max, report.penetration_max);
        summary.iterations += report.iterations;
      }
      summary.unconverged_steps += !converged;
      summary.steps = step;
      write_frame(step);
      if (run.progress && !run.progress(step, steps)) summary.interrupted = step < steps;
    }
  } catch (...) {
    write_tables();
    throw;
  }
  write_tables();
  summary.wall_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return summary;
}

}  // namespace flash::sim
