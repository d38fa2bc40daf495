#pragma once
#include <string>
#include <vector>

#include "sim/scene/scene.h"

namespace flash::sim {

/// What the file of a scene says of the slopes of a hold.
struct SlopeWish {
  std::string field;    ///< of the hold in the file, for messages
  bool slopes = false;  ///< "slopes": true
};

/// Makes stiff what the holds of an object keep the slope of; `wishes`: one a hold of its environment, of
/// which the schedule is known. Adds a notice of holds in all axes about which a sheet bends that holds them
/// without. Throws data::InputError, naming the field, where slopes are asked of a hold that cannot keep
/// them: of a solid, of one that does not act in all of `steps`, of one without a whole triangle, and, with
/// the plate, of one that holds the sheet bent.
void keep_scene_slopes(const data::Scene& scene, int steps, const std::vector<SlopeWish>& wishes,
                       SceneBody& body, std::vector<std::string>& notices);

}  // namespace flash::sim
