#pragma once
#include <string>
#include <vector>

#include "data/recording/recording.h"

namespace flash::sysid {

/// Where inputs of a recording contradict each other, for people to read, one line each. Cloth is a sheet: no
/// point of it is farther from the gripper that holds it than the longest way across it.
///
/// - the cloth rises while the gripper stands still;
/// - the gripper is far from the cloth in most frames, or the cloud reaches farther than the sheet does;
/// - the gripper starts far above the table, though the sheet lies there in its fingers (grasps of corners);
/// - the sheet is stated to lie on the other side of the gripper than the clouds do (grasps of corners);
/// - the cloth never reaches far enough from the gripper for its stated size, though it ends above the table.
///
/// What registration may be off, 5 to 15 cm and the bounds on the camera's offset, is allowed for.
std::vector<std::string> contradictions(const data::Recording& recording,
                                        const std::vector<data::Keyframe>& keyframes);

/// Asks whether the trajectory is that of the flange, where it starts as high above the table as a flange is
/// above the cloth that its tool holds, 6 to 40 cm; else empty. The bound on the camera's height is allowed
/// for.
std::string flange_doubt(const data::Recording& recording);

/// Where the tool comes down before it lifts, as of a recording that begins with the approach: when it is
/// down, and the option that cuts there. Down is where it is within 1 mm of its lowest place before it
/// rises by 20 mm. Empty where it begins there.
std::string approach_of(const data::Trajectory& trajectory);

/// Throws data::InputError that names --grasp-within where a patch at a corner is more than half of the
/// sheet.
void check_patch(const data::Recording& recording);

/// One line about the size of the grasp and the bounds that are unusual, as units were mistaken (mm for m,
/// degrees for radians), with the usual ranges; empty where there are none.
std::string questioned_settings(const data::Recording& recording);

}  // namespace flash::sysid
