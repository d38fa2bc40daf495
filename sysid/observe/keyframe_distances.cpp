#include "sysid/observe/keyframe_distances.h"

namespace flash::sysid {

KeyframeDistances keyframe_distances(const Motion& motion, const Observation& observation,
                                     const Registration& registration, SheetDistance& sheet,
                                     const std::span<const sim::SurfaceFoot>* feet) {
  data::Points positions;
  surface_at(motion, observation.t + registration.time_offset, positions);
  if (feet != nullptr)
    sheet.move_border(positions);
  else
    sheet.move(positions);
  const Eigen::Isometry3d simulated_from_observed = registration.observed_from_simulated().inverse();
  const auto distances_of = [&](const data::Points& points, const auto& match) {
    std::vector<double> distances(static_cast<std::size_t>(points.rows()));
    for (Eigen::Index i = 0; i < points.rows(); ++i) {
      const Eigen::Vector3d point = simulated_from_observed * points.row(i).transpose();
      distances[static_cast<std::size_t>(i)] = match(i, point).distance;
    }
    return distances;
  };
  int hint = -1;
  KeyframeDistances distances;
  distances.cloud = distances_of(observation.points, [&](Eigen::Index i, const Eigen::Vector3d& point) {
    if (feet != nullptr) return SurfacePoint{.distance = (*feet)[static_cast<std::size_t>(i)].distance};
    const SurfacePoint nearest = sheet.nearest(point, hint);
    hint = nearest.triangle;
    return nearest;
  });
  distances.contour = distances_of(observation.contour, [&](Eigen::Index, const Eigen::Vector3d& point) {
    return sheet.nearest_on_border(point);
  });
  distances.markers = distances_of(observation.markers, [&](Eigen::Index i, const Eigen::Vector3d& point) {
    return sheet.mark(observation.marks[static_cast<std::size_t>(i)], point);
  });
  return distances;
}

}  // namespace flash::sysid
