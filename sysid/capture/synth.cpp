#include "sysid/capture/synth.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <utility>

#include "data/asset/asset.h"
#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/json_reader.h"
#include "data/files/text.h"
#include "data/mesh/mesh_io.h"
#include "data/mesh/procedural_mesh.h"
#include "sysid/capture/render_depth.h"
#include "sysid/replay/grasp_mesh.h"
#include "sysid/replay/memory_estimate.h"
#include "sysid/replay/recorded_grasp.h"
#include "sysid/replay/replay.h"

namespace flash::sysid {
namespace {

/// One gripper: what it takes and how far it carries it.
struct Hand {
  std::string name;
  data::Selection select;
  Eigen::Vector3d displacement;
};

std::vector<int> vertices_at(const data::TriangleMesh& mesh, int axis, double value) {
  std::vector<int> vertices;
  for (Eigen::Index i = 0; i < mesh.vertices.rows(); ++i)
    if (std::abs(mesh.vertices(i, axis) - value) < 1e-9) vertices.push_back(static_cast<int>(i));
  return vertices;
}

Hand corner_hand(const std::string& name, const std::array<int, 2>& corner, double within,
                 const Eigen::Vector3d& displacement) {
  Hand hand{name, {}, displacement};
  hand.select.corner = corner;
  hand.select.within = within;
  return hand;
}

Hand edge_hand(const std::string& name, std::vector<int> vertices, const Eigen::Vector3d& displacement) {
  Hand hand{name, {}, displacement};
  hand.select.vertices = std::move(vertices);
  return hand;
}

// The motion of each kind for a sheet of extent `size`.
std::vector<Hand> hands_of(const data::TriangleMesh& mesh, const SynthSettings& settings) {
  const Eigen::Vector3d low = mesh.vertices.colwise().minCoeff(), high = mesh.vertices.colwise().maxCoeff();
  const Eigen::Vector3d size = high - low;
  const double within = settings.grasp_within;
  std::vector<Hand> hands;
  if (settings.kind == "corner_lift") {
    hands = {corner_hand("gripper", {1, 1}, within, {-0.25 * size.x(), 0, 0.875 * size.x()})};
  } else if (settings.kind == "hang") {
    hands = {corner_hand("gripper", {1, 1}, within,
                         {-0.5 * size.x(), -0.5 * size.y(), 1.1 * std::hypot(size.x(), size.y())})};
  } else if (settings.kind == "drag") {
    hands = {corner_hand("gripper", {1, 1}, within, {0.75 * size.x(), 0, 0.1 * size.x()})};
  } else if (settings.kind == "bar_pull") {
    hands = {edge_hand("anchor", vertices_at(mesh, 0, low.x()), Eigen::Vector3d::Zero()),
             edge_hand("gripper", vertices_at(mesh, 0, high.x()), {0.1 * size.x(), 0, 0})};
  } else if (settings.kind == "bias_pull") {
    hands = {corner_hand("anchor", {0, 0}, within, Eigen::Vector3d::Zero()),
             corner_hand("gripper", {1, 1}, within, {0.15 * size.x(), 0.15 * size.y(), 0})};
  } else {
    throw data::InputError("--kind: found " + settings.kind +
                           ", expected corner_lift, hang, drag, bar_pull or bias_pull");
  }
  if (settings.displacement) hands.back().displacement = *settings.displacement;
  return hands;
}

bool in_plane(const std::string& kind) { return kind == "bar_pull" || kind == "bias_pull"; }

double smooth_step(double tau) {
  tau = std::clamp(tau, 0.0, 1.0);
  return tau * tau * tau * (10 + tau * (-15 + 6 * tau));
}

data::Trajectory smooth_motion(const Eigen::Vector3d& from, const Eigen::Vector3d& displacement,
                               const SynthSettings& settings) {
  data::Trajectory trajectory;
  const int samples = static_cast<int>(std::ceil(100 * (settings.duration + settings.rest)));
  for (int i = 0; i <= samples; ++i) {
    const double t = 0.01 * i;
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translation() = from + smooth_step(t / settings.duration) * displacement;
    trajectory.times.push_back(t);
    trajectory.poses.push_back(pose);
  }
  return trajectory;
}

void check(const SynthSettings& settings) {
  const auto within = [](const char* flag, double value, double least, double most, const char* unit) {
    if (!(value >= least && value <= most))
      throw data::InputError(std::string(flag) + ": found " + data::format_short(value) + ", expected " +
                             data::format_short(least) + " to " + data::format_short(most) + unit);
  };
  constexpr double kLongest = 3600, kFarthest = 10, kMostKeyframes = 10'000;
  within("--duration", settings.duration, 1e-6, kLongest, " s");
  within("--rest", settings.rest, 0, kLongest, " s");
  within("--rate", settings.keyframe_rate, 1e-6, kMostKeyframes / (settings.duration + settings.rest),
         " keyframes a second");
  within("--time-offset-error", settings.time_offset, -kFarthest, kFarthest, " s");
  within("--noise", settings.depth_noise, 0, kFarthest, " m");
  for (int k = 0; k < 3; ++k) {
    within("--offset-error", settings.cloud_offset[k], -kFarthest, kFarthest, " m");
    if (settings.displacement)
      within("--displacement", (*settings.displacement)[k], -kFarthest, kFarthest, " m");
    for (const SynthCamera& camera : settings.cameras)
      within("--camera", camera.base_from_camera.translation()[k], -kFarthest, kFarthest, " m");
  }
  if (settings.kind == "bar_pull" && settings.grasp_shape == data::GraspShape::pinch)
    throw data::InputError("--grasp-shape: found pinch, which folds a corner, expected clamp or point for " +
                           settings.kind);
  if (settings.cameras.empty()) throw data::InputError("--camera: found none, expected at least one");
  if (!(settings.dropped >= 0 && settings.dropped < 1))
    throw data::InputError("--dropped: found " + std::to_string(settings.dropped) +
                           ", expected at least 0 and less than 1");
}

data::Recording recording_of(const data::TriangleMesh& mesh, const std::string& mesh_spec,
                             const SynthSettings& settings) {
  data::Recording recording;
  recording.source = settings.name;
  recording.name = settings.name;
  recording.kind = settings.kind;
  recording.mesh_spec = mesh_spec;
  recording.mesh = mesh;
  recording.start = mesh.vertices;
  recording.has_table = true;
  if (settings.cameras.size() == 1) {
    recording.camera.emplace();
    recording.camera->intrinsics = settings.cameras[0].intrinsics;
    recording.camera->base_from_camera = settings.cameras[0].base_from_camera;
  }
  // Twice what was put in, so that the truth lies well inside the bounds.
  recording.nuisance.offset = 2 * settings.cloud_offset.cwiseAbs();
  recording.nuisance.time = 2 * std::abs(settings.time_offset);
  for (const Hand& hand : hands_of(mesh, settings)) {
    data::RecordedGrasp grasp;
    grasp.gripper = hand.name;
    grasp.select = hand.select;
    grasp.shape = settings.grasp_shape;
    if (grasp.shape == data::GraspShape::pinch) grasp.depth = settings.grasp_within;
    recording.trajectories[hand.name] =
        smooth_motion(patch_middle(recording, grasp).transpose(), hand.displacement, settings);
    recording.grasps.push_back(grasp);
  }
  std::mt19937_64 random(settings.seed);
  std::uniform_real_distribution<double> chance(0, 1);
  const int frames =
      static_cast<int>(std::floor((settings.duration + settings.rest) * settings.keyframe_rate + 1e-9));
  for (int i = 0; i <= frames; ++i) {
    data::RecordedKeyframe keyframe;
    keyframe.time = i / settings.keyframe_rate;
    const double state = keyframe.time + settings.time_offset;
    if (chance(random) >= settings.dropped && state >= 0 && state <= settings.duration + settings.rest)
      recording.keyframes.push_back(keyframe);
  }
  if (recording.keyframes.empty()) throw data::InputError("--dropped: no keyframe is left");
  return recording;
}

// Edges of a single triangle, sampled at even steps.
data::Points border_samples(const data::TriangleMesh& mesh, double spacing) {
  std::map<std::pair<int, int>, int> count;
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t)
    for (int k = 0; k < 3; ++k) ++count[std::minmax(mesh.triangles(t, k), mesh.triangles(t, (k + 1) % 3))];
  std::vector<Eigen::RowVector3d> samples;
  for (const auto& [edge, triangles] : count) {
    if (triangles != 1) continue;
    const Eigen::RowVector3d a = mesh.vertices.row(edge.first), b = mesh.vertices.row(edge.second);
    const int steps = std::max(1, static_cast<int>(std::ceil((b - a).norm() / spacing)));
    for (int i = 0; i < steps; ++i) samples.push_back(a + (b - a) * (i + 0.5) / steps);
  }
  data::Points points(static_cast<Eigen::Index>(samples.size()), 3);
  for (Eigen::Index i = 0; i < points.rows(); ++i) points.row(i) = samples[static_cast<std::size_t>(i)];
  return points;
}

// Whether nothing stands more than 5 mm before the point: the depth of a pixel centre is not the depth beside
// it.
bool is_visible(const Eigen::Vector3d& point, const DepthView& view, const SynthCamera& camera) {
  const Eigen::Vector3d seen = camera.base_from_camera.inverse() * point;
  const auto pixel = data::project(camera.intrinsics, seen);
  if (!pixel) return false;
  const double column = std::round(pixel->x()), row = std::round(pixel->y());
  if (!(column >= 0 && row >= 0 && column < view.depth.cols() && row < view.depth.rows())) return false;
  const auto u = static_cast<Eigen::Index>(column), v = static_cast<Eigen::Index>(row);
  return seen.z() < view.depth(v, u) + 0.005;
}

void append(data::Points& points, const data::Points& more) {
  const Eigen::Index rows = points.rows();
  points.conservativeResize(rows + more.rows(), 3);
  points.bottomRows(more.rows()) = more;
}

data::Points visible_border(const data::TriangleMesh& sheet, const DepthView& view, const SynthCamera& camera,
                            double noise, std::mt19937_64& random) {
  std::normal_distribution<double> normal(0.0, 1.0);
  const data::Points border = border_samples(sheet, 0.003);
  data::Points visible(border.rows(), 3);
  Eigen::Index rows = 0;
  for (Eigen::Index i = 0; i < border.rows(); ++i) {
    const Eigen::Vector3d point = border.row(i).transpose();
    if (!is_visible(point, view, camera)) continue;
    const Eigen::Vector3d ray = (point - camera.base_from_camera.translation()).normalized();
    visible.row(rows++) = (point + noise * normal(random) * ray).transpose();
  }
  visible.conservativeResize(rows, 3);
  return visible;
}

/// A table far larger than what is on it, a little below the sheet's middle surface, of cells: what reaches
/// behind a camera is not drawn.
data::TriangleMesh table_mesh() {
  constexpr double kBelow = 1e-4;  // [m]
  data::TriangleMesh mesh = data::parse_mesh_spec("sheet:2x2:0.05", "table");
  mesh.vertices.rowwise() += Eigen::RowVector3d(-0.85, -0.85, -kBelow);
  return mesh;
}

/// Whole millimetres with noise, as depth cameras give them; 0 where nothing is seen.
data::DepthImage depth_image(const DepthView& view, double noise, std::mt19937_64& random) {
  std::normal_distribution<double> normal(0.0, 1.0);
  data::DepthImage image;
  image.width = static_cast<int>(view.depth.cols());
  image.height = static_cast<int>(view.depth.rows());
  for (Eigen::Index v = 0; v < view.depth.rows(); ++v)
    for (Eigen::Index u = 0; u < view.depth.cols(); ++u) {
      const double depth = 1e3 * (view.depth(v, u) + noise * normal(random));
      image.pixels.push_back(depth > 0 && depth < 65535 ? static_cast<std::uint16_t>(std::lround(depth)) : 0);
    }
  return image;
}

void save_raw(const SynthCamera& camera, const std::vector<data::DepthImage>& images,
              const std::string& folder) {
  const std::filesystem::path base(folder);
  std::filesystem::create_directories(base / "depth");
  data::save_camera_info(camera.intrinsics, (base / "camera_info.yaml").string());
  const Eigen::Vector3d p = camera.base_from_camera.translation();
  const Eigen::Quaterniond q(camera.base_from_camera.linear());
  const nlohmann::ordered_json json = {{"schema", "flash-extrinsics/2"},
                                       {"transform",
                                        {{"parent", "base"},
                                         {"child", "camera"},
                                         {"translation", {p.x(), p.y(), p.z()}},
                                         {"rotation_xyzw", {q.x(), q.y(), q.z(), q.w()}}}}};
  data::write_atomically((base / "extrinsics.json").string(), data::format_json(json));
  for (std::size_t i = 0; i < images.size(); ++i) {
    char name[48];
    std::snprintf(name, sizeof name, "%03zu.png", i);
    data::save_depth_image(images[i], (base / "depth" / name).string());
  }
}

std::string frame_path(const std::string& folder, std::size_t i, const char* suffix) {
  char name[48];
  std::snprintf(name, sizeof name, "%03zu%s.ply", i, suffix);
  return (std::filesystem::path(folder) / "frames" / name).string();
}

}  // namespace

