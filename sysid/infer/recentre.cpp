#include "sysid/infer/recentre.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "sysid/infer/held.h"
#include "sysid/infer/solution_errors.h"

namespace flash::sysid {
namespace {

constexpr const char* kSize = "grasp_size";

/// The mean distance of the points from the estimate as it was simulated [m].
double simulated_score(const Task& task, const Found& found) {
  return score_motions(task.replays, found.estimate.motions, task.grid.score).score;
}

}  // namespace

std::optional<double> told_grasp_size(const Task& task, const Found& found) {
  // Standard deviations of what was assumed of the size of a grasp: one that is told to be farther away has a
  // lattice of its own. Chosen: not varied.
  constexpr double kFar = 0.1;
  // Standard deviations of what was assumed: what is told worse has none. Chosen: not varied.
  constexpr double kTold = 0.5;
  // Standard deviations of what was assumed, at a time. Work: farther is reached by the next round.
  constexpr double kMost = 2;
  const auto error = std::find_if(found.errors.begin(), found.errors.end(),
                                  [](const KnownError& each) { return each.name == kSize; });
  if (error == found.errors.end()) return std::nullopt;
  const auto e = static_cast<std::size_t>(error - found.errors.begin());
  const double asked = found.look.likelihood.asked_of(e);
  if (!(std::abs(asked) > kFar && found.look.likelihood.spread_of(e) < kTold)) return std::nullopt;
  const std::vector<HeldParameter> all =
      held_parameters(task.grid, task.replays, found.look.posterior.values());
  const auto held =
      std::find_if(all.begin(), all.end(), [](const HeldParameter& each) { return each.name == kSize; });
  if (held == all.end()) return std::nullopt;
  return held->nearer(asked < 0 ? 0 : 1, std::min(std::abs(asked), kMost));
}

Found about_told_grasp(const Task& task, Found found, GridSettings& grid, std::vector<KnownError>& held) {
  constexpr int kRounds = 4;  // Lattices about a size that is told. Work: a cap.
  const bool finer = found.emulator.share != own_mesh;
  for (int round = 0; round < kRounds; ++round) {
    const std::optional<double> size = told_grasp_size(task, found);
    if (!size) break;
    const std::vector<Axis> before = grid.centres;
    grid.centres = {{kSize, {*size}, false}};
    // What smaller cells change hardly depends on the size, and takes the longest.
    std::vector<KnownError> here;
    std::copy_if(held.begin(), held.end(), std::back_inserter(here), is_of_solution);
    std::optional<Found> there = look_about(task, extent_of(found.look.posterior.axes),
                                            found.look.posterior.values(), finer, {}, here);
    // A larger patch with softer pads looks alike to first order, and is then simulated with rigid ones.
    if (!there || simulated_score(task, *there) > simulated_score(task, found)) {
      grid.centres = before;
      break;
    }
    found = std::move(*there);
    held = std::move(here);
  }
  return found;
}

}  // namespace flash::sysid
