#pragma once
#include <atomic>
#include <string>
#include <vector>

#include "data/recording/recording.h"

namespace flash::sysid {

/// What tracked markers need to become a recording of a part that is clamped.
struct TrackImportSettings {
  std::string tracks;                    ///< CSV t,marker,x,y,z, base frame [s], [m]
  std::string placed;                    ///< CSV marker,x,y,z on the object at rest [m]; may be empty
  std::vector<std::string> on_support;   ///< markers that stay where they are
  data::CropBox clamp;                   ///< vertices of the object at rest in it are held [m]
  Eigen::Vector3d gravity{0, 0, -9.81};  ///< in the frame of the markers [m/s^2]
  int every = 1;                         ///< so many times of the tracks make one keyframe: the first of them
  std::string mesh_spec;                 ///< mesh spec or file
  std::string asset;                     ///< file, may be empty
  std::string kind = "cantilever";
  std::string name;  ///< empty: the folder's
  std::string out;   ///< folder to make
  bool overwrite = false;
  const std::atomic<bool>* stop = nullptr;  ///< once set, nothing is written
};

/// Writes out/recording.json with the tracks, places and a mesh file copied beside it, and loads it back to
/// check it. Without `placed` the object's frame is that of the markers. Throws InputError, and leaves
/// nothing behind, where the check fails; likewise data::Stopped once settings.stop is set.
data::Recording import_tracks(const TrackImportSettings& settings);

}  // namespace flash::sysid
