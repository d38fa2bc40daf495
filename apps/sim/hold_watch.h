#pragma once
#include <string>
#include <vector>

#include "sim/scene/environment.h"

namespace flash::sim {

/// What a run has seen of the holds of an environment.
struct HoldWatch {
  std::vector<bool> closed;  ///< holds that carry vertices now
  std::vector<bool> ever_closed;
  std::string contested;  ///< the first time that two holds carried a vertex in one axis; empty: never

  /// To be called after each step.
  void see(const Environment& environment);
};

/// What is wrong with the holds of an environment after a whole run: those that never closed, and the first
/// vertex that two of them carried.
std::vector<std::string> hold_warnings(const HoldWatch& watch, const Environment& environment);

/// The name of the hold that a vertex obeys; "a support" where it has none of its own.
std::string holder_of(const Environment& environment, int vertex);

}  // namespace flash::sim
