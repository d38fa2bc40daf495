#pragma once
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "calib/geometry/closed_form.h"
#include "calib/solve/held_out.h"

namespace flash::calib {

/// A hand-eye method without iterations; none where it refuses a motion that it cannot use.
struct ClosedForm {
  std::string name;
  std::function<std::optional<HandEyePoses>(const std::vector<PoseLoop>&)> solve;
};

/// park and shah. OpenCV has more: calib/check/opencv_closed_forms.h.
std::vector<ClosedForm> closed_forms();

/// A method of the comparison table.
struct ComparedMethod {
  std::string name;
  HandEyePoses poses;
  ClosingError relative;  ///< rms of A X = X B over all pairs of views
  double px = 0;          ///< reprojection through the chain, robot poses as reported, 2-D rms per corner
  std::optional<HeldOut> held_out;
  std::optional<Halves> halves = {};  ///< where the answer is for two arms
  bool wild = false;                  ///< not finite, or far worse than the best of the table
};

/// Poses of each closed form and how they close; wild is what closes three times worse than the best.
std::vector<ComparedMethod> compare_closed_forms(const std::vector<PoseLoop>& loops,
                                                 const std::vector<ClosedForm>& forms);

}  // namespace flash::calib
