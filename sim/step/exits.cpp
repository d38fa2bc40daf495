#include "sim/step/exits.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace flash::sim {

using data::Points;

namespace {

constexpr double slow_share = 0.125;  ///< of the exit speed, where the sheet cannot leave at all of it

/// Appends the directions that lead out of the faces of a box, across the axis of a cylinder, out of a plane.
void add_directions(const MovingObstacle<double>& obstacle, std::vector<Vector3<double>>& directions) {
  const Frame<double>& frame = obstacle.start;
  if (obstacle.shape == ObstacleShape::plane) {
    directions.push_back(frame.z);
  } else if (obstacle.shape == ObstacleShape::cylinder) {
    constexpr int count = 16;
    for (int k = 0; k < count; ++k) {
      const double angle = 2 * std::numbers::pi * k / count;
      directions.push_back(std::cos(angle) * frame.x + std::sin(angle) * frame.y);
    }
  } else {
    for (int axis = 0; axis < 3; ++axis)
      for (const double sign : {1.0, -1.0}) directions.push_back(sign * frame.axis(axis));
  }
}

/// The unit direction in which a sheet leaves all obstacles that it starts in by the shortest way; zero where
/// there is none. All vertices take the same way, so the sheet is not torn.
Vector3<double> shortest_way_out(const ContactStep& step, const std::vector<std::vector<int>>& inside) {
  std::vector<Vector3<double>> directions;
  for (std::size_t k = 0; k < step.obstacles.size(); ++k)
    if (!inside[k].empty()) add_directions(step.obstacles[k], directions);
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
  for (const double share : {1.0, slow_share}) {
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
    const data::SheetMaterial& material = step.environment.materials[body_of(step.sheet, vertex)];
    return step.way_out.speed * std::sqrt(material.areal_density / material.membrane_stiffness);
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
