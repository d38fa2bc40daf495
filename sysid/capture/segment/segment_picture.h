#pragma once
#include <vector>

#include "data/picture.h"
#include "sysid/capture/segment/segment.h"

namespace flash::sysid {

/// A raw frame and what became of each of its points.
struct LabelledFrame {
  data::Points points;             ///< base frame [m]
  std::vector<PointLabel> labels;  ///< one a point
};

/// A column a frame: from the side (x to the right, z up) above, from the top (x to the right, y up) below,
/// all at one scale. Cloth red, table grey, arm blue, clutter ochre, outliers violet; what is outside the
/// crop box is not drawn.
data::Picture draw_segmentation(const std::vector<LabelledFrame>& frames);

}  // namespace flash::sysid
