#include "sim/step/exits.h"

#include <algorithm>
#include <cmath>

#include "sim/law/exit_direction.h"

namespace flash::sim {

using data::Points;

namespace {

/// The unit direction in which a sheet leaves all obstacles that it starts in by the shortest way; zero where
/// there is none. All vertices take the same way, so the sheet is not torn.
Vector3<double> shortest_way_out(const ContactStep& step, const std::vector<std::vector<int>>& inside) {
  std::vector<Vector3<double>> directions;
  for (std::size_t k = 0; k < step.obstacles.size(); ++k)
    for (int n = 0; n < exit_directions(step.obstacles[k]) && !inside[k].empty(); ++n)
      directions.push_back(exit_direction(step.obstacles[k], n));
  Vector3<double> best{};
  double shortest = no_such_side;
  for (const Vector3<double>& direction : directions) {
    double longest = 0;
    for (std::size_t k = 0; k < step.obstacles.size(); ++k)
      for (const int i : inside[k])
        longest = std::max(
            longest, depth_along(step.obstacles[k], vector3(step.environment.state.positions, i), direction));
    if (longest < shortest) {
      shortest = longest;
      best = direction;
    }
  }
  return best;
}

}  // namespace

std::vector<WayOut<double>> exits_of(const ContactStep& step, const std::vector<std::vector<int>>& inside) {
  const Vector3<double> direction = shortest_way_out(step, inside);
  std::vector<WayOut<double>> exits;
  for (const double share : {1.0, slow_exit_share}) {
    exits.push_back({.speed = share * step.way_out.speed});
    if (!is_zero(direction)) exits.push_back({share * step.way_out.speed, direction});
  }
  exits.push_back({.speed = 0});
  return exits;
}

bool exits_gently(const ContactStep& step, const SheetPlan& plan, const std::vector<std::vector<int>>& inside,
                  const Points& end) {
  const Points& start = step.environment.state.positions;
  const Points& rest = plan.sheet.rest.vertices;
  const auto strain_limit = [&](int vertex) {
    const int body = body_of(step.sheet, vertex);
    const auto solid = step.environment.solids.find(body);
    if (solid != step.environment.solids.end())
      return step.way_out.speed * std::sqrt(solid->second.density / solid->second.youngs_modulus);
    const data::SheetMaterial& material = step.environment.materials[body];
    return step.way_out.speed * std::sqrt(material.areal_density / material.largest_stiffness());
  };
  std::vector<bool> exiting(static_cast<size_t>(start.rows()), false);
  for (const std::vector<int>& vertices : inside)
    for (const int i : vertices) exiting[i] = true;
  for (size_t k = 0; k < plan.edge_count; ++k) {
    const int i = plan.pattern.pairs[k].first, j = plan.pattern.pairs[k].second;
    if (!exiting[i] && !exiting[j]) continue;
    const auto strain = [&](const Points& x) {
      return std::abs((x.row(i) - x.row(j)).norm() / (rest.row(i) - rest.row(j)).norm() - 1);
    };
    const double strain_at_end = strain(end);
    if (!(strain_at_end <= strain_limit(i) || strain_at_end <= strain(start))) return false;
  }
  return true;
}

}  // namespace flash::sim