SynthRecording synthesize(const data::TriangleMesh& mesh, const std::string& mesh_spec,
                          const data::SheetMaterial& material, const SynthSettings& settings,
                          const sim::SolverSettings& solver) {
  check(settings);
  SynthRecording synthetic;
  synthetic.recording = recording_of(mesh, mesh_spec, settings);

  Replay replay;
  replay.recording = synthetic.recording;
  replay.settings.solver = solver;
  replay.settings.clamp_slopes = settings.clamp_slopes;
  replay.settings.self_contact = settings.self_contact;
  replay.settings.grasp_cell = settings.grasp_cell;
  replay.settings.device = settings.device.device;
  replay.settings.cuda_devices = settings.device.cuda_devices;
  grade_towards_grasps(replay.settings, replay.recording);
  replay.surface = replay.recording.mesh;
  sim::Sheet sheet = sim::make_sheet(replay.surface);
  if (settings.clamp_slopes) stiffen_clamped(replay, sheet);
  replay.plan = sim::make_sheet_plan(sheet);
  const int closing = steps_in(pre_roll_of(replay.recording, replay.settings), solver.time_step);
  replay.start = -closing * solver.time_step;
  replay.steps = closing + steps_in(settings.duration + settings.rest, solver.time_step);
  replay.schedule = gripper_schedule(replay);
  for (const data::RecordedKeyframe& keyframe : synthetic.recording.keyframes)
    replay.observations.push_back({.t = keyframe.time + settings.time_offset});
  check_job({replay}, 1, estimate_batch({replay}, 1));
  const std::vector<ReplayCandidate> truth = {{material, settings.nuisance}};
  if (replay.settings.device == sim::Device::cuda)
    if (const std::string why = why_not_on_device(replay, truth); !why.empty()) throw data::InputError(why);
  Motion motion;
  run(replay, truth, scored_steps(replay), [&](std::size_t, ReplayResult result) {
    synthetic.residual_max = result.residual_max;
    synthetic.unconverged_share = result.unconverged_share;
    motion = std::move(result.motion);
  });
  std::mt19937_64 random(settings.seed + 1), raw_random(settings.seed + 2);
  if (settings.raw) {
    synthetic.cameras = settings.cameras;
    for (SynthCamera& stated : synthetic.cameras)
      stated.base_from_camera.translation() += settings.cloud_offset;
    synthetic.raw.resize(settings.cameras.size());
  }
  for (data::RecordedKeyframe& keyframe : synthetic.recording.keyframes) {
    const double t = keyframe.time + settings.time_offset;
    std::vector<data::TriangleMesh> surfaces = {replay.surface};
    surface_at(motion, t, surfaces[0].vertices);
    if (settings.gripper_half_extents.minCoeff() > 0)
      for (const data::RecordedGrasp& grasp : synthetic.recording.grasps) {
        Eigen::Isometry3d box = data::pose_at(synthetic.recording.trajectories.at(grasp.gripper), t);
        box.translate(Eigen::Vector3d(0, 0, settings.gripper_half_extents.z() - 0.005));
        surfaces.push_back(box_mesh(settings.gripper_half_extents, box));
      }
    data::Points cloud(0, 3), contour(0, 3);
    for (const SynthCamera& camera : settings.cameras) {
      const DepthView view = render_depth(camera.intrinsics, camera.base_from_camera, surfaces);
      append(cloud, visible_points(view, 0, camera.intrinsics, camera.base_from_camera, settings.depth_noise,
                                   random));
      if (in_plane(settings.kind))
        append(contour, visible_border(surfaces[0], view, camera, settings.depth_noise, random));
    }
    if (settings.raw) surfaces.push_back(table_mesh());
    for (std::size_t c = 0; c < synthetic.raw.size(); ++c)
      synthetic.raw[c].push_back(depth_image(
          render_depth(settings.cameras[c].intrinsics, settings.cameras[c].base_from_camera, surfaces),
          settings.depth_noise, raw_random));
    cloud.rowwise() += settings.cloud_offset.transpose();
    contour.rowwise() += settings.cloud_offset.transpose();
    synthetic.clouds.push_back(std::move(cloud));
    synthetic.contours.push_back(std::move(contour));
    if (settings.forces) keyframe.force = force_at(motion, t);
  }
  return synthetic;
}

