#include "sysid/infer/marker_fit.h"

#include <algorithm>
#include <cmath>

#include "sysid/replay/sheet_distance.h"

namespace flash::sysid {

double MarkerFit::most_noise() const {
  constexpr double kOnceInTwenty = 1.644854;  // Of a standard normal. Theory: once in twenty, one-sided.
  const double freedom = 3.0 * std::max(sightings, 1), spread = 2 / (9 * freedom);
  // Wilson and Hilferty 1931.
  return noise * std::sqrt(3 * std::pow(1 - spread + kOnceInTwenty * std::sqrt(spread), 3));
}

std::optional<MarkerFit> marker_fit_of(const Replay& replay, const Motion& motion,
                                       const Registration& registration, double noise) {
  if (replay.recording.markers.tracks.samples.empty() || motion.positions.empty()) return {};
  MarkerFit fit;
  fit.noise = noise;
  const Eigen::Isometry3d simulated_from_observed = registration.observed_from_simulated().inverse();
  SheetDistance sheet(replay.surface.triangles, motion.positions.front());
  data::Points positions;
  const auto add_distances = [&](const Observation& observation, double& squares) {
    for (Eigen::Index i = 0; i < observation.markers.rows(); ++i) {
      const Eigen::Vector3d seen = simulated_from_observed * observation.markers.row(i).transpose();
      squares += std::pow(sheet.mark(observation.marks[static_cast<std::size_t>(i)], seen).distance, 2);
    }
  };
  for (const Observation& observation : replay.observations) {
    if (observation.weight <= 0) continue;
    fit.sightings += static_cast<int>(observation.markers.rows());
    sheet.move(motion.positions.front());
    add_distances(observation, fit.motion);
    surface_at(motion, observation.t + registration.time_offset, positions);
    sheet.move(positions);
    add_distances(observation, fit.miss);
  }
  if (fit.sightings == 0) return {};
  fit.miss = std::sqrt(fit.miss / fit.sightings);
  fit.motion = std::sqrt(fit.motion / fit.sightings);
  return fit;
}

}  // namespace flash::sysid
