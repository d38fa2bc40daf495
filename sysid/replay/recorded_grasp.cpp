#include "sysid/replay/recorded_grasp.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "data/files/error.h"
#include "data/files/text.h"
#include "sim/scene/grasp.h"
#include "sim/scene/slopes.h"
#include "sim/scene/solid.h"

namespace flash::sysid {

namespace {

/// The corner of the rest sheet's bounding rectangle that a selection names.
Eigen::RowVector3d corner_of(const data::TriangleMesh& mesh, const std::array<int, 2>& corner) {
  Eigen::RowVector3d position = mesh.vertices.colwise().minCoeff();
  const Eigen::RowVector3d high = mesh.vertices.colwise().maxCoeff();
  for (int k = 0; k < 2; ++k) {
    if (corner[k] == 1) position[k] = high[k];
  }
  return position;
}

/// The vertex of a patch that a grasp in a point would hold.
int nearest_to_point(const Replay& replay, const data::RecordedGrasp& grasp, const std::vector<int>& patch) {
  const data::Points& rest = replay.recording.mesh.vertices;
  Eigen::RowVector3d held = rest.row(patch.front());
  if (grasp.select.corner) {
    held = corner_of(replay.recording.mesh, *grasp.select.corner);
  } else if (grasp.select.position) {
    const Eigen::Isometry3d gripper = data::pose_at(trajectory_of(replay.recording, grasp), grasp.from);
    held = (replay.recording.base_from_object.inverse() * (gripper * *grasp.select.position)).transpose();
  }
  return *std::min_element(patch.begin(), patch.end(), [&](int i, int j) {
    return (rest.row(i) - held).squaredNorm() < (rest.row(j) - held).squaredNorm();
  });
}

/// Springs between the vertices of a patch and pads that give way, a Winkler foundation of `modulus` [N/m^3]
/// under the triangles inside the patch. The vertex that a grasp in a point would hold is held rigidly: so
/// the softest pads are a point, and the stiffest a clamp.
Eigen::VectorXd pad_stiffness(const Replay& replay, const data::RecordedGrasp& grasp, double modulus,
                              const std::vector<int>& patch) {
  std::map<int, double> area;  // of the pads [m^2]
  for (const int vertex : patch) area[vertex] = 0;
  for (const sim::RestTriangle& triangle : replay.sheet().triangles)
    if (std::all_of(triangle.vertices.begin(), triangle.vertices.end(),
                    [&](int vertex) { return area.contains(vertex); }))
      for (const int vertex : triangle.vertices) area[vertex] += triangle.area / 3;
  area[nearest_to_point(replay, grasp, patch)] = std::numeric_limits<double>::infinity();
  Eigen::VectorXd stiffness(static_cast<Eigen::Index>(patch.size()));
  for (std::size_t i = 0; i < patch.size(); ++i)
    stiffness[static_cast<Eigen::Index>(i)] = modulus * area[patch[i]];
  return stiffness;
}

/// The patch a grasp of this shape takes.
std::vector<int> patch_of(const Replay& replay, const data::RecordedGrasp& recorded,
                          const ReplayNuisance& nuisance) {
  data::RecordedGrasp grasp = recorded;
  const data::GraspShape shape = shape_of(recorded, replay.settings);
  if (replay.settings.grasp_within) grasp.select.within = *replay.settings.grasp_within;
  if (shape == data::GraspShape::pinch) grasp.select.within = nuisance.grasp_depth.value_or(recorded.depth);
  std::vector<int> patch = data::select_vertices(replay.recording, grasp);
  if (shape != data::GraspShape::point)
    return replay.recording.is_solid() ? sim::with_midsides(replay.sheet(), patch) : patch;
  return {nearest_to_point(replay, grasp, patch)};
}

}  // namespace

data::GraspShape shape_of(const data::RecordedGrasp& grasp, const ReplaySettings& settings) {
  return settings.grasp_shape.value_or(grasp.shape);
}

void check_patch_size(double within, const data::TriangleMesh& mesh) {
  const double longer = (mesh.vertices.colwise().maxCoeff() - mesh.vertices.colwise().minCoeff()).maxCoeff();
  if (within <= 0.5 * longer) return;
  throw data::InputError("--grasp-within: found " + data::format_short(within) +
                         " m, expected at most half of the sheet's longer side, " +
                         data::format_short(0.5 * longer) + " m (25 mm are 0.025)");
}

double held_extent(const Replay& replay, const data::RecordedGrasp& grasp) {
  const data::Points& rest = replay.recording.mesh.vertices;
  const std::vector<int> patch = patch_of(replay, grasp, {});
  double extent = 0;
  for (const int i : patch)
    for (const int j : patch) extent = std::max(extent, (rest.row(i) - rest.row(j)).norm());
  return extent;
}

const data::Trajectory& trajectory_of(const data::Recording& recording, const data::RecordedGrasp& grasp) {
  const auto found = recording.trajectories.find(grasp.gripper);
  if (found == recording.trajectories.end()) {
    throw data::input_error(recording.source, "grasps.gripper",
                            "\"" + grasp.gripper + "\" is not among the trajectories");
  }
  return found->second;
}

void stiffen_clamped(const Replay& replay, sim::Sheet& sheet) {
  for (const data::RecordedGrasp& grasp : replay.recording.grasps) {
    if (shape_of(grasp, replay.settings) != data::GraspShape::clamp || grasp.from > replay.beginning ||
        !std::isinf(grasp.to))
      continue;
    sim::keep_slopes(patch_of(replay, grasp, {}), sheet);
  }
}

void check_grasps_act(const Replay& replay) {
  const double step = replay.settings.solver.time_step;
  for (std::size_t k = 0; k < replay.recording.grasps.size(); ++k) {
    const data::RecordedGrasp& grasp = replay.recording.grasps[k];
    const double first = std::max(0.0, std::ceil((grasp.from - replay.start) / step - 0.5));
    const double middle = replay.start + (first + 0.5) * step;
    if (first < replay.steps && middle >= grasp.to)
      throw data::input_error(replay.recording.source, "grasps[" + std::to_string(k) + "]",
                              "found " + data::format_short(grasp.to - grasp.from) +
                                  " s between from and to, expected the middle of a step of " +
                                  data::format_short(step) + " s between them: it would never close");
  }
}

std::shared_ptr<const sim::Schedule> gripper_schedule(const Replay& replay) {
  std::vector<data::Trajectory> grippers;
  for (const data::RecordedGrasp& grasp : replay.recording.grasps)
    grippers.push_back(trajectory_of(replay.recording, grasp));
  return sim::make_schedule(grippers, replay.start, replay.settings.solver.time_step, replay.steps);
}

sim::Hold make_hold(const Replay& replay, const data::RecordedGrasp& recorded, int frame,
                    const ReplayNuisance& nuisance, const data::Points& flat) {
  const data::Recording& recording = replay.recording;
  const bool from_beginning = recorded.from <= replay.beginning;
  sim::Hold hold{.name = recorded.gripper,
                 .vertices = patch_of(replay, recorded, nuisance),
                 .frame = frame,
                 .from = from_beginning ? replay.start : recorded.from,
                 .to = recorded.to};
  const double available = from_beginning ? replay.beginning - replay.start : replay.settings.closing_time;
  hold.closing_time = std::min(replay.settings.closing_time, available);

  const data::GraspShape shape = shape_of(recorded, replay.settings);
  const bool pinched = shape == data::GraspShape::pinch;
  if (shape == data::GraspShape::clamp && nuisance.grasp_stiffness.value_or(rigid_pads) < rigid_pads)
    hold.stiffness = pad_stiffness(replay, recorded, *nuisance.grasp_stiffness, hold.vertices);
  if (!from_beginning || (!pinched && nuisance.table_height == 0)) return hold;
  data::Points targets = flat(hold.vertices, Eigen::all);
  if (pinched) {
    const bool given = recorded.direction.norm() > 0 && !nuisance.grasp_direction;
    const Eigen::AngleAxisd turned(nuisance.grasp_direction.value_or(0.0), replay.up);
    const Eigen::Vector3d diagonal = turned * sim::towards_middle(flat, hold.vertices, replay.up);
    const auto& layers = replay.settings.self_contact;
    targets =
        sim::pinch_targets(targets, given ? recorded.direction : diagonal, replay.up,
                           nuisance.grasp_pitch.value_or(recorded.pitch), layers ? layers->thickness : 0);
  }
  if (recording.has_table)
    sim::raise_above(recording.table_point + nuisance.table_height * replay.up, recording.table_normal,
                     targets);
  const Eigen::Isometry3d gripper = data::pose_at(trajectory_of(recording, recorded), hold.from);
  hold.targets = (targets.rowwise() - gripper.translation().transpose()) * gripper.linear();
  return hold;
}

void add_supports(const Replay& replay, sim::Environment& environment) {
  const data::Recording& recording = replay.recording;
  for (const data::RecordedSupport& support : recording.supports)
    environment.holds.push_back(
        {.name = support.name,
         .vertices =
             sim::with_midsides(replay.sheet(), data::select_vertices(recording, support.select, "supports")),
         .from = support.from <= replay.beginning ? replay.start : support.from,
         .to = support.to});
  for (const data::RecordedLoad& load : recording.loads) {
    const std::vector<int> vertices = data::select_vertices(recording, load.select, "loads");
    for (const int vertex : vertices)
      environment.point_masses.push_back({vertex, load.attached_mass / static_cast<double>(vertices.size())});
  }
}

}  // namespace flash::sysid
