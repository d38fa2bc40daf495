#pragma once
#include <vector>

#include "sim/scene/scene.h"

namespace flash::sim {

/// The objects of a scene in one environment, in their order. All have the obstacles of the first, each with
/// a friction of its own. The names of the objects stay with the bodies of the sheet.
SceneBody joined(const std::vector<SceneBody>& objects);

}  // namespace flash::sim
