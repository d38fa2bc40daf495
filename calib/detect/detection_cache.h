#pragma once
#include <functional>
#include <optional>
#include <string>

#include "calib/detect/finder.h"
#include "data/camera.h"

namespace flash::calib {

/// Keeps what finders found in a folder, a JSON file for each picture, named by a hash of the picture's
/// bytes, the target, the intrinsics and the version of this program: nothing stale is ever read. Safe
/// between threads and between programs.
class DetectionCache {
 public:
  /// An empty folder keeps nothing.
  DetectionCache(std::string folder, const std::optional<data::CameraIntrinsics>& camera,
                 const Target& target);

  /// What is kept for the picture, or what `find` returns; nothing is kept where `find` throws. A file that
  /// cannot be understood is written anew.
  Found get(const std::string& image, const std::function<Found()>& find) const;

 private:
  std::string folder_;
  int points_ = 0;   ///< of the target
  std::string key_;  ///< of everything but the picture
};

}  // namespace flash::calib
