#pragma once
#include <span>
#include <vector>

#include "sysid/observe/score.h"

namespace flash::sysid {

/// How far what one keyframe saw is from a motion, a distance for each point of it [m].
struct KeyframeDistances {
  std::vector<double> cloud;    ///< to the surface
  std::vector<double> contour;  ///< to its border
  std::vector<double> markers;  ///< to where they were put
};

/// Those of which keyframe_score takes the means. `sheet`: of the motion's mesh; it is moved. `feet`: those
/// of the cloud's points, where they are known; else they are searched for.
KeyframeDistances keyframe_distances(const Motion& motion, const Observation& observation,
                                     const Registration& registration, SheetDistance& sheet,
                                     const std::span<const sim::SurfaceFoot>* feet = nullptr);

}  // namespace flash::sysid
