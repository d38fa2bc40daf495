#pragma once
#include <string>
#include <vector>

#include "data/mesh/mesh.h"
#include "sysid/emulate/results_store.h"
#include "sysid/replay/replay.h"

namespace flash::sysid {

/// One keyframe, simulation and observation both in the observed frame.
struct OverlayFrame {
  double t = 0;           ///< of the recording [s]
  data::Points vertices;  ///< simulated, moved by the fitted registration [m]
  data::Points cloud;     ///< observed, inside the crop [m]
  double score = 0;       ///< [m]; meaningless without points
};

/// A recording replayed with one set of parameters.
struct Overlay {
  std::string name;
  data::Triangles triangles;
  std::vector<OverlayFrame> frames;
  std::string start_picture = {};  ///< SVG of what the search started from, as `import` drew it; may be empty
};

/// The simulated surface at each keyframe under the registration that `score` found.
Overlay make_overlay(const Replay& replay, const Motion& motion, const RecordingScore& score);

/// FOLDER/NNN_mesh.ply, NNN_cloud.ply and overlay.csv (t, score_m, points), NNN the index of the keyframe,
/// and import.svg where there is one.
void save_overlay(const Overlay& overlay, const std::string& folder);

/// Throws data::InputError naming the file unless save_overlay wrote the folder.
Overlay load_overlay(const std::string& folder);

}  // namespace flash::sysid
