#include "apps/sim/contact_tables.h"

#include <map>

#include "apps/sim/csv_text.h"
#include "data/files/text.h"
#include "sim/step/resultants.h"

namespace flash::sim {
namespace {

using Eigen::Vector3d;

const char* name_of(ContactKind kind) {
  return kind == ContactKind::vertex_obstacle ? "vertex_obstacle"
         : kind == ContactKind::vertex_face   ? "vertex_face"
                                              : "edge_edge";
}

/// Name of a body of the sheet: those of objects that do not meet are bodies of their own.
const std::string& name_of(const SceneBody& in, std::size_t body) {
  return in.sheet.bodies.size() > 1 ? in.sheet.bodies[body].name : in.name;
}

std::string numbers(const Vector3d& v) {
  std::string text;
  for (const double component : v) text += "," + data::format_number(component);
  return text;
}

std::string row_of(const SceneBody& in, int first_vertex, const ContactForce& contact) {
  const auto other = static_cast<std::size_t>(contact.other);
  std::string row = name_of(contact.kind);
  row += "," + csv_field(name_of(in, static_cast<std::size_t>(contact.body)));
  row += "," + csv_field(contact.kind == ContactKind::vertex_obstacle ? in.environment.obstacles[other].name
                                                                      : name_of(in, other));
  for (const int vertex : contact.vertices)
    row += "," + std::to_string(vertex < 0 ? vertex : first_vertex + vertex);
  row += numbers(contact.point) + numbers(contact.other_point) + numbers(contact.normal);
  row += "," + data::format_number(contact.normal_force);
  return row + numbers(contact.friction) + numbers(contact.couple) + "\n";
}

}  // namespace

std::string contact_table(const std::vector<SceneBody>& bodies,
                          const std::vector<std::vector<ContactForce>>& contacts) {
  std::string table = "kind,body,other,v0,v1,v2,v3";
  for (const char* vector : {"", "other_", "normal_"})
    for (const char* axis : {"x", "y", "z"}) table += std::string(",") + vector + axis;
  table += ",normal_force";
  for (const char* vector : {"friction_", "couple_"})
    for (const char* axis : {"x", "y", "z"}) table += std::string(",") + vector + axis;
  table += "\n";
  int first_vertex = 0;
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    for (const ContactForce& contact : contacts[b]) table += row_of(bodies[b], first_vertex, contact);
    first_vertex += static_cast<int>(bodies[b].sheet.rest.vertices.rows());
  }
  return table;
}

std::string resultant_rows(double time, const std::vector<SceneBody>& bodies,
                           const std::vector<std::vector<ContactForce>>& contacts) {
  std::map<std::string, Wrench> all;
  const auto add = [&](const std::string& name, const Wrench& wrench) {
    all[name].force += wrench.force;
    all[name].torque += wrench.torque;
  };
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const SceneBody& in = bodies[b];
    const std::vector<Obstacle>& obstacles = in.environment.obstacles;
    const Resultants sums = resultants_of(contacts[b], in.sheet.bodies.size(), obstacles.size());
    for (std::size_t k = 0; k < sums.bodies.size(); ++k) add(name_of(in, k), sums.bodies[k]);
    for (std::size_t k = 0; k < obstacles.size(); ++k) add(obstacles[k].name, sums.obstacles[k]);
  }
  std::string rows;
  for (const auto& [name, wrench] : all)
    rows += time_text(time) + "," + csv_field(name) + numbers(wrench.force) + numbers(wrench.torque) + "\n";
  return rows;
}

}  // namespace flash::sim
