#pragma once
#include <atomic>
#include <cstddef>
#include <vector>

#include "data/scene/scene.h"
#include "sim/device.h"
#include "sim/scene/scene.h"
#include "sim/scene/variation.h"
#include "sim/worlds.h"

namespace flash::sim {

/// The worlds of each object of a scene: `environments` of each, of which 0 is the object itself and the
/// others differ by `variations`. Throws data::InputError, naming the file, for an object that the scene's
/// method or a device cannot step, what a variation does not find in any object, and where there is too
/// little memory. `stop`: as SolverSettings has it.
std::vector<Worlds> scene_worlds(const data::Scene& scene, const std::vector<SceneBody>& bodies,
                                 int environments, const std::vector<Variation>& variations, int threads,
                                 const DeviceChoice& device = {}, const std::atomic<bool>* stop = nullptr);

/// Takes `count` steps of all of them, on up to `threads` threads.
void step(std::vector<Worlds>& worlds, int threads, int count = 1);

/// Takes away all velocity of all environments; returns the largest there was [m/s].
double stop_motion(std::vector<Worlds>& worlds);

/// How many vertices the objects have together.
std::size_t vertices_of(const std::vector<SceneBody>& bodies);

/// The status of an environment whose objects are in several worlds: the worst of theirs.
void merge(const WorldStatus& other, WorldStatus& status);

}  // namespace flash::sim
