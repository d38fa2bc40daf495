#include "sysid/replay/grasp_targets.h"

#include <algorithm>
#include <cmath>

#include "data/error.h"

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

/// Unit vector in the plane of the sheet from the grasped patch towards the middle of the sheet, base frame.
Eigen::Vector3d inward(const data::Points& start, const std::vector<int>& patch, const Eigen::Vector3d& up) {
  Eigen::RowVector3d centre = Eigen::RowVector3d::Zero();
  for (const int vertex : patch) centre += start.row(vertex);
  centre /= static_cast<double>(patch.size());
  Eigen::Vector3d direction = (start.colwise().mean() - centre).transpose();
  direction -= direction.dot(up) * up;
  return direction.norm() > 1e-9 ? Eigen::Vector3d(direction.normalized()) : up.unitOrthogonal();
}

/// The patch a grasp of this shape takes.
std::vector<int> patch_of(const Replay& replay, const data::RecordedGrasp& recorded,
                          const ReplayNuisance& nuisance) {
  data::RecordedGrasp grasp = recorded;
  const data::GraspShape shape = shape_of(recorded, replay.settings);
  if (replay.settings.grasp_within) grasp.select.within = *replay.settings.grasp_within;
  if (shape == data::GraspShape::pinch) grasp.select.within = nuisance.grasp_depth.value_or(recorded.depth);
  std::vector<int> patch = data::select_vertices(replay.recording, grasp);
  if (shape != data::GraspShape::point) return patch;
  const data::Points& rest = replay.recording.mesh.vertices;
  Eigen::RowVector3d held = rest.row(patch.front());
  if (grasp.select.corner) {
    held = corner_of(replay.recording.mesh, *grasp.select.corner);
  } else if (grasp.select.position) {
    const Eigen::Isometry3d gripper = data::pose_at(trajectory_of(replay.recording, grasp), grasp.from);
    held = (replay.recording.base_from_object.inverse() * (gripper * *grasp.select.position)).transpose();
  }
  const auto nearer = [&](int i, int j) {
    return (rest.row(i) - held).squaredNorm() < (rest.row(j) - held).squaredNorm();
  };
  return {*std::min_element(patch.begin(), patch.end(), nearer)};
}

}  // namespace

data::GraspShape shape_of(const data::RecordedGrasp& grasp, const ReplaySettings& settings) {
  return settings.grasp_shape.value_or(grasp.shape);
}

const data::Trajectory& trajectory_of(const data::Recording& recording, const data::RecordedGrasp& grasp) {
  const auto found = recording.trajectories.find(grasp.gripper);
  if (found == recording.trajectories.end()) {
    throw data::input_error(recording.source, "grasps.gripper",
                            "\"" + grasp.gripper + "\" is not among the trajectories");
  }
  return found->second;
}

data::Points pinch_targets(const data::Points& flat, const Eigen::Vector3d& ridge, const Eigen::Vector3d& up,
                           double pitch) {
  const Eigen::Vector3d centre = flat.colwise().mean();
  const Eigen::Vector3d across = up.cross(ridge).normalized();
  const Eigen::Vector3d along = across.cross(up);
  const Eigen::VectorXd b = ((flat.rowwise() - centre.transpose()) * across).cwiseAbs();
  const double height = b.maxCoeff();
  const Eigen::Matrix3d tilt = Eigen::AngleAxisd(pitch, across).toRotationMatrix();
  data::Points targets(flat.rows(), 3);
  for (Eigen::Index i = 0; i < flat.rows(); ++i) {
    const double a = (flat.row(i).transpose() - centre).dot(along);
    targets.row(i) = (centre + tilt * (a * along + (height - b[i]) * up)).transpose();
  }
  return targets;
}

void stiffen_clamped(const Replay& replay, sim::Sheet& sheet) {
  for (const data::RecordedGrasp& grasp : replay.recording.grasps) {
    if (shape_of(grasp, replay.settings) != data::GraspShape::clamp || grasp.from > replay.beginning ||
        !std::isinf(grasp.to))
      continue;
    std::vector<bool> held(static_cast<std::size_t>(replay.recording.mesh.vertices.rows()), false);
    for (const int vertex : patch_of(replay, grasp, {})) held[static_cast<std::size_t>(vertex)] = true;
    for (sim::RestTriangle& triangle : sheet.triangles)
      if (std::all_of(triangle.vertices.begin(), triangle.vertices.end(),
                      [&](int vertex) { return held[static_cast<std::size_t>(vertex)]; }))
        triangle.stiff = true;
  }
}

sim::Grasp make_grasp(const Replay& replay, const data::RecordedGrasp& recorded,
                      const ReplayNuisance& nuisance, const data::Points& flat) {
  const data::Recording& recording = replay.recording;
  const Eigen::RowVector3d raise = nuisance.table_height * replay.up.transpose();
  sim::Grasp grasp;
  grasp.vertices = patch_of(replay, recorded, nuisance);
  grasp.gripper = trajectory_of(recording, recorded);
  grasp.to = recorded.to;
  const bool from_beginning = recorded.from <= replay.beginning;
  grasp.from = from_beginning ? replay.start : recorded.from;
  const double available = from_beginning ? replay.beginning - replay.start : replay.settings.closing_time;
  grasp.closing_time = std::min(replay.settings.closing_time, available);

  const bool pinched = shape_of(recorded, replay.settings) == data::GraspShape::pinch;
  if (from_beginning && (pinched || nuisance.table_height != 0)) {
    data::Points targets = flat(grasp.vertices, Eigen::all);
    if (pinched) {
      const Eigen::Vector3d inner = inward(flat, grasp.vertices, replay.up);
      const bool given = recorded.direction.norm() > 0 && !nuisance.grasp_direction;
      const Eigen::AngleAxisd turned(nuisance.grasp_direction.value_or(0.0), replay.up);
      targets = pinch_targets(targets, given ? recorded.direction : Eigen::Vector3d(turned * inner),
                              replay.up, nuisance.grasp_pitch.value_or(recorded.pitch));
    }
    if (replay.recording.has_table) {  // fingers do not push the patch into the table
      const Eigen::Vector3d surface = recording.table_point + raise.transpose();
      const double deepest = ((targets.rowwise() - surface.transpose()) * recording.table_normal).minCoeff();
      if (deepest < 0) targets.rowwise() -= deepest * recording.table_normal.transpose();
    }
    const Eigen::Isometry3d gripper = data::pose_at(grasp.gripper, grasp.from);
    grasp.targets = (targets.rowwise() - gripper.translation().transpose()) * gripper.linear();
  }
  return grasp;
}

}  // namespace flash::sysid
