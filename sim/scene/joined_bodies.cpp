#include "sim/scene/joined_bodies.h"

#include <utility>

namespace flash::sim {

namespace {

void append_rows(data::Points& rows, const data::Points& own) {
  rows.conservativeResize(rows.rows() + own.rows(), 3);
  rows.bottomRows(own.rows()) = own;
}

/// Adds what one object has to the environment of all, whose body `number` begins at vertex `first`.
void append(const Environment& own, int number, int first, Environment& all) {
  const int count = static_cast<int>(own.state.positions.rows());
  all.materials.push_back(own.materials[0]);
  for (const auto& [body, solid] : own.solids) all.solids[number + body] = solid;
  for (std::size_t k = 0; k < own.obstacles.size(); ++k) {
    const std::vector<double>& friction = own.obstacles[k].friction;
    all.obstacles[k].friction.push_back(friction.empty() ? -1.0 : friction[0]);
  }
  for (Hold hold : own.holds) {
    for (int& vertex : hold.vertices) vertex += first;
    if (hold.reach) {
      hold.reach->first_vertex += first;
      if (hold.reach->vertex_count < 0) hold.reach->vertex_count = count;
    }
    all.holds.push_back(std::move(hold));
  }
  for (const Load& load : own.loads) all.loads.push_back({load.vertex + first, load.force});
  for (const PointMass& point : own.point_masses)
    all.point_masses.push_back({point.vertex + first, point.mass});
  append_rows(all.state.positions, own.state.positions);
  append_rows(all.state.velocities, own.state.velocities);
}

}  // namespace

SceneBody joined(const std::vector<SceneBody>& objects) {
  SceneBody whole;
  std::vector<Sheet> sheets;
  Environment& environment = whole.environment;
  environment = objects.front().environment;
  environment.materials.clear();
  environment.solids.clear();
  environment.holds.clear();
  environment.loads.clear();
  environment.point_masses.clear();
  environment.state.positions.resize(0, 3);
  environment.state.velocities.resize(0, 3);
  for (Obstacle& obstacle : environment.obstacles) obstacle.friction.clear();
  int number = 0;
  for (const SceneBody& object : objects) {
    append(object.environment, number, static_cast<int>(environment.state.positions.rows()), environment);
    sheets.push_back(object.sheet);
    sheets.back().bodies.front().name = object.name;
    whole.name += (number == 0                                      ? ""
                   : number + 1 == static_cast<int>(objects.size()) ? " and "
                                                                    : ", ") +
                  object.name;
    ++number;
  }
  whole.sheet = joined(sheets);
  return whole;
}

}  // namespace flash::sim
