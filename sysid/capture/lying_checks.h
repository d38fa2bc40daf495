#pragma once
#include <optional>
#include <string>
#include <vector>

#include "data/recording/recording.h"
#include "sysid/capture/lying_sheet.h"

namespace flash::sysid {

/// The sheet as `recording` has it at the start, seen from above from the grasped corner. `heading` is that
/// of its diagonal [rad]. Empty where no corner of a sheet that is made on the spot is grasped.
std::optional<LyingSheet> stated_sheet(const data::Recording& recording, double heading);

/// Which side is taken to be which, for people to read.
std::string sides_taken(const LyingSheet& stated);

/// Why the sides of the sheet are changed over, for people to read; empty where they need not be. The first
/// clouds tell, of a sheet that still lies. Where none shows it, as segment cuts it away with the table,
/// raised cloth tells that reaches down to the table, unrolled (unrolled_cloth.h): it ends at its edges. It
/// tells sides of which one is at most 0.8 of the other. The heading may be off by `slack` [rad] and the
/// bounds on yaws, the camera by those on its offset.
std::string swapped_sides(const data::Recording& recording, const std::vector<data::Keyframe>& keyframes,
                          const LyingSheet& stated, double slack);

/// Whether the first clouds, of a sheet that still lies, fit it better when it is turned. Where none shows it
/// lying, whether those of the lift fit it better with its sides changed over.
std::vector<std::string> compare_sides(const data::Recording& recording,
                                       const std::vector<data::Keyframe>& keyframes,
                                       const LyingSheet& stated);

/// Where the cloth of the first frames lies beside the stated sheet, one line for people to read. A corner
/// that is lifted draws cloth inwards: seen from above, none of it leaves the place where the sheet lay,
/// except with a tool that leaves it. Frames count until the tool is as far from its start as half of the
/// shorter side. The bounds on the camera's offset and yaw and the start's turn are allowed for, and 15 mm
/// for the clouds and the place of the corner in the fingers. Says which changed sides or headings fit.
std::string beside_the_sheet(const data::Recording& recording, const std::vector<data::Keyframe>& keyframes,
                             const LyingSheet& stated);

}  // namespace flash::sysid
