#include "tests/sim/scene_findings.h"

#include <algorithm>
#include <cmath>

#include "tests/sim/brute_surface.h"
#include "tests/sim/obstacle_depth.h"

namespace flash::sim {
namespace {

using Eigen::Vector3d;

/// Whether a straight way goes through triangles, in and out again on the far side. What starts on them
/// starts a little above.
bool goes_through_mesh(const Mesh& mesh, Vector3d from, const Vector3d& to) {
  const data::TriangleMesh all = triangles_of(*mesh.surface);
  const SurfacePlace start = nearest_on(*mesh.surface, {from.x(), from.y(), from.z()});
  const Vector3<double>& up = mesh.surface->triangles[static_cast<std::size_t>(start.triangle)].normal;
  if (start.distance < 1e-7) from += 1e-7 * Vector3d(up.x, up.y, up.z);
  if (mesh.surface->closed && (brute_winding(all, from) > 0.5 || brute_winding(all, to) > 0.5)) return false;
  const Vector3d way = to - from;
  bool within = false;
  Vector3d entry = Vector3d::Zero();
  for (const BruteCrossing& crossing : brute_crossings(all, from, to)) {
    if (!mesh.surface->closed) return true;
    if (crossing.normal.dot(way) < 0) {
      if (!within) entry = crossing.normal;
      within = true;
    } else if (within) {
      within = false;
      if (entry.dot(crossing.normal) < -0.5) return true;
    }
  }
  return false;
}

}  // namespace

bool goes_through(const Environment& environment, const Obstacle& obstacle, const Vector3d& from,
                  const Vector3d& to, double from_time, double to_time) {
  if (const auto* mesh = std::get_if<Mesh>(&obstacle.shape)) {
    const auto seen = [&](const Vector3d& x, double time) {
      return Vector3d((frame_pose(environment, obstacle.frame, time) * mesh->pose).inverse() * x);
    };
    return goes_through_mesh(*mesh, seen(from, from_time), seen(to, to_time));
  }
  bool inside = false;
  for (int k = 0; k <= 400; ++k) {
    const double share = k / 400.0;
    inside = inside || depth_in(environment, obstacle, from + share * (to - from),
                                from_time + share * (to_time - from_time)) > 1e-6;
  }
  if (!inside) return false;
  if (const auto* capsule = std::get_if<Capsule>(&obstacle.shape)) {
    // Out on the far side of where it came in.
    if (depth_in(environment, obstacle, from, from_time) > 0 ||
        depth_in(environment, obstacle, to, to_time) > 0)
      return false;
    Vector3d first, last;
    bool any = false;
    for (int k = 0; k <= 400; ++k) {
      const double share = k / 400.0, time = from_time + share * (to_time - from_time);
      const Vector3d at =
          frame_pose(environment, obstacle.frame, time).inverse() * (from + share * (to - from)) -
          capsule->centre;
      const double along = std::clamp(at.dot(capsule->axis), -capsule->half_length, capsule->half_length);
      const Vector3d out = at - along * capsule->axis;
      if (out.norm() > capsule->radius) continue;
      if (!any) first = out;
      any = true;
      last = out;
    }
    return any && first.normalized().dot(last.normalized()) < -0.1;
  }
  if (const auto* cylinder = std::get_if<Cylinder>(&obstacle.shape)) {
    const auto radial = [&](const Vector3d& x) {
      return Vector3d((x - cylinder->point) - cylinder->axis * cylinder->axis.dot(x - cylinder->point));
    };
    return depth_in(environment, obstacle, to, to_time) < 0 && radial(from).dot(radial(to)) < 0;
  }
  const auto* box = std::get_if<Box>(&obstacle.shape);
  if (box == nullptr) return false;
  const auto seen_from_box = [&](const Vector3d& x, double time) {
    return Vector3d((frame_pose(environment, obstacle.frame, time) * box->pose).inverse() * x);
  };
  const Vector3d start = seen_from_box(from, from_time), end = seen_from_box(to, to_time);
  for (int axis = 0; axis < 3; ++axis) {
    const double half = box->half_extents[axis];
    // Where it stands beside the box at the start or at the end, it went round an edge.
    const auto beside = [&](const Vector3d& x) {
      return std::abs(x[(axis + 1) % 3]) > box->half_extents[(axis + 1) % 3] ||
             std::abs(x[(axis + 2) % 3]) > box->half_extents[(axis + 2) % 3];
    };
    if (start[axis] * end[axis] < 0 && std::abs(start[axis]) > half - 1e-9 &&
        std::abs(end[axis]) > half - 1e-9 && !beside(start) && !beside(end))
      return true;
  }
  return false;
}

namespace {

/// Of each vertex of a sheet, or of a solid [kg].
Eigen::VectorXd masses(const RandomScene& scene) {
  const auto solid = scene.environment.solids.find(0);
  if (solid != scene.environment.solids.end()) return solid->second.density * scene.sheet.vertex_volume;
  return scene.environment.materials[0].areal_density * scene.sheet.vertex_area;
}

double moved_energy(const Environment& environment, const StepReport& report) {
  double loads = 0;
  for (const Load& load : environment.loads)
    loads -= load.force.dot(environment.state.positions.row(load.vertex));
  return report.kinetic + report.membrane + report.bending + report.solid + report.gravitational + loads;
}

}  // namespace

SceneFindings observe(RandomScene scene) {
  Environment& environment = scene.environment;
  const double h = scene.settings.time_step;
  SceneFindings found;
  found.steps = scene.steps;
  Solver solver(scene.sheet, scene.settings);
  std::vector<bool> held(static_cast<std::size_t>(environment.state.positions.rows()), false);
  for (const Hold& hold : environment.holds)
    for (const int vertex : hold.vertices) held[static_cast<std::size_t>(vertex)] = true;
  // Vertices that began inside and are not out yet.
  std::vector<std::vector<bool>> inside(environment.obstacles.size(), std::vector<bool>(held.size(), false));
  for (std::size_t k = 0; k < environment.obstacles.size(); ++k)
    for (std::size_t i = 0; i < held.size(); ++i)
      inside[k][i] =
          depth_in(environment, environment.obstacles[k], environment.state.positions.row(i), 0) > 1e-9;

  const Eigen::VectorXd mass = masses(scene);
  double energy = 0, put_in = 0;
  bool energy_known = false;
  for (int step = 0; step < scene.steps; ++step) {
    const State before = environment.state;
    if (!energy_known) {
      // The elastic energy of the start is that of the rest shape.
      energy = 0.5 * (mass.asDiagonal() * before.velocities).cwiseProduct(before.velocities).sum();
      for (int i = 0; i < mass.size(); ++i)
        energy -= mass[i] * environment.gravity.dot(before.positions.row(i));
      put_in = 0.5 * (mass.asDiagonal() * before.velocities).cwiseProduct(before.velocities).sum();
      energy_known = true;
    }
    const StepReport report = solver.step(environment);
    const State& after = environment.state;
    found.finite = found.finite && after.positions.allFinite() && after.velocities.allFinite() &&
                   std::isfinite(report.residual);
    if (!found.finite) return found;
    if (scene.kind == SceneKind::deep)
      found.shot_speed = std::max(found.shot_speed, after.velocities.rowwise().norm().maxCoeff() -
                                                        after.time * environment.gravity.norm());
    found.halved += report.substeps > 1;
    if (!report.converged) {
      ++found.unconverged;
      found.residual_max = std::max(found.residual_max, report.residual);
    }
    for (std::size_t k = 0; k < environment.obstacles.size(); ++k)
      for (std::size_t i = 0; i < held.size(); ++i) {
        const Vector3d from = before.positions.row(i), to = after.positions.row(i);
        const double depth = depth_in(environment, environment.obstacles[k], to, after.time);
        if (report.converged)
          found.unseen_depth = std::max(found.unseen_depth, depth - report.penetration_max);
        if (held[i]) continue;
        if (inside[k][i]) {
          const double out = (depth_in(environment, environment.obstacles[k], from, before.time) - depth) / h;
          if (depth_in(environment, environment.obstacles[k], from, before.time) > 0)
            found.exit_speed = std::max(found.exit_speed, out);
          inside[k][i] = depth > 0;
          continue;
        }
        if (!report.converged) continue;
        found.free_depth = std::max(found.free_depth, depth);
        if (report.substeps == 1)  // the way of a step in parts is not straight
          found.crossed +=
              goes_through(environment, environment.obstacles[k], from, to, before.time, after.time);
      }

    // Work of what moves the sheet: grippers and pushers here never turn.
    // A step in parts has means of forces, so that its work is its own account.
    double work = report.substeps > 1 ? report.work : 0;
    const auto moved = [&](int frame) {
      return Vector3d(frame_pose(environment, frame, after.time).translation() -
                      frame_pose(environment, frame, before.time).translation());
    };
    for (std::size_t k = 0; report.substeps == 1 && k < environment.holds.size(); ++k)
      work += report.hold_forces[k].dot(moved(environment.holds[k].frame));
    for (std::size_t k = 0; report.substeps == 1 && k < environment.obstacles.size(); ++k)
      work += report.obstacle_forces[k].dot(moved(environment.obstacles[k].frame));
    const double now = moved_energy(environment, report), gain = now - energy - work;
    // What falls puts in its weight's work, over the step.
    put_in += std::max(work, 0.0);
    const double falls = std::max(0.0, [&] {
      double drop = 0;
      for (int i = 0; i < mass.size(); ++i)
        drop += mass[i] * environment.gravity.dot(after.positions.row(i) - before.positions.row(i));
      return drop;
    }());
    put_in += falls;
    if (report.converged && scene.kind != SceneKind::deep) {
      // What the weight does over a nanometre is rounding.
      const double weight = mass.sum() * 9.81;
      found.energy_gain = std::max(found.energy_gain, gain);
      found.energy_gain_share = std::max(found.energy_gain_share, gain / std::max(put_in, 1e-9 * weight));
    }
    energy = now;
  }
  for (std::size_t i = 0; i < held.size(); ++i)
    found.inside +=
        !held[i] && std::any_of(environment.obstacles.begin(), environment.obstacles.end(),
                                [&](const Obstacle& obstacle) {
                                  return depth_in(environment, obstacle, environment.state.positions.row(i),
                                                  environment.state.time) > 1e-6;
                                });
  return found;
}

}  // namespace flash::sim
