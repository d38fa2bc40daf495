#include "data/recording/recording_digest.h"

#include <vector>

#include "data/files/atomic_file.h"
#include "data/files/sha256.h"
#include "data/files/text.h"
#include "data/mesh/procedural_mesh.h"

namespace flash::data {
namespace {

void add_files(const RecordedKeyframe& keyframe, std::vector<std::string>& paths) {
  for (const std::string& path :
       {keyframe.cloud, keyframe.depth, keyframe.mask, keyframe.markers, keyframe.contour})
    if (!path.empty()) paths.push_back(path);
}

void add_files(const RecordedMarkers& markers, std::vector<std::string>& paths) {
  for (const std::string& path : {markers.tracks_path, markers.placed_path})
    if (!path.empty()) paths.push_back(path);
}

std::string digest_of(const std::vector<std::string>& paths) {
  std::string digests;
  for (const std::string& path : paths) digests += sha256(read_file(path));
  return sha256(digests);
}

}  // namespace

std::string recording_sha256(const Recording& recording) {
  return recording_sha256(recording, recording.mesh_spec);
}

std::string recording_sha256(const Recording& recording, const std::string& mesh) {
  std::vector<std::string> paths = {recording.source};
  for (const auto& [name, path] : recording.trajectory_paths) paths.push_back(path);
  if (!mesh.empty() && !is_made_on_the_spot(mesh)) paths.push_back(mesh);
  if (!recording.start_mesh.empty()) paths.push_back(recording.start_mesh);
  if (recording.camera && !recording.camera->intrinsics_path.empty())
    paths.push_back(recording.camera->intrinsics_path);
  for (const RecordedKeyframe& keyframe : recording.keyframes) add_files(keyframe, paths);
  add_files(recording.markers, paths);
  return digest_of(paths);
}

std::string observed_sha256(const Recording& recording) {
  std::vector<std::string> paths;
  std::string forces;
  for (const RecordedKeyframe& keyframe : recording.keyframes) {
    add_files(keyframe, paths);
    if (keyframe.force)
      for (const double component : *keyframe.force) forces += format_number(component) + " ";
  }
  add_files(recording.markers, paths);
  return sha256(digest_of(paths) + forces);
}

}  // namespace flash::data
