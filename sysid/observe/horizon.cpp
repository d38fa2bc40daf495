#include "sysid/observe/horizon.h"

#include "sysid/observe/motion_distance.h"

namespace flash::sysid {

std::vector<std::optional<Horizon>> predictability_horizons(const std::vector<Replay>& replays,
                                                            const ReplayCandidate& candidate,
                                                            const std::vector<NearbyCandidate>& nearby,
                                                            const MotionStore& store, double limit) {
  std::vector<WantedMotion> wanted;
  for (const Replay& replay : replays) {
    wanted.push_back({&replay, candidate});
    for (const NearbyCandidate& each : nearby) wanted.push_back({&replay, each.candidate});
  }
  store.prepare(wanted);
  std::vector<std::optional<Horizon>> horizons(replays.size());
  for (std::size_t r = 0; r < replays.size(); ++r) {
    const ReplayResult here = store.run(replays[r], candidate);
    double farthest = 0;  // of those that part at the horizon
    for (const NearbyCandidate& each : nearby) {
      const ReplayResult there = store.run(replays[r], each.candidate);
      for (const auto& [t, distance] : motion_distance(replays[r], here.motion, there.motion)) {
        if (distance <= limit) continue;  // of what diverged it is none
        if (!horizons[r] || t < horizons[r]->t || (t == horizons[r]->t && distance > farthest)) {
          horizons[r] = {t, each.parameter};
          farthest = distance;
        }
        break;
      }
    }
  }
  return horizons;
}

int drop_beyond_horizon(std::optional<double> horizon, Replay& replay) {
  if (!horizon) return 0;
  std::vector<Observation> kept = replay.observations;
  double weight = 0;
  int dropped = 0;
  for (Observation& observation : kept) {
    const bool beyond = observation.t >= *horizon;
    dropped += beyond && observation.seen() && observation.weight > 0;
    if (beyond) observation.weight = 0;
    if (observation.seen()) weight += observation.weight;
  }
  if (!(weight > 0)) return 0;
  replay.observations = std::move(kept);
  return dropped;
}

}  // namespace flash::sysid
