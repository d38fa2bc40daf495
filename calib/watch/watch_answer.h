#pragma once
#include <optional>
#include <string>
#include <vector>

#include "calib/calibrate/calibrate_images.h"
#include "calib/calibrate/next_poses.h"

namespace flash::calib {

/// What a recording says so far.
struct WatchAnswer {
  std::size_t views = 0;  ///< that show the target and have a pose
  std::string not_yet;    ///< why nothing can be solved, in one sentence; empty: there is a calibration
  std::optional<Calibration> calibration = {};
  std::optional<PlannedPose> next = {};  ///< the first of `plan`
  std::string no_plan = {};              ///< why there is no next pose
};

/// Solves the views of a recording, a detection for each frame of `posed`, and plans the next one. What is
/// wrong with them is told, not thrown.
WatchAnswer watch_answer(Setup setup, const Dataset& posed, const Target& target,
                         const std::vector<Detection>& detections, const CalibrateSettings& calibrate,
                         PlanSettings plan);

}  // namespace flash::calib
