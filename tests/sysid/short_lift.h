#pragma once
#include <string>

#include "data/mesh/procedural_mesh.h"
#include "sysid/capture/render_depth.h"
#include "sysid/capture/synth.h"
#include "sysid/replay/replay.h"
#include "tests/data/temporary_folder.h"

namespace flash::sysid {

inline data::SheetMaterial short_lift_material() {
  data::SheetMaterial material;
  material.membrane_stiffness = 30;
  material.bending_rigidity = 2e-4;
  return material;
}

/// Of 48 x 36 pixels.
inline SynthCamera small_camera(const Eigen::Vector3d& from, const Eigen::Vector3d& at) {
  SynthCamera camera;
  camera.intrinsics.width = 48;
  camera.intrinsics.height = 36;
  camera.intrinsics.fx = camera.intrinsics.fy = 50;
  camera.intrinsics.cx = 23.5;
  camera.intrinsics.cy = 17.5;
  camera.base_from_camera = look_at(from, at, Eigen::Vector3d::UnitZ());
  return camera;
}

/// A strip lifted by its end within 0.4 s, recorded and loaded back from its files.
inline Replay short_lift(const data::TemporaryFolder& folder,
                         const std::string& mesh = "sheet:0.2x0.05:0.025:alternating",
                         const data::SheetMaterial& material = short_lift_material(), unsigned seed = 1) {
  SynthSettings settings;
  settings.name = "lift";
  settings.seed = seed;
  settings.displacement = Eigen::Vector3d(-0.02, 0, 0.04);
  settings.duration = 0.4;
  settings.keyframe_rate = 50;
  settings.grasp_within = 0.05;
  settings.clamp_slopes = true;
  settings.cameras = {small_camera({0.1, -0.3, 0.3}, {0.1, 0.025, 0.02})};
  SynthRecording made = synthesize(data::parse_mesh_spec(mesh), mesh, material, settings, {});
  save_synthetic(made, folder / "lift");
  ReplaySettings replay;
  replay.clamp_slopes = true;
  return make_replay(data::load_recording(folder / "lift"), replay);
}

/// A towel of 0.2 m on cells of 40 mm, lifted by a patch of 20 mm at its corner for `duration` [s].
inline Replay short_corner_lift(const data::TemporaryFolder& folder, double duration) {
  SynthSettings settings;
  settings.duration = duration;
  settings.grasp_within = 0.02;
  settings.cameras = {small_camera({0.1, -0.3, 0.3}, {0.1, 0.1, 0})};
  const std::string mesh = "sheet:0.2x0.2:0.04";
  SynthRecording made = synthesize(data::parse_mesh_spec(mesh), mesh, short_lift_material(), settings, {});
  save_synthetic(made, folder / "towel");
  return make_replay(data::load_recording(folder / "towel"), {});
}

}  // namespace flash::sysid
