#pragma once
#include "sim/newton/line_search.h"

namespace flash::sim {

// The loops of Newton's iteration. That of linear problems is a device's too. For the outer one a device has
// a text of its own (sim/cuda/newton_iteration.cuh): by this one its compiler keeps more over calls.

/// Solves linear problems, each with the contacts that the one before asks for. solve(k): the k-th, from 0;
/// exchange(): whether any contact changes by it.
template <typename Solve, typename Exchange>
FLASH_HOST_DEVICE void solve_and_exchange(const Solve& solve, const Exchange& exchange) {
  for (int k = 0;; ++k) {
    solve(k);
    // What holds in the last one has to be what its direction was found with.
    if (k + 1 == linear_problems || !exchange()) return;
  }
}

/// Friction at the normal forces of the iterate converges where these change little. In the parts of a step
/// that could not be solved as one it goes round in circles at times. Then both are solved at once, guided by
/// the residual. `part`: length of the part [s]; `step`: of the whole.
FLASH_HOST_DEVICE inline bool couples_friction(double part, double step, int iterations) {
  return part < step && iterations > coupled_after;
}

/// To balance, or until it cannot go on. A step is a line from its iterate (line_search.h), and
/// - `most_iterations()`
/// - `rests()`: whether the place where the step starts is its end, to start_tolerance_share
/// - `balanced()`: whether the iterate is in balance, to the tolerance
/// - `begin_iteration()`: counts it, and has a factor ready; false where there is none
/// - `couples(iterations, whole)`: whether friction follows the normal forces, after so many iterations, of
///   which the last one went its `whole` way or not
/// - `find_direction(stuck, coupled)`
/// - `slope()`: of the potential along the direction, at the iterate [J]
/// - `trial_is_finite()`: whether the potential of the trial is a number
/// - `repeats(coupled)`: whether an iteration that found nothing acceptable is repeated without coupling
/// - `renew()`: asks for a fresh factor
/// - `go_to_trial(length)`: the trial becomes the iterate
template <typename Step>
FLASH_HOST_DEVICE void iterate(Step& step) {
  bool stuck = false, whole = true;
  int forced_moves = 0;
  for (int iterations = 0;
       iterations < step.most_iterations() && !(iterations == 0 ? step.rests() : step.balanced());) {
    ++iterations;
    if (!step.begin_iteration()) return;
    const bool coupled = !stuck && step.couples(iterations, whole);
    step.find_direction(stuck, coupled);
    const double slope = step.slope();
    double length = shorten(step, coupled, slope);
    whole = length == 1;
    if (!acceptable(step, coupled, slope, length)) {
      if (step.balanced()) return;
      if (step.repeats(coupled)) continue;
      if (!stuck) {
        // The iteration is repeated with a fresh factor and a positive matrix, whose direction leads down.
        stuck = true;
        step.renew();
        continue;
      }
      // A small step all the same lets the contacts decide anew.
      if (++forced_moves > most_forced_moves || !step.trial_is_finite()) return;
    }
    stuck = false;
    if (!coupled) length = lengthen(step, slope, length);
    step.go_to_trial(length);
  }
}

}  // namespace flash::sim
