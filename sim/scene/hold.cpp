#include "sim/scene/hold.h"

#include <algorithm>

namespace flash::sim {

using data::Points;

data::Points held_places(const Hold& hold, const HeldVertices& held, double time) {
  if (!hold.at_origin && hold.targets.rows() == 0) return held.offsets;
  const double gone = std::clamp((time - held.from) / (held.arrival - held.from), 0.0, 1.0);
  const double share = hold.closing == Closing::smooth ? gone * gone * (3 - 2 * gone) : gone;
  if (hold.at_origin) return (1 - share) * held.offsets;
  return (1 - share) * held.offsets + share * hold.targets;
}

}  // namespace flash::sim
