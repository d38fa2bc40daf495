#include "sysid/design/virtual_experiment.h"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <system_error>

#include "sysid/capture/render_depth.h"
#include "sysid/capture/synth.h"

namespace flash::sysid {
namespace {

namespace fs = std::filesystem;

/// A folder of its own, which nobody else can read; removed with all that is in it.
struct ScratchFolder {
  ScratchFolder() {
    if (mkdtemp(path.data()) == nullptr) throw std::system_error(errno, std::generic_category(), path);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  ~ScratchFolder() {
    std::error_code ignored;
    fs::remove_all(path, ignored);
  }
  std::string path = (fs::temp_directory_path() / "flash-plan-XXXXXX").string();
};

constexpr double kMotion = 2.0;  // Of the gripper [s]. Chosen: not varied.

/// From the front and from behind, aimed a little above the middle of a sheet of that size.
std::vector<SynthCamera> two_cameras(const Eigen::Vector3d& target, double size) {
  SynthCamera camera;
  camera.intrinsics.width = 64;
  camera.intrinsics.height = 48;
  camera.intrinsics.fx = camera.intrinsics.fy = 55;
  camera.intrinsics.cx = 31.5;
  camera.intrinsics.cy = 23.5;
  std::vector<SynthCamera> cameras;
  for (const Eigen::Vector3d& from : {Eigen::Vector3d(0, -2.25, 1.6), Eigen::Vector3d(1.6, 1.6, 1.4)}) {
    camera.base_from_camera = look_at(target + size * from, target, Eigen::Vector3d::UnitZ());
    cameras.push_back(camera);
  }
  return cameras;
}

}  // namespace

Replay virtual_experiment(const std::string& kind, const data::Recording& like,
                          const data::SheetMaterial& material, const VirtualExperimentSettings& settings) {
  const Eigen::Vector3d low = like.mesh.vertices.colwise().minCoeff(),
                        high = like.mesh.vertices.colwise().maxCoeff();
  const double size = (high - low).maxCoeff();
  SynthSettings synth;
  synth.name = kind;
  synth.kind = kind;
  synth.duration = kMotion;
  synth.rest = kind == "hang" ? longest_virtual_experiment - kMotion : 0.0;
  synth.depth_noise = 0;
  synth.forces = kind == "bar_pull" || kind == "bias_pull" || kind == "drag";
  synth.seed = settings.seed;
  synth.clamp_slopes = settings.clamp_slopes;
  synth.self_contact = settings.self_contact;
  synth.grasp_within = std::max(0.0201, 0.08 * size);
  synth.cameras = two_cameras(0.5 * (low + high) + 0.3 * size * Eigen::Vector3d::UnitZ(), size);
  data::TriangleMesh mesh = like.mesh;
  mesh.vertices.rowwise() -= low.transpose();
  SynthRecording made = synthesize(mesh, like.mesh_spec, material, synth, settings.solver);
  ReplaySettings replay;
  replay.solver = settings.solver;
  replay.threads = settings.threads;
  replay.clamp_slopes = settings.clamp_slopes;
  replay.self_contact = settings.self_contact;
  const ScratchFolder scratch;  // after the simulation, so that it stands for a moment only
  save_synthetic(made, scratch.path);
  data::Recording recording = data::load_recording(scratch.path);
  recording.nuisance = like.nuisance;
  return make_replay(recording, replay);
}

}  // namespace flash::sysid
