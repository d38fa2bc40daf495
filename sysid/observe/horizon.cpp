#include "sysid/observe/horizon.h"

#include "sysid/observe/motion_distance.h"

namespace flash::sysid {

std::optional<double> predictability_horizon(const Replay& replay, const ReplayCandidate& candidate,
                                             const MotionStore& store, double limit, double perturbation) {
  ReplayCandidate twin = candidate;
  twin.material.membrane_stiffness *= 1 + perturbation;
  twin.material.bending_rigidity *= 1 + perturbation;
  twin.material.friction *= 1 + perturbation;
  if (twin.solid) {
    twin.solid->youngs_modulus *= 1 + perturbation;
    twin.solid->friction *= 1 + perturbation;
  }
  std::vector<ReplayResult> results(2);
  store.run(replay, {candidate, twin},
            [&](std::size_t i, ReplayResult result) { results[i] = std::move(result); });
  for (const auto& [t, distance] : motion_distance(replay, results[0].motion, results[1].motion))
    if (!(distance <= limit)) return t;
  return std::nullopt;
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
