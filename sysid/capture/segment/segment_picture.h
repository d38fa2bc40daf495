#pragma once
#include <optional>
#include <string>
#include <vector>

#include "sysid/capture/segment/segment.h"

namespace flash::sysid {

/// A raw frame and what became of each of its points.
struct LabelledFrame {
  data::Points points;             ///< base frame [m]
  std::vector<PointLabel> labels;  ///< one a point
  std::optional<double> time{};    ///< since the first frame [s]; empty: not known
};

/// An SVG picture: a column a frame with its time, from the side (x to the right, z up) above, from the top
/// (x to the right, y up) below, all at one scale, which a bar shows. Cloth red, table grey, arm blue,
/// clutter ochre, outliers violet, as a legend says; what is outside the crop box is not drawn.
std::string draw_segmentation(const std::vector<LabelledFrame>& frames);

}  // namespace flash::sysid
