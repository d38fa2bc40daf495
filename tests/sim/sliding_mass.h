#pragma once
#include <algorithm>
#include <cmath>

#include "sim/law/vertex_contact.h"

namespace flash::sim {

/// Place along an incline [m] and speed [m/s].
struct SlidingMass {
  double place = 0, speed = 0;
};

/// A point mass after some steps of implicit Euler down an incline, from rest: friction in closed form.
/// `angle` [rad], `gravity` [m/s^2].
inline SlidingMass slide_down(double angle, double friction, double gravity, double time_step, int steps) {
  const double bound = friction * gravity * std::cos(angle), driving = gravity * std::sin(angle),
               longest = bristle_length(time_step), spring = bound / longest;
  SlidingMass mass;
  double slip = 0;
  for (int n = 0; n < steps; ++n) {
    const double bent =
        (mass.speed + time_step * (driving - spring * slip)) / (1 + time_step * time_step * spring);
    mass.speed = slip + time_step * bent <= longest ? bent : mass.speed + time_step * (driving - bound);
    slip = std::min(slip + time_step * mass.speed, longest);
    mass.place += time_step * mass.speed;
  }
  return mass;
}

}  // namespace flash::sim
