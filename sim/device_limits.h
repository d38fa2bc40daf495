#pragma once
#include <string>
#include <vector>

#include "sim/scene/environment.h"
#include "sim/world.h"

namespace flash::sim {

/// What a CUDA device cannot do yet of an environment, in a line; empty where it can all of it.
std::string why_not_on_device(const Environment& environment);

/// Throws data::InputError where worlds cannot live on a device, and names the environment where there are
/// several.
void check_on_device(const std::vector<Environment>& environments, const WorldSettings& settings);

}  // namespace flash::sim