void save_synthetic(SynthRecording& synthetic, const std::string& folder) {
  data::Recording& recording = synthetic.recording;
  const std::filesystem::path base(folder);
  std::filesystem::create_directories(base / "frames");
  for (const auto& [name, trajectory] : recording.trajectories) {
    recording.trajectory_paths[name] = (base / (name + ".tum")).string();
    data::save_tum(trajectory, recording.trajectory_paths[name]);
  }
  if (recording.camera) {
    recording.camera->intrinsics_path = (base / "camera_info.yaml").string();
    data::save_camera_info(recording.camera->intrinsics, recording.camera->intrinsics_path);
  }
  for (std::size_t i = 0; i < recording.keyframes.size(); ++i) {
    recording.keyframes[i].cloud = frame_path(folder, i, "");
    data::save_point_cloud(synthetic.clouds[i], recording.keyframes[i].cloud);
    if (synthetic.contours[i].rows() == 0) continue;
    recording.keyframes[i].contour = frame_path(folder, i, "_contour");
    data::save_point_cloud(synthetic.contours[i], recording.keyframes[i].contour);
  }
  for (std::size_t c = 0; c < synthetic.raw.size(); ++c)
    save_raw(synthetic.cameras[c], synthetic.raw[c], (base / ("camera" + std::to_string(c + 1))).string());
  data::save_recording(recording, (base / "recording.json").string());
}

