#pragma once
#include <vector>

#include "sim/cuda/batch_replay.h"
#include "sim/cuda/replay_numbers.h"

namespace flash::sim::cuda {

// Environments as the records that kernels read.

ReplayMaterial material_of(const SheetPlan& plan, const ReplayEnvironment& environment);

std::vector<PlacedObstacle> placed_obstacles(const ReplayEnvironment& environment);

/// What a solver keeps of an environment before its first step.
inline constexpr SolverState no_solver = {
    .step = -1, .refactor = 1, .spring_count = 0, .held_count = 0, .at_start = {}};

/// Rows of `points` from `first` on in the order of elimination; zeros where there are none.
void put_in_order(const data::Points& points, Eigen::Index first, const std::vector<int>& order, Point* to);

/// `points`: by order of elimination, which `order` has the vertices of.
void put_points(const Point* points, const std::vector<int>& order, Eigen::Ref<data::Points> to);

}  // namespace flash::sim::cuda
