#include "calib/watch/watch_answer.h"

#include <algorithm>

#include "calib/detect/lens_doubt.h"
#include "calib/detect/read_depth.h"
#include "data/files/error.h"

namespace flash::calib {

WatchAnswer watch_answer(Setup setup, const Dataset& posed, const Target& target,
                         const std::vector<Detection>& detections, const CalibrateSettings& calibrate,
                         PlanSettings plan) {
  WatchAnswer answer;
  answer.views = static_cast<std::size_t>(
      std::count_if(detections.begin(), detections.end(),
                    [](const Detection& detection) { return !detection.readings.empty(); }));
  const auto least = static_cast<std::size_t>(calibrate.least_views);
  if (answer.views < least) {
    answer.not_yet = std::to_string(answer.views) + " of the " + std::to_string(least) +
                     " views that the first answer takes";
    return answer;
  }
  try {
    answer.calibration =
        calibrate_images(setup, posed, target, detections, read_depth(posed, detections), calibrate)
            .calibration;
  } catch (const data::InputError& error) {
    const std::string doubt = lens_doubt(posed, target, detections);
    answer.not_yet = doubt.empty() ? error.what() : doubt;
    return answer;
  }
  try {
    plan.poses = 1;
    plan.seed += static_cast<unsigned>(answer.views);  // a pose that nobody can take is not named again
    answer.next = plan_poses(*answer.calibration, target_points(target), plan).poses.front();
  } catch (const data::InputError& error) {
    answer.no_plan = error.what();
  }
  return answer;
}

}  // namespace flash::calib
