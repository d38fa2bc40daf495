#include "sysid/capture/track_twin.h"

#include <filesystem>
#include <nlohmann/json.hpp>
#include <random>

#include "data/asset/asset.h"
#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/json_reader.h"

namespace flash::sysid {

data::MarkerTracks simulated_tracks(const Replay& replay, const Motion& motion, double noise, unsigned seed) {
  const data::Recording& recording = replay.recording;
  data::MarkerTracks tracks = recording.markers.tracks;
  if (tracks.samples.empty())
    throw data::input_error(recording.source, "markers", "missing, expected tracks to be simulated");
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0, 1);
  data::Points positions;
  for (const data::RecordedKeyframe& keyframe : recording.keyframes) {
    if (keyframe.sample < 0) continue;
    data::MarkerSample& sample = tracks.samples[static_cast<std::size_t>(keyframe.sample)];
    surface_at(motion, keyframe.time, positions);
    for (std::size_t i = 0; i < sample.markers.size(); ++i) {
      auto row = sample.positions.row(static_cast<Eigen::Index>(i));
      if (const auto& place = recording.markers.at[static_cast<std::size_t>(sample.markers[i])]) {
        const Mark mark = put_mark(*place, replay.surface, replay.queries->nearest(*place));
        row = mark_position(mark, corners_of(positions, replay.surface.triangles, mark.triangle)).transpose();
      }
      for (int axis = 0; axis < 3; ++axis) row[axis] += noise * normal(random);
    }
  }
  return tracks;
}

void save_track_twin(const data::Recording& like, const data::MarkerTracks& tracks, const std::string& name,
                     const std::string& folder) {
  const std::filesystem::path base(folder);
  std::filesystem::create_directories(base);
  data::Recording twin = like;
  twin.name = name;
  twin.keyframes.clear();
  twin.markers.tracks_path = (base / "tracks.csv").string();
  data::save_marker_tracks(tracks, twin.markers.tracks_path);
  if (!like.markers.placed_path.empty()) {
    twin.markers.placed_path = (base / "placed.csv").string();
    data::write_atomically(twin.markers.placed_path, data::read_file(like.markers.placed_path));
  }
  data::save_recording(twin, (base / "recording.json").string());
}

std::string truth_text(const ReplayCandidate& candidate, double noise, unsigned seed) {
  nlohmann::ordered_json json;
  json["schema"] = "flash-truth/1";
  const data::SolidMaterial material = candidate.solid.value();
  json["constitutive"] = data::to_string(material.constitutive);
  json["parameters"] = {
      {"young", material.youngs_modulus}, {"poisson", material.poissons_ratio},
      {"density", material.density},      {"friction", material.friction},
      {"air_drag", material.air_drag},    {"stiffness_damping", material.stiffness_damping}};
  json["marker_noise_m"] = noise;
  json["seed"] = seed;
  return data::format_json(json);
}

}  // namespace flash::sysid
