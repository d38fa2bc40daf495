#include "apps/sim/scene_writer.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <utility>

#include "apps/sim/contact_tables.h"
#include "apps/sim/csv_text.h"
#include "data/files/atomic_file.h"
#include "data/files/text.h"
#include "data/mesh/mesh_io.h"
#include "data/numbers/worst.h"

namespace flash::sim {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;

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

SceneWriter::SceneWriter(const data::Scene& scene, const std::vector<SceneBody>& bodies, int steps,
                         bool with_contacts, std::string output_dir)
    : output_dir_(std::move(output_dir)),
      frame_steps_(frames_to_write(scene, steps)),
      at_start_(merged(bodies)),
      with_contacts_(with_contacts),
      self_contact_(scene.self_contact.has_value()),
      yields_(any_yields(bodies)),
      log_(
          "step,t,residual,iterations,penetration_max_m,complementarity,kinetic_J,elastic_J,potential_J,"
          "converged,membrane_J,bending_J,substeps"),
      forces_("t,body,fx,fy,fz\n"),
      resultants_(resultant_columns) {
  if (self_contact_) log_ += ",layer_distance_m,layer_touches,layer_pairs,layers_J";
  log_ += yields_ ? ",yielding_J\n" : "\n";
}

std::string SceneWriter::path_of(const char* folder, int step, const char* ending) const {
  char name[32];
  std::snprintf(name, sizeof name, "%06d%s", step, ending);
  return (fs::path(output_dir_) / folder / name).string();
}

void SceneWriter::write_mesh(int step, const data::TriangleMesh& mesh) {
  data::save_triangle_mesh(mesh, path_of("frames", step, ".ply"));
  ++frames_;
}

void SceneWriter::begin() {
  // Tables first, so that they never stand beside frames of this run.
  for (const char* old :
       {"log.csv", "forces.csv", "resultants.csv", "environments.csv", "contacts", "frames"})
    fs::remove_all(fs::path(output_dir_) / old);
  if (wants_frame(0)) write_mesh(0, at_start_);
}

void SceneWriter::add_step(int step, double time, const std::vector<SceneBody>& bodies,
                           const std::vector<StepReport>& reports) {
  log_ += log_row(step, time, reports, self_contact_, yields_);
  forces_ += force_rows(time, bodies, reports);
}

void SceneWriter::write_frame(int step, const std::vector<SceneBody>& bodies) {
  write_mesh(step, merged(bodies));
}

void SceneWriter::write_contacts(int step, double time, const std::vector<SceneBody>& bodies,
                                 const std::vector<std::vector<ContactForce>>& contacts) {
  data::write_atomically(path_of("contacts", step, ".csv"), contact_table(bodies, contacts));
  resultants_ += resultant_rows(time, bodies, contacts);
}

void SceneWriter::write_tables() {
  const auto write = [&](const char* name, const std::string& table) {
    data::write_atomically((fs::path(output_dir_) / name).string(), table);
  };
  write("log.csv", log_);
  write("forces.csv", forces_);
  if (with_contacts_) write("resultants.csv", resultants_);
  tables_written_ = std::chrono::steady_clock::now();
}

void SceneWriter::write_tables_at_times() {
  if (std::chrono::steady_clock::now() - tables_written_ >= std::chrono::seconds(10)) write_tables();
}

}  // namespace flash::sim
