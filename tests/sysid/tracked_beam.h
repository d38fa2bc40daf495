#pragma once
#include <string>

#include "sysid/capture/track_twin.h"
#include "tests/data/temporary_folder.h"

namespace flash::sysid {

inline data::SolidMaterial beam_material(double young = 2.5e5) {
  data::SolidMaterial material;
  material.youngs_modulus = young;
  material.poissons_ratio = 0.45;
  material.density = 1070;
  return material;
}

/// A clamped silicone beam that is let go, with markers of which one is on the clamp: twin of a simulation,
/// seen `times` after the start [s].
inline data::Recording tracked_beam(const data::TemporaryFolder& folder, const std::vector<double>& times,
                                    double noise, unsigned seed, const ReplaySettings& settings,
                                    const data::SolidMaterial& truth, double weight = 0) {
  const std::vector<std::pair<std::string, Eigen::Vector3d>> markers = {{"base", {-0.005, 0, 0}},
                                                                        {"corner", {0.1, 0.036, 0.02}},
                                                                        {"middle", {0.05, 0.015, 0.03}},
                                                                        {"side", {0.08, -0.006, 0.01}},
                                                                        {"tip", {0.1, 0.015, 0.036}}};
  std::string tracks = "t,marker,x,y,z\n";
  for (const double time : times)
    for (const auto& [name, at] : markers)
      tracks += std::to_string(time) + "," + name + "," + std::to_string(at.x()) + "," +
                std::to_string(at.y()) + "," + std::to_string(at.z()) + "\n";
  folder.write("like/tracks.csv", tracks);
  const std::string load = R"("loads": [{"select": {"box": {"min": [0.1, null, 0.03]}}, "attached_mass": )";
  const std::string path = folder.write(
      "like/recording.json", R"({"schema": "flash-recording/1", "name": "beam", "kind": "cantilever",
      "object": {"mesh": "box:0.1x0.03x0.03:0.015"},
      "supports": [{"name": "clamp", "select": {"box": {"max": [0, null, null]}}}], )" +
                                 (weight > 0 ? load + std::to_string(weight) + "}], " : std::string()) +
                                 R"("markers": {"tracks": "tracks.csv", "on_support": ["base"]}})");
  const Replay replay = make_replay(data::load_recording(path), settings);
  const ReplayCandidate candidate{{}, {}, truth};
  Motion motion;
  run(replay, {candidate}, scored_steps(replay),
      [&](std::size_t, ReplayResult result) { motion = std::move(result.motion); });
  save_track_twin(replay.recording, simulated_tracks(replay, motion, noise, seed), "twin", folder / "twin");
  return data::load_recording(folder / "twin");
}

}  // namespace flash::sysid
