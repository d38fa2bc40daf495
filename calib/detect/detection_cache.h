#pragma once
#include <functional>
#include <mutex>
#include <optional>
#include <string>

#include "calib/detect/finder.h"
#include "data/camera/camera.h"

namespace flash::calib {

/// Keeps what finders found in a folder, a JSON file for each picture, named by a hash of the picture's
/// bytes, the target, the intrinsics and the sources of the finders: nothing stale is ever read. Safe
/// between threads and between programs.
class DetectionCache {
 public:
  using Tell = std::function<void(const std::string&)>;

  /// An empty folder keeps nothing. tell: called once where the disk has no room for what is to be kept, and
  /// for each file that is not as it was written; one at a time.
  DetectionCache(std::string folder, const std::optional<data::CameraIntrinsics>& camera,
                 const Target& target, Tell tell = {});

  /// What is kept for the picture, or what `find` returns; nothing is kept where `find` throws. A file that
  /// was edited or cannot be understood is written anew.
  Found get(const std::string& image, const std::function<Found()>& find) const;

 private:
  std::string folder_;
  int points_ = 0;   ///< of the target
  std::string key_;  ///< of everything but the picture
  Tell tell_;
  mutable std::once_flag told_;
  mutable std::mutex telling_;
};

}  // namespace flash::calib
