#pragma once
#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "calib/dataset/target.h"
#include "calib/detect/detect.h"
#include "calib/watch/watch_state.h"

namespace flash::calib {

struct WatchSettings {
  std::string folder;
  DatasetOptions dataset = {};
  std::optional<Setup> setup = {};    ///< none: as target.json says it
  std::optional<Target> target = {};  ///< likewise
  DetectSettings detect = {};
  CalibrateSettings calibrate = {};
  PlanSettings plan = {};
  double period = 0.1;   ///< between looks at the folder [s]
  double settled = 2.0;  ///< how long a list of poses without the end of its last line is waited for [s]
};

/// A moment of the recording, and the bytes of the file of its last picture, null before the first.
struct WatchMoment {
  WatchState state;
  std::shared_ptr<const std::string> picture;
};

/// Follows a folder while it is recorded, until `stop` is set, and tells each change. Pictures are looked at
/// one after the other, each once, as long as its file stays what it is; the answer is solved beside that,
/// always of the views that are there when it begins. What is missing, half written or wrong is told in
/// the state. Throws data::InputError where the folder is gone.
void watch_folder(const WatchSettings& settings, const std::atomic<bool>& stop,
                  const std::function<void(WatchMoment)>& tell);

}  // namespace flash::calib
