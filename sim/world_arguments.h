#pragma once
#include <Eigen/Geometry>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "sim/scene/end_effector.h"
#include "sim/scene/hold.h"
#include "sim/tensor.h"
#include "sim/world.h"

namespace flash::sim {

/// Throws data::InputError: "worlds: " setter ": " what.
[[noreturn]] void refuse_argument(const char* setter, const std::string& what);

/// Its name in refusals.
std::string environment_name(int environment);

/// Refuses numbers that are not from 0 to `count` - 1, each once.
void check_chosen(const char* setter, std::span<const int> environments, int count);

/// Refuses a box without a size, and a threshold or a friction that is none.
void check_end_effector(const EndEffector& effector);

/// Refuses a grasp that `own`, hold number `hold` of environment `e` at its start, cannot take on a mesh of
/// so many vertices.
void check_grasp(int e, int hold, const Hold& own, const Grasp& grasp, std::int64_t vertices);

}  // namespace flash::sim