std::string truth_text(const data::SheetMaterial& material, const SynthSettings& settings) {
  nlohmann::ordered_json json;
  json["schema"] = "flash-truth/1";
  json["constitutive"] = data::to_string(material.constitutive);
  json["bending_model"] = data::to_string(material.bending_model);
  json["membrane_stiffness"] = material.membrane_stiffness;
  json["parameters"] = {{"poisson", material.poissons_ratio},
                        {"bending", material.bending_rigidity},
                        {"bending_ratio", material.weave.bending_ratio},
                        {"young_ratio", material.weave.young_ratio},
                        {"shear_ratio", material.weave.shear_ratio},
                        {"areal_density", material.areal_density},
                        {"friction", material.friction},
                        {"air_drag", material.air_drag},
                        {"stiffness_damping", material.stiffness_damping}};
  if (std::isfinite(material.yield_curvature))
    json["parameters"]["yield_curvature"] = material.yield_curvature;
  const ReplayNuisance& grasped = settings.nuisance;
  for (const auto& [name, value] :
       {std::pair{"grasp_size", grasped.grasp_size}, std::pair{"grasp_stiffness", grasped.grasp_stiffness},
        std::pair{"grasp_depth", grasped.grasp_depth}, std::pair{"grasp_direction", grasped.grasp_direction},
        std::pair{"grasp_pitch", grasped.grasp_pitch}})
    if (value) json["parameters"][name] = *value;
  json["offset"] = {settings.cloud_offset.x(), settings.cloud_offset.y(), settings.cloud_offset.z()};
  json["time_offset"] = settings.time_offset;
  json["depth_noise_m"] = settings.depth_noise;
  json["seed"] = settings.seed;
  return data::format_json(json);
}

}  // namespace flash::sysid
