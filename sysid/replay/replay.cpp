#include "sysid/replay/replay.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>
#include <optional>

#include "data/files/error.h"
#include "data/files/text.h"
#include "data/numbers/worst.h"
#include "data/scene/scene.h"
#include "sim/batch.h"
#include "sim/device_error.h"
#include "sim/device_limits.h"
#include "sim/scene/solid.h"
#include "sysid/replay/grasp_mesh.h"
#include "sysid/replay/recorded_grasp.h"
#include "sysid/replay/replay_mesh.h"

namespace flash::sysid {
namespace {

/// Without gravity the table's normal, and z where there is no table either.
Eigen::Vector3d upward(const data::Recording& recording) {
  if (recording.gravity.norm() > 0) return -recording.gravity.normalized();
  return recording.has_table ? recording.table_normal : Eigen::Vector3d::UnitZ();
}

/// Turns `start` about the axis `up` through `pivot`.
void turn(data::Points& points, const Eigen::Vector3d& pivot, const Eigen::Vector3d& up, double angle) {
  const Eigen::Matrix3d rotation = Eigen::AngleAxisd(angle, up).toRotationMatrix();
  points = ((points.rowwise() - pivot.transpose()) * rotation.transpose()).rowwise() + pivot.transpose();
}

/// The plan of a solid, and of its vertices those that its outer faces have.
void take_solid(Replay& replay) {
  const data::Recording& recording = replay.recording;
  if (!replay.plan)
    replay.plan = sim::make_sheet_plan(
        sim::make_solid({recording.mesh.vertices, recording.tetrahedra}, {}, replay.settings.element_order));
  const sim::Sheet& solid = replay.sheet();
  if (const int inverted = sim::first_inverted(solid, recording.start); inverted >= 0)
    throw data::input_error(recording.source, "object.start",
                            "turns tetrahedron " + std::to_string(inverted) +
                                " of object.mesh inside out or flat, expected a positive volume");
  for (const data::RecordedGrasp& grasp : recording.grasps)
    if (shape_of(grasp, replay.settings) == data::GraspShape::pinch)
      throw data::input_error(recording.source, "grasps.shape",
                              "found pinch, which folds a sheet, expected clamp or point for a solid");
  std::vector<int> place(static_cast<std::size_t>(solid.rest.vertices.rows()), -1);
  data::Triangles& triangles = replay.surface.triangles;
  triangles = solid.solid_surface;
  for (Eigen::Index t = 0; t < triangles.rows(); ++t)
    for (int k = 0; k < 3; ++k) place[static_cast<std::size_t>(triangles(t, k))] = 0;
  for (std::size_t v = 0; v < place.size(); ++v) {
    if (place[v] < 0) continue;
    place[v] = static_cast<int>(replay.surface_vertices.size());
    replay.surface_vertices.push_back(static_cast<int>(v));
  }
  triangles = triangles.unaryExpr([&](int vertex) { return place[static_cast<std::size_t>(vertex)]; }).eval();
  replay.surface.vertices = solid.rest.vertices(replay.surface_vertices, Eigen::all);
}

/// Throws data::InputError where --from and --until leave nothing to score.
void check_window(const Replay& replay) {
  if (replay.observations.empty())
    throw data::input_error(replay.recording.source, "keyframes", "there is none");
  const auto inside = [&](const Observation& observation) {
    return observation.t >= replay.settings.score_from && observation.t <= replay.settings.score_to;
  };
  if (std::none_of(replay.observations.begin(), replay.observations.end(), inside))
    throw data::InputError(
        "--from, --until: " + replay.recording.source + " has no keyframe between; they span " +
        data::format_clock(replay.observations.front().t) + " to " +
        data::format_clock(replay.observations.back().t) + " s after the recording's start");
}

/// Throws data::InputError where --grasp-within is more than a corner of the sheet.
void check_patch(const Replay& replay) {
  if (!replay.settings.grasp_within || replay.recording.is_solid()) return;
  for (const data::RecordedGrasp& grasp : replay.recording.grasps)
    if (grasp.select.corner) check_patch_size(*replay.settings.grasp_within, replay.recording.mesh);
}

/// Steps from `start` until the last keyframe can have been seen. Throws data::InputError, naming the cause,
/// where they are more than data::max_steps.
int count_steps(const data::Recording& recording, double start, double step) {
  const double first = recording.keyframes.front().time, last = recording.keyframes.back().time;
  const double duration = last + recording.nuisance.time - start;
  constexpr double kUsual = 600;  // What takes longer is at fault itself [s]. Work: a refusal.
  if (duration > kUsual && duration / step > data::max_steps)
    throw data::input_error(recording.source, first - start > last - first ? "grasps.from" : "keyframes",
                            "found " + data::format_short(first - start) +
                                " s before the first keyframe and " + data::format_short(last - first) +
                                " s to the last, expected at most " + data::format_count(data::max_steps) +
                                " steps of " + data::format_short(step) + " s: cut off what does not move");
  return steps_in(duration, step) + 1;
}

}  // namespace

double pre_roll_of(const data::Recording& recording, const ReplaySettings& settings) {
  const bool closes = std::any_of(
      recording.grasps.begin(), recording.grasps.end(),
      [&](const data::RecordedGrasp& grasp) { return shape_of(grasp, settings) == data::GraspShape::pinch; });
  return settings.pre_roll.value_or(closes ? 0.4 : 0.0);
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

namespace {

/// `recording`: on the mesh that is simulated. `observe`: adds what was observed, once the sheet is there.
Replay assemble(data::Recording recording_on_mesh, const ReplaySettings& settings, std::string object_mesh,
                std::shared_ptr<const sim::SheetPlan> plan, const std::function<void(Replay&)>& observe) {
  Replay replay;
  replay.recording = std::move(recording_on_mesh);
  const data::Recording& recording = replay.recording;
  replay.settings = settings;
  replay.object_mesh = std::move(object_mesh);
  replay.up = upward(recording);

  replay.plan = std::move(plan);
  if (replay.recording.is_solid())
    take_solid(replay);
  else
    replay.surface = replay.recording.mesh;
  replay.queries = std::make_shared<const SheetDistance>(replay.surface.triangles, replay.surface.vertices);
  observe(replay);
  check_window(replay);
  check_patch(replay);

  replay.beginning = replay.observations.front().t;
  for (const data::RecordedGrasp& grasp : recording.grasps)
    replay.beginning = std::min(replay.beginning, grasp.from);
  for (const data::RecordedSupport& support : recording.supports)
    if (std::isfinite(support.from)) replay.beginning = std::min(replay.beginning, support.from);
  if (!replay.plan) {
    sim::Sheet sheet = sim::make_sheet(replay.recording.mesh);
    if (settings.clamp_slopes) stiffen_clamped(replay, sheet);
    replay.plan = sim::make_sheet_plan(sheet);
  }
  if (settings.self_contact)
    sim::check_self_contact(replay.sheet(), settings.self_contact->thickness,
                            sim::with_midsides(replay.sheet(), replay.recording.start));
  const double step = settings.solver.time_step;
  replay.start = replay.beginning - steps_in(pre_roll_of(recording, settings), step) * step;
  replay.steps = count_steps(recording, replay.start, step);
  check_grasps_act(replay);
  replay.schedule = gripper_schedule(replay);

  if (recording.grasps.empty()) {
    replay.pivot = replay.recording.start.colwise().mean().transpose();
  } else {
    const data::RecordedGrasp& grasp = recording.grasps.front();
    replay.pivot = data::pose_at(trajectory_of(recording, grasp), grasp.from).translation();
  }
  return replay;
}

}  // namespace

Replay make_replay(const data::Recording& recording, const ReplaySettings& settings,
                   std::shared_ptr<const sim::SheetPlan> plan) {
  data::Recording on_mesh = recording;
  mesh_as_set(settings, on_mesh);
  return assemble(std::move(on_mesh), settings, recording.mesh_spec, std::move(plan), [&](Replay& replay) {
    for (const data::Keyframe& keyframe : data::load_keyframes(recording, replay.notices)) {
      Observation observation{.t = keyframe.time,
                              .points = keyframe.cloud,
                              .contour = keyframe.contour,
                              .markers = keyframe.markers,
                              .force = keyframe.force};
      // Marks are named by places on the recording's own mesh, which another one covers.
      for (Eigen::Index i = 0; i < keyframe.marker_places.rows(); ++i) {
        const Eigen::Vector3d place = keyframe.marker_places.row(i).transpose();
        observation.marks.push_back(put_mark(place, replay.surface, replay.queries->nearest(place)));
      }
      const bool weighs =
          keyframe.time >= settings.score_from && keyframe.time <= settings.score_to &&
          (keyframe.cloud.rows() >= settings.min_points || keyframe.contour.rows() >= settings.min_points ||
           keyframe.markers.rows() > 0 || keyframe.force);
      observation.weight = weighs ? 1 : 0;
      replay.observations.push_back(std::move(observation));
    }
  });
}

Replay on_mesh(const Replay& replay, data::Recording recording, const ReplaySettings& settings,
               std::shared_ptr<const sim::SheetPlan> plan) {
  return assemble(std::move(recording), settings, replay.object_mesh, std::move(plan), [&](Replay& made) {
    made.observations = replay.observations;
    for (Observation& observation : made.observations)
      for (Mark& mark : observation.marks) {
        const Eigen::Vector3d place =
            mark_position(mark, corners_of(replay.surface.vertices, replay.surface.triangles, mark.triangle));
        mark = put_mark(place, made.surface, made.queries->nearest(place));
      }
  });
}

Replay make_replay(const Replay& replay, const ReplaySettings& settings,
                   std::shared_ptr<const sim::SheetPlan> plan) {
  data::Recording recording = replay.recording;
  mesh_anew(replay, settings, recording);
  return on_mesh(replay, std::move(recording), settings, std::move(plan));
}

sim::Environment make_environment(const Replay& replay, const ReplayCandidate& candidate) {
  const data::Recording& recording = replay.recording;
  const ReplayNuisance& nuisance = candidate.nuisance;
  data::Points flat = sim::with_midsides(replay.sheet(), recording.start);
  turn(flat, replay.pivot, replay.up, nuisance.start_yaw);
  const Eigen::RowVector3d raise = nuisance.table_height * replay.up.transpose();

  sim::Environment environment;
  environment.materials[0] = candidate.material;
  if (candidate.solid) environment.solids[0] = *candidate.solid;
  environment.gravity = recording.gravity;
  environment.state.time = replay.start;
  environment.state.positions = flat.rowwise() + raise;
  environment.state.velocities = data::Points::Zero(flat.rows(), 3);
  if (recording.has_table) {
    environment.obstacles.push_back(
        {sim::Plane{.point = recording.table_point + raise.transpose(), .normal = recording.table_normal}});
  }
  for (std::size_t k = 0; k < recording.grasps.size(); ++k)
    environment.holds.push_back(make_hold(replay, recording.grasps[k], static_cast<int>(k), nuisance, flat));
  add_supports(replay, environment);
  environment.schedule = replay.schedule;
  environment.self_contact = replay.settings.self_contact;
  if (environment.self_contact && environment.self_contact->friction < 0)
    environment.self_contact->friction = sim::friction_of(environment, 0);
  return environment;
}

std::string why_not_on_device(const Replay& replay, const std::vector<ReplayCandidate>& candidates) {
  if (candidates.empty()) return {};
  // Candidates differ in their materials, and in places that no device minds.
  sim::Environment environment = make_environment(replay, candidates.front());
  for (const ReplayCandidate& candidate : candidates) {
    environment.materials[0] = candidate.material;
    if (std::string why = sim::why_not_on_device(environment); !why.empty()) return why;
  }
  return {};
}

std::vector<int> scored_steps(const Replay& replay) {
  const double step = replay.settings.solver.time_step, room = replay.recording.nuisance.time;
  const auto index = [&](double t) { return (t - replay.start) / step; };
  std::vector<int> steps = {0};
  for (const Observation& observation : replay.observations) {
    const double first = std::floor(index(observation.t - room) - kSameStep);
    const double last = std::ceil(index(observation.t + room) + kSameStep);
    for (double i = std::max(first, 0.0); i <= std::min<double>(last, replay.steps); ++i)
      steps.push_back(static_cast<int>(i));
    if (last >= replay.steps) steps.push_back(replay.steps);
  }
  std::sort(steps.begin(), steps.end());
  steps.erase(std::unique(steps.begin(), steps.end()), steps.end());
  return steps;
}

std::vector<int> every_step(const Replay& replay) {
  std::vector<int> steps(static_cast<std::size_t>(replay.steps) + 1);
  std::iota(steps.begin(), steps.end(), 0);
  return steps;
}

namespace {

/// Throws data::InputError for what the solver refuses, which all candidates share. One that is lost in
/// another way has steps that are not solved, and the others go on.
ReplayResult result_of(const Replay& replay, const std::vector<int>& kept, const sim::Batch& batch,
                       int environment) {
  if (batch.lost(environment) == sim::Lost::refused) throw data::InputError(batch.why_lost(environment));
  ReplayResult result;
  Motion& motion = result.motion;
  motion = {replay.start, replay.settings.solver.time_step, {}};
  motion.positions.assign(static_cast<std::size_t>(replay.steps) + 1, data::Points(0, 3));
  const auto in_reach = [](const auto& x) { return x.allFinite() && x.cwiseAbs().maxCoeff() < 1e4; };
  result.finite = in_reach(batch.state(environment).positions);
  for (std::size_t k = 0; k < kept.size(); ++k) {
    const auto x = batch.kept_positions(environment, static_cast<int>(k));
    result.finite = result.finite && in_reach(x);
    data::Points& positions = motion.positions[static_cast<std::size_t>(kept[k])];
    if (replay.surface_vertices.empty())
      positions = x;
    else
      positions = x(replay.surface_vertices, Eigen::all);
  }
  const std::span<const sim::StepStats> stats = batch.stats(environment);
  int missed = 0;
  for (const sim::StepStats& step : stats) {
    missed += !(step.converged && std::isfinite(step.residual));
    result.residual_max = data::worst(result.residual_max, step.residual);
    result.penetration_max = data::worst(result.penetration_max, step.penetration_max);
  }
  result.converged = missed == 0;
  result.unconverged_share = stats.empty() ? 0 : missed / static_cast<double>(stats.size());

  const sim::View<double> forces = batch.hold_forces();
  motion.forces.assign(stats.size(), Eigen::Vector3d::Zero());
  // A gripper may open and close again: its grasps are holds of their own.
  const std::vector<data::RecordedGrasp>& grasps = replay.recording.grasps;
  for (std::size_t k = 0; k < grasps.size(); ++k) {
    if (grasps[k].gripper != grasps.back().gripper) continue;
    const double* of_grasp =
        forces.data + environment * forces.strides[0] + static_cast<std::ptrdiff_t>(k) * forces.strides[2];
    for (Eigen::Vector3d& force : motion.forces) {
      force += Eigen::Map<const Eigen::Vector3d>(of_grasp);
      of_grasp += forces.strides[1];
    }
  }
  return result;
}

/// Of candidates whose grasps are as large as the replay's.
void run_alike(const Replay& replay, const std::vector<ReplayCandidate>& candidates,
               const std::vector<int>& kept, const std::function<void(std::size_t, ReplayResult)>& finished) {
  sim::BatchSettings settings;
  settings.solver = replay.settings.solver;
  settings.steps = replay.steps;
  settings.kept_steps = kept;
  settings.threads = replay.settings.threads;
  settings.device = replay.settings.device;
  settings.cuda_devices = replay.settings.cuda_devices;
  sim::replay_in_batches(
      replay.plan, candidates.size(), replay.settings.envs, settings,
      [&](std::size_t i) { return make_environment(replay, candidates[i]); },
      [&](std::size_t i, const sim::Batch& batch, int e) { finished(i, result_of(replay, kept, batch, e)); });
}

}  // namespace

Replay with_grasp_size(const Replay& replay, double size) {
  data::Recording recording = replay.recording;
  ReplaySettings settings = replay.settings;
  resize_grasps(size, settings, recording);
  return on_mesh(replay, std::move(recording), settings);
}

void run(const Replay& replay, const std::vector<ReplayCandidate>& candidates, const std::vector<int>& kept,
         const std::function<void(std::size_t, ReplayResult)>& finished) {
  std::map<std::optional<double>, std::vector<std::size_t>> of_size;
  for (std::size_t i = 0; i < candidates.size(); ++i) of_size[candidates[i].nuisance.grasp_size].push_back(i);
  for (const auto& [size, members] : of_size) {
    std::vector<ReplayCandidate> alike;
    for (const std::size_t i : members) alike.push_back(candidates[i]);
    const auto finished_here = [&, &of = members](std::size_t k, ReplayResult result) {
      finished(of[k], std::move(result));
    };
    try {
      if (size)
        run_alike(with_grasp_size(replay, *size), alike, kept, finished_here);
      else
        run_alike(replay, alike, kept, finished_here);
    } catch (const sim::DeviceError& error) {
      throw error.renumbered([&, &of = members](std::size_t k) { return of.at(k); });
    }
  }
}

std::vector<ReplayResult> run(const Replay& replay, const std::vector<ReplayCandidate>& candidates) {
  std::vector<ReplayResult> results(candidates.size());
  run(replay, candidates, scored_steps(replay),
      [&](std::size_t i, ReplayResult result) { results[i] = std::move(result); });
  return results;
}

}  // namespace flash::sysid
