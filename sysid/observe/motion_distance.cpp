#include "sysid/observe/motion_distance.h"

#include <algorithm>

#include "sysid/replay/surface_distance.h"

namespace flash::sysid {
namespace {

double mean_distance(const data::Points& points, const SurfaceDistance& surface) {
  double sum = 0;
  int hint = -1;
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    const SurfacePoint nearest = surface.nearest(points.row(i).transpose(), hint);
    hint = nearest.triangle;
    sum += nearest.distance;
  }
  return sum / static_cast<double>(std::max<Eigen::Index>(1, points.rows()));
}

}  // namespace

std::vector<std::pair<double, double>> motion_distance(const Replay& replay, const Motion& a,
                                                       const Motion& b) {
  SurfaceDistance surface(replay.surface.triangles, replay.surface.vertices);
  std::vector<std::pair<double, double>> distances;
  data::Points positions;
  for (const Observation& observation : replay.observations) {
    if (observation.weight <= 0) continue;
    surface_at(a, observation.t, positions);
    surface.move(positions);
    surface_at(b, observation.t, positions);
    distances.emplace_back(observation.t, mean_distance(positions, surface));
  }
  return distances;
}

}  // namespace flash::sysid
