#pragma once
#include <map>
#include <string>
#include <vector>

#include "data/mesh/mesh.h"

namespace flash::data {

/// Where markers were at one time.
struct MarkerSample {
  double time = 0.0;         ///< by the file's clock [s]
  std::vector<int> markers;  ///< those that were seen, index into the names
  Points positions;          ///< one row each, base frame [m]
};

/// Named markers over time, as motion capture gives them.
struct MarkerTracks {
  std::vector<std::string> names;     ///< in order of name
  std::vector<MarkerSample> samples;  ///< times increase
};

/// Reads lines t,marker,x,y,z under that header. Times do not fall; a marker that was not seen has no line.
/// Throws InputError naming file and line.
MarkerTracks load_marker_tracks(const std::string& path);

/// Writes what load_marker_tracks reads.
void save_marker_tracks(const MarkerTracks& tracks, const std::string& path);

/// Reads lines marker,x,y,z under that header: where each marker is on the object at rest [m]. Throws
/// InputError naming file and line.
std::map<std::string, Eigen::Vector3d> load_marker_places(const std::string& path);

}  // namespace flash::data
