#include "sysid/replay.h"

#include <algorithm>
#include <cmath>

#include "data/error.h"
#include "data/mesh_io.h"
#include "data/procedural_mesh.h"
#include "data/scene.h"
#include "data/text.h"

namespace flash::sysid {
namespace {

data::GraspShape shape_of(const data::RecordedGrasp& grasp, const ReplaySettings& settings) {
  return settings.grasp_shape.value_or(grasp.shape);
}

/// Without gravity the table's normal, and z where there is no table either.
Eigen::Vector3d upward(const data::Recording& recording) {
  if (recording.gravity.norm() > 0) return -recording.gravity.normalized();
  return recording.has_table ? recording.table_normal : Eigen::Vector3d::UnitZ();
}

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

/// Turns `start` about the axis `up` through `pivot`.
void turn(data::Points& points, const Eigen::Vector3d& pivot, const Eigen::Vector3d& up, double angle) {
  const Eigen::Matrix3d rotation = Eigen::AngleAxisd(angle, up).toRotationMatrix();
  points = ((points.rowwise() - pivot.transpose()) * rotation.transpose()).rowwise() + pivot.transpose();
}

const data::Trajectory& trajectory_of(const data::Recording& recording, const data::RecordedGrasp& grasp) {
  const auto found = recording.trajectories.find(grasp.gripper);
  if (found == recording.trajectories.end()) {
    throw data::input_error(recording.source, "grasps.gripper",
                            "\"" + grasp.gripper + "\" is not among the trajectories");
  }
  return found->second;
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

/// The vertices of `mesh` inside the bounding box, at rest, of those that were taken on the recording's own.
std::vector<int> same_place(const std::vector<int>& taken, const data::TriangleMesh& own,
                            const data::TriangleMesh& mesh, const std::string& source) {
  Eigen::AlignedBox3d box;
  for (const int vertex : taken) box.extend(own.vertices.row(vertex).transpose());
  const double slack = 1e-6 * (own.vertices.colwise().maxCoeff() - own.vertices.colwise().minCoeff()).norm();
  std::vector<int> vertices;
  for (Eigen::Index i = 0; i < mesh.vertices.rows(); ++i)
    if (box.exteriorDistance(Eigen::Vector3d(mesh.vertices.row(i))) <= slack)
      vertices.push_back(static_cast<int>(i));
  if (vertices.empty())
    throw data::input_error(source, "grasps.select.vertices", "none of the other mesh lies where these do");
  return vertices;
}

/// Replaces the recording's mesh; the start follows its pose, grasps the place of their vertices.
void replace_mesh(data::Recording& recording, const std::string& mesh) {
  if (!recording.start_mesh.empty()) {
    throw data::input_error(recording.source, "object.start",
                            "is a mesh of its own, so that the sheet cannot be meshed anew as " + mesh);
  }
  const data::TriangleMesh own = std::move(recording.mesh);
  recording.mesh = data::is_mesh_spec(mesh) ? data::parse_mesh_spec(mesh) : data::load_triangle_mesh(mesh);
  for (data::RecordedGrasp& grasp : recording.grasps)
    if (!grasp.select.vertices.empty())
      grasp.select.vertices = same_place(grasp.select.vertices, own, recording.mesh, recording.source);
  recording.mesh_spec = mesh;
  recording.start = (recording.mesh.vertices * recording.base_from_object.linear().transpose()).rowwise() +
                    recording.base_from_object.translation().transpose();
}

/// Throws data::InputError where --from and --to leave nothing to score.
void check_window(const Replay& replay) {
  if (replay.observations.empty())
    throw data::input_error(replay.recording.source, "keyframes", "there is none");
  const auto inside = [&](const Observation& observation) {
    return observation.t >= replay.settings.score_from && observation.t <= replay.settings.score_to;
  };
  if (std::none_of(replay.observations.begin(), replay.observations.end(), inside))
    throw data::InputError(
        "--from, --to: " + replay.recording.source + " has no keyframe between; they span " +
        data::format_clock(replay.observations.front().t) + " to " +
        data::format_clock(replay.observations.back().t) + " s after the recording's start");
}

/// Steps from `start` until the last keyframe can have been seen. Throws data::InputError, naming the cause,
/// where they are more than data::max_steps.
int count_steps(const data::Recording& recording, double start, double step) {
  const double first = recording.keyframes.front().time, last = recording.keyframes.back().time;
  const double duration = last + recording.nuisance.time - start;
  constexpr double kUsual = 600;  // what takes longer is at fault itself [s]
  if (duration > kUsual && duration / step > data::max_steps)
    throw data::input_error(recording.source, first - start > last - first ? "grasps.from" : "keyframes",
                            "found " + data::format_short(first - start) +
                                " s before the first keyframe and " + data::format_short(last - first) +
                                " s to the last, expected at most " + data::format_count(data::max_steps) +
                                " steps of " + data::format_short(step) + " s: cut off what does not move");
  return steps_in(duration, step) + 1;
}

}  // namespace

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

int steps_in(double duration, double step) {
  // Time stamps since 1970 know a time to 2e-7 s.
  const double steps = std::ceil(duration / step - 1e-3);
  if (steps <= data::max_steps) return static_cast<int>(steps);
  throw data::InputError("--time-step: found " + data::format_short(step) + " s, which makes " +
                         data::format_short(steps) + " steps of " + data::format_short(duration) +
                         " s, expected at most " + data::format_count(data::max_steps) + ": take at least " +
                         data::format_short(1.01 * duration / data::max_steps) + " s");
}

void stiffen_clamped(Replay& replay) {
  for (const data::RecordedGrasp& grasp : replay.recording.grasps) {
    if (shape_of(grasp, replay.settings) != data::GraspShape::clamp || grasp.from > replay.beginning ||
        !std::isinf(grasp.to))
      continue;
    std::vector<bool> held(static_cast<std::size_t>(replay.recording.mesh.vertices.rows()), false);
    for (const int vertex : patch_of(replay, grasp, {})) held[static_cast<std::size_t>(vertex)] = true;
    for (sim::RestTriangle& triangle : replay.sheet.triangles)
      if (std::all_of(triangle.vertices.begin(), triangle.vertices.end(),
                      [&](int vertex) { return held[static_cast<std::size_t>(vertex)]; }))
        triangle.stiff = true;
  }
}

Replay make_replay(const data::Recording& recording, const ReplaySettings& settings) {
  Replay replay;
  replay.recording = recording;
  replay.settings = settings;
  replay.object_mesh = recording.mesh_spec;
  if (!settings.mesh.empty()) replace_mesh(replay.recording, settings.mesh);
  replay.sheet = sim::make_sheet(replay.recording.mesh);
  replay.up = upward(recording);

  // Marks are named by vertices of the recording's own mesh.
  replay.queries =
      std::make_shared<const SheetQueries>(replay.recording.mesh.triangles, replay.recording.mesh.vertices);
  for (const data::Keyframe& keyframe : data::load_keyframes(recording, replay.notices)) {
    Observation observation{.t = keyframe.time,
                            .points = keyframe.cloud,
                            .contour = keyframe.contour,
                            .markers = keyframe.markers,
                            .force = keyframe.force};
    for (const int vertex : keyframe.marker_vertices)
      observation.marks.push_back(replay.queries->nearest(recording.mesh.vertices.row(vertex).transpose()));
    const bool weighs =
        keyframe.time >= settings.score_from && keyframe.time <= settings.score_to &&
        (keyframe.cloud.rows() >= settings.min_points || keyframe.contour.rows() >= settings.min_points ||
         keyframe.markers.rows() > 0 || keyframe.force);
    observation.weight = weighs ? 1 : 0;
    replay.observations.push_back(std::move(observation));
  }
  check_window(replay);

  replay.beginning = replay.observations.front().t;
  bool closes = false;
  for (const data::RecordedGrasp& grasp : recording.grasps) {
    replay.beginning = std::min(replay.beginning, grasp.from);
    closes = closes || shape_of(grasp, settings) == data::GraspShape::pinch;
  }
  if (settings.clamp_slopes) stiffen_clamped(replay);
  const double pre_roll = settings.pre_roll.value_or(closes ? 0.4 : 0.0);
  const double step = settings.solver.time_step;
  replay.start = replay.beginning - steps_in(pre_roll, step) * step;
  replay.steps = count_steps(recording, replay.start, step);

  if (recording.grasps.empty()) {
    replay.pivot = replay.recording.start.colwise().mean().transpose();
  } else {
    const data::RecordedGrasp& grasp = recording.grasps.front();
    replay.pivot = data::pose_at(trajectory_of(recording, grasp), grasp.from).translation();
  }
  return replay;
}

sim::Environment make_environment(const Replay& replay, const ReplayCandidate& candidate) {
  const data::Recording& recording = replay.recording;
  const ReplayNuisance& nuisance = candidate.nuisance;
  data::Points flat = recording.start;
  turn(flat, replay.pivot, replay.up, nuisance.start_yaw);
  const Eigen::RowVector3d raise = nuisance.table_height * replay.up.transpose();

  sim::Environment environment;
  environment.material = candidate.material;
  environment.gravity = recording.gravity;
  environment.state.time = replay.start;
  environment.state.positions = flat.rowwise() + raise;
  environment.state.velocities = data::Points::Zero(flat.rows(), 3);
  if (recording.has_table) {
    environment.obstacles.push_back(
        {sim::Plane{.point = recording.table_point + raise.transpose(), .normal = recording.table_normal}});
  }
  for (const data::RecordedGrasp& recorded : recording.grasps) {
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
      if (recording.has_table) {  // fingers do not push the patch into the table
        const Eigen::Vector3d surface = recording.table_point + raise.transpose();
        const double deepest =
            ((targets.rowwise() - surface.transpose()) * recording.table_normal).minCoeff();
        if (deepest < 0) targets.rowwise() -= deepest * recording.table_normal.transpose();
      }
      const Eigen::Isometry3d gripper = data::pose_at(grasp.gripper, grasp.from);
      grasp.targets = (targets.rowwise() - gripper.translation().transpose()) * gripper.linear();
    }
    environment.grasps.push_back(std::move(grasp));
  }
  return environment;
}

std::vector<ReplayResult> run(const Replay& replay, const std::vector<ReplayCandidate>& candidates) {
  std::vector<sim::Environment> environments;
  for (const ReplayCandidate& candidate : candidates)
    environments.push_back(make_environment(replay, candidate));
  std::vector<sim::Rollout> rollouts = sim::simulate(replay.sheet, std::move(environments), replay.steps,
                                                     replay.settings.solver, replay.settings.threads);
  std::vector<ReplayResult> results;
  for (sim::Rollout& rollout : rollouts) {
    ReplayResult& result = results.emplace_back();
    result.motion = {replay.start, replay.settings.solver.time_step, std::move(rollout.positions)};
    for (const sim::StepReport& report : rollout.reports)
      result.motion.forces.push_back(report.grasp_forces.empty() ? Eigen::Vector3d::Zero()
                                                                 : report.grasp_forces.back());
    int missed = 0;
    for (const sim::StepReport& report : rollout.reports) {
      missed += !(report.converged && std::isfinite(report.residual));
      result.residual_max = sim::worst(result.residual_max, report.residual);
      result.penetration_max = sim::worst(result.penetration_max, report.penetration_max);
    }
    result.converged = missed == 0;
    result.unconverged_share =
        rollout.reports.empty() ? 0 : missed / static_cast<double>(rollout.reports.size());
    result.finite =
        std::all_of(result.motion.positions.begin(), result.motion.positions.end(),
                    [](const data::Points& p) { return p.allFinite() && p.cwiseAbs().maxCoeff() < 1e4; });
  }
  return results;
}

RegistrationProblem registration_problem(const Replay& replay, const Motion& motion) {
  RegistrationProblem problem;
  problem.triangles = &replay.recording.mesh.triangles;
  problem.motion = &motion;
  problem.observations = &replay.observations;
  problem.sheet = replay.queries.get();
  problem.bounds = {replay.recording.nuisance.offset, replay.recording.nuisance.yaw,
                    replay.recording.nuisance.time};
  problem.start.pivot = replay.pivot;
  problem.start.up = replay.up;
  problem.crop = replay.recording.crop;
  return problem;
}

}  // namespace flash::sysid
