#pragma once
#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "data/asset/material.h"
#include "data/camera/camera.h"
#include "data/camera/depth_image.h"
#include "data/mesh/mesh.h"
#include "data/recording/recording.h"
#include "sim/device.h"
#include "sim/newton/solver.h"
#include "sim/scene/environment.h"
#include "sysid/replay/replay.h"

namespace flash::sysid {

struct SynthCamera {
  data::CameraIntrinsics intrinsics;  ///< without distortion
  Eigen::Isometry3d base_from_camera = Eigen::Isometry3d::Identity();
};

/// What is recorded, and how badly.
struct SynthSettings {
  std::string name = "synth";
  std::string kind = "corner_lift";             ///< corner_lift, hang, drag, bar_pull, bias_pull
  std::optional<Eigen::Vector3d> displacement;  ///< of the (last) gripper in place of the kind's [m]
  double duration = 3.0;                        ///< of the motion [s]
  double rest = 0.0;                            ///< recorded after it [s]
  double keyframe_rate = 10.0;                  ///< [1/s]
  double grasp_within = 0.02;                   ///< of the corner, along each axis; of a pinch its depth [m]
  std::optional<double> grasp_cell{};           ///< as in ReplaySettings
  ReplayNuisance nuisance{};                    ///< how the sheet lies and is grasped
  data::GraspShape grasp_shape = data::GraspShape::clamp;  ///< pinch: closed before the recording begins
  std::vector<SynthCamera> cameras;
  double depth_noise = 0.001;  ///< along the ray [m]
  double dropped = 0.0;        ///< share of keyframes lost
  Eigen::Vector3d gripper_half_extents{0.012, 0.02,
                                       0.05};  ///< box above the grasp that hides cloth; zero: none [m]
  Eigen::Vector3d cloud_offset = Eigen::Vector3d::Zero();  ///< camera against robot: observed - true [m]
  double time_offset = 0.0;   ///< true time of an observation labelled t is t + time_offset [s]
  bool clamp_slopes = false;  ///< the grasped patch does not bend
  std::optional<sim::SelfContact> self_contact{};  ///< as in ReplaySettings
  bool forces = false;                             ///< record the gripper's force on the sheet
  bool raw = false;                                ///< keep what the cameras see, table and gripper included
  sim::DeviceChoice device{};                      ///< where it is simulated
  unsigned seed = 1;
};

/// A recording made by simulation: what recording.json will say, and the clouds of its keyframes.
struct SynthRecording {
  data::Recording recording;                       ///< keyframes without paths
  std::vector<data::Points> clouds;                ///< one a keyframe, base frame [m]
  std::vector<data::Points> contours;              ///< visible border of the sheet, one a keyframe [m]
  std::vector<SynthCamera> cameras;                ///< of the raw images, as is stated: with cloud_offset
  std::vector<std::vector<data::DepthImage>> raw;  ///< of each camera, one a keyframe [mm]; empty: not kept
  double residual_max = 0;                         ///< of the simulated steps, |r| / |M g|
  double unconverged_share = 0;                    ///< of the simulated steps
};

/// Simulates a sheet that lies on a table (z = 0) while grippers move patches of it from rest to rest along
/// s(tau) = tau^3 (10 - 15 tau + 6 tau^2), tau = t / duration, and observes it with depth cameras: the
/// visible side only, hidden by itself and by the grippers. `mesh_spec` is the specification or file `mesh`
/// came from. Throws data::InputError on an unknown kind, no camera, settings out of range, or a CUDA device
/// that cannot simulate them.
SynthRecording synthesize(const data::TriangleMesh& mesh, const std::string& mesh_spec,
                          const data::SheetMaterial& material, const SynthSettings& settings,
                          const sim::SolverSettings& solver);

/// Writes recording.json, the trajectories, frames/NNN.ply and, where the kind needs it,
/// frames/NNN_contour.ply; of raw images cameraN/depth/NNN.png with camera_info.yaml and extrinsics.json.
void save_synthetic(SynthRecording& synthetic, const std::string& folder);

/// The truth behind a synthetic recording as JSON, schema "flash-truth/1".
std::string truth_text(const data::SheetMaterial& material, const SynthSettings& settings);

}  // namespace flash::sysid
