#include "sim/scene/hold.h"

#include <algorithm>

#include "data/files/error.h"
#include "data/files/text.h"

namespace flash::sim {

using data::Points;

data::Points held_places(const Hold& hold, const HeldVertices& held, double time) {
  if (!hold.at_origin && hold.targets.rows() == 0) return held.offsets;
  const double gone = std::clamp((time - held.from) / (held.arrival - held.from), 0.0, 1.0);
  const double share = hold.closing == Closing::smooth ? gone * gone * (3 - 2 * gone) : gone;
  if (hold.at_origin) return (1 - share) * held.offsets;
  return (1 - share) * held.offsets + share * hold.targets;
}

void check_stiffness(const Hold& hold) {
  const Eigen::VectorXd& stiffness = hold.stiffness;
  if (stiffness.size() == 0) return;
  const auto refuse = [&](const std::string& why) {
    throw data::input_error("hold " + hold.name, "stiffness", why);
  };
  if (hold.reach) refuse("found a reach beside it, expected vertices");
  if (hold.axes != std::array{true, true, true}) refuse("found axes that are not held, expected all of them");
  if (stiffness.size() != std::ssize(hold.vertices))
    refuse("found " + std::to_string(stiffness.size()) + " numbers, expected one a vertex, " +
           std::to_string(hold.vertices.size()));
  for (Eigen::Index v = 0; v < stiffness.size(); ++v)
    if (!(stiffness[v] >= 0))
      refuse("found " + data::format_short(stiffness[v]) + " N/m at vertex " +
             std::to_string(hold.vertices[static_cast<std::size_t>(v)]) + ", expected zero or more");
}

}  // namespace flash::sim
