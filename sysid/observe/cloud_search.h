#pragma once
#include <functional>
#include <span>
#include <vector>

#include "sim/law/surface_foot.h"
#include "sysid/observe/score.h"
#include "sysid/replay/replay.h"

namespace flash::sysid {

/// Points of the clouds that are looked for: all, or those that a registration is fitted to.
enum class CloudPoints { all, thinned };

/// The feet of the points on a motion's surface, keyframe by keyframe, under a registration; directions are
/// of the simulation's frame. They last until the next call. Of keyframes without weight only `all` has
/// points.
using CloudSearch = std::function<std::vector<std::span<const sim::SurfaceFoot>>(
    CloudPoints points, const Registration& registration)>;

/// A search in a motion, which has to outlive it; empty where there is no room for one more. Any threads may
/// ask for one, each for its own motion.
using CloudSearches = std::function<CloudSearch(const Motion& motion)>;

/// Searches on the CUDA devices of the replay's settings, which take turns. They find what SheetDistance
/// finds, but for rounding. Empty where candidates are not simulated on a device or no cloud was observed.
CloudSearches device_searches(const Replay& replay, int points_per_keyframe);

/// Evenly thinned to so many points and outline points a keyframe.
std::vector<Observation> thinned(const std::vector<Observation>& observations, int points);

}  // namespace flash::sysid
