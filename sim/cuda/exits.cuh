#pragma once
#include "sim/cuda/contact.cuh"
#include "sim/law/exit_direction.h"

namespace flash::sim::cuda {

// How a sheet that starts a step inside obstacles leaves them: sim/step/exits.h for one environment.

/// Whether vertex i, which nothing holds, starts the step inside an obstacle.
__device__ inline bool starts_inside(const StepProblem& step, int i, int obstacle) {
  return step.held_axes[i] == 0 &&
         distance_at_start(step.obstacles.obstacles[obstacle], triple(step.start[i])) < -inside_depth;
}

/// The unit direction in which the sheet leaves all obstacles that it starts in by the shortest way; zero
/// where there is none.
__device__ inline Triple shortest_way_out(const SheetTables& tables, const StepProblem& step,
                                          double* partial) {
  const ObstacleStep<double>& obstacles = step.obstacles;
  Triple best = {};
  double shortest = no_such_side;
  for (int own = 0; own < obstacles.count; ++own) {
    bool any = false;
    for (int i = team_rank(); i < tables.size; i += team_size()) any = any || starts_inside(step, i, own);
    if (!any_of_team(any)) continue;
    for (int k = 0; k < exit_directions(obstacles.obstacles[own]); ++k) {
      const Triple direction = exit_direction(obstacles.obstacles[own], k);
      double longest = 0;
      for (int i = team_rank(); i < tables.size; i += team_size())
        for (int other = 0; other < obstacles.count; ++other)
          if (starts_inside(step, i, other))
            longest =
                worse_of(longest, depth_along(obstacles.obstacles[other], triple(step.start[i]), direction));
      longest = worst_over_team(longest, partial);
      if (longest < shortest) {
        shortest = longest;
        best = direction;
      }
    }
  }
  return best;
}

/// Whether leaving the obstacles at `speed` has not torn the sheet, which ends the step at `end`.
__device__ inline bool exits_gently(const SheetTables& tables, const StepProblem& step, const Point* end,
                                    double speed) {
  const double limit = speed * sqrt(step.material->areal_density / step.material->membrane_stiffness);
  const auto exits = [&](int i) {
    for (int k = 0; k < step.obstacles.count; ++k)
      if (starts_inside(step, i, k)) return true;
    return false;
  };
  bool torn = false;
  for (int k = team_rank(); k < tables.edge_count; k += team_size()) {
    const int i = tables.block_rows[tables.size + k], j = tables.block_columns[tables.size + k];
    if (!exits(i) && !exits(j)) continue;
    const auto strain = [&](const Point* x) {
      return fabs(norm(triple(x[i]) - triple(x[j])) / tables.edge_lengths[k] - 1);
    };
    const double at_end = strain(end);
    torn = torn || !(at_end <= limit || at_end <= strain(step.start));
  }
  return !any_of_team(torn);
}

}  // namespace flash::sim::cuda
