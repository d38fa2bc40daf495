#include "sysid/observe/registration.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

namespace flash::sysid {
namespace {

constexpr int kParameters = 5;  // Offset x, y, z, yaw, time. Work.
constexpr const char* kNames[kParameters] = {"offset_x", "offset_y", "offset_z", "yaw", "time"};

Eigen::Matrix<double, kParameters, 1> half_widths(const RegistrationBounds& bounds) {
  Eigen::Matrix<double, kParameters, 1> widths;
  widths << bounds.offset, bounds.yaw, bounds.time;
  return widths;
}

/// One problem with its thinned points and the last nearest triangles, which the hierarchy begins with. A
/// search of the clouds takes its place where there is one.
struct Side {
  const RegistrationProblem& problem;
  std::vector<Observation> observations;
  SheetDistance sheet;
  CloudSearch search;
  std::vector<std::vector<int>> hints;
  double total_weight = 0;
  Eigen::Matrix<int, kParameters, 1> index;  // into the vector of unknowns

  Side(const RegistrationProblem& p, int points)
      : problem(p),
        observations(thinned(*p.observations, points)),
        sheet(p.sheet ? *p.sheet : SheetDistance(*p.triangles, p.motion->positions.front())),
        search(p.searches ? p.searches(*p.motion) : CloudSearch()) {
    for (const Observation& observation : observations) {
      hints.emplace_back(observation.points.rows(), -1);
      if (observation.seen()) total_weight += observation.weight;
    }
  }

  Registration at(const Eigen::VectorXd& unknowns) const {
    Registration registration = problem.start;
    for (int k = 0; k < 3; ++k) registration.offset[k] = unknowns[index[k]];
    registration.yaw = unknowns[index[3]];
    registration.time_offset = unknowns[index[4]];
    return registration;
  }
};

struct NormalEquations {
  double score = 0;
  Eigen::MatrixXd matrix;
  Eigen::VectorXd gradient;
};

/// The foot of a point that belongs to a place of the sheet.
sim::SurfaceFoot foot_at(const SurfacePoint& place, const Eigen::Vector3d& point,
                         const data::Triangles& triangles, const data::Points& positions,
                         const data::Points& velocities) {
  const Eigen::Vector3i corner = triangles.row(place.triangle);
  Eigen::Vector3d direction = point - place.position;
  if (place.distance < 1e-9) {
    const Eigen::Vector3d a = positions.row(corner[0]), b = positions.row(corner[1]),
                          c = positions.row(corner[2]);
    direction = (b - a).cross(c - a);
  }
  direction.normalize();
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
  for (int c = 0; c < 3; ++c) velocity += place.barycentric[c] * velocities.row(corner[c]).transpose();
  return {place.distance, {direction.x(), direction.y(), direction.z()}, direction.dot(velocity)};
}

/// Adds to the normal equations what one term of one keyframe says: Gauss-Newton matrix and gradient of the
/// sum of w d^2 / 2 with w = 1 / d, and the term's mean distance to the score. `match` gives the foot of
/// point i on the sheet.
template <class Match>
void add_term(const data::Points& points, const Match& match, double weight, const Registration& registration,
              const Eigen::Matrix<int, kParameters, 1>& index, const Robust& robust, double softening,
              NormalEquations& sum) {
  const auto count = static_cast<std::size_t>(points.rows());
  if (count == 0 || weight == 0) return;
  const Eigen::Isometry3d simulated_from_observed = registration.observed_from_simulated().inverse();
  std::vector<double> distances(count);
  std::vector<Eigen::Matrix<double, kParameters, 1>> rows(count);
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3d point =
        simulated_from_observed * points.row(static_cast<Eigen::Index>(i)).transpose();
    const sim::SurfaceFoot foot = match(i, point);
    distances[i] = foot.distance;
    const Eigen::Vector3d direction(foot.direction.x, foot.direction.y, foot.direction.z);
    rows[i].head<3>() = -(simulated_from_observed.linear().transpose() * direction);
    rows[i][3] = -direction.dot(registration.up.cross(point - registration.pivot));
    rows[i][4] = -foot.speed;
  }
  std::vector<double> ranked = distances;
  sum.score += weight * robust_mean(ranked, robust);

  double limit = std::numeric_limits<double>::infinity();
  if (robust.kind == RobustKind::trimmed) {
    const std::size_t kept =
        count - static_cast<std::size_t>(robust.trim_fraction * static_cast<double>(count));
    if (kept < count) limit = ranked[kept];  // robust_mean left the kept-th smallest in its place
  }
  for (std::size_t i = 0; i < count; ++i) {
    if (distances[i] >= limit) continue;
    const double d = distances[i], delta = robust.huber_delta;
    // d(rho)/dd / d: rho = d, and for huber beyond delta rho = sqrt(delta (2 d - delta)).
    double influence = 1 / std::max(d, softening);
    if (robust.kind == RobustKind::huber && d > delta)
      influence *= delta / std::sqrt(delta * (2 * d - delta));
    const double w = weight * influence / static_cast<double>(count);
    for (int a = 0; a < kParameters; ++a) {
      sum.gradient[index[a]] += w * d * rows[i][a];
      for (int b = 0; b < kParameters; ++b) sum.matrix(index[a], index[b]) += w * rows[i][a] * rows[i][b];
    }
  }
}

/// Adds one side, all keyframes and terms.
void add_side(Side& side, const Eigen::VectorXd& unknowns, const Objective& objective, double softening,
              NormalEquations& sum) {
  if (side.total_weight == 0) return;
  const Registration registration = side.at(unknowns);
  std::vector<std::span<const sim::SurfaceFoot>> feet;
  if (side.search) feet = side.search(CloudPoints::thinned, registration);
  data::Points positions, velocities;
  for (std::size_t k = 0; k < side.observations.size(); ++k) {
    const Observation& observation = side.observations[k];
    if (!observation.seen() || observation.weight == 0) continue;
    if (!side.search || observation.contour.rows() > 0 || observation.markers.rows() > 0) {
      surface_at(*side.problem.motion, observation.t + registration.time_offset, positions, &velocities);
      if (side.search)
        side.sheet.move_border(positions);
      else
        side.sheet.move(positions);
    }
    const std::array<double, 5> weights = term_weights(observation, objective);
    const double keyframe_weight = observation.weight / side.total_weight;
    const auto add = [&](const data::Points& points, double weight, const auto& match) {
      add_term(points, match, keyframe_weight * weight, registration, side.index, objective.robust, softening,
               sum);
    };
    const auto foot = [&](const SurfacePoint& place, const Eigen::Vector3d& point) {
      return foot_at(place, point, *side.problem.triangles, positions, velocities);
    };
    add(observation.points, weights[0], [&](std::size_t i, const Eigen::Vector3d& point) {
      if (side.search) return feet[k][i];
      const SurfacePoint nearest = side.sheet.nearest(point, side.hints[k][i]);
      side.hints[k][i] = nearest.triangle;
      return foot(nearest, point);
    });
    add(observation.contour, weights[1], [&](std::size_t, const Eigen::Vector3d& point) {
      return foot(side.sheet.nearest_on_border(point), point);
    });
    add(observation.markers, weights[2], [&](std::size_t i, const Eigen::Vector3d& point) {
      return foot(side.sheet.mark(observation.marks[i], point), point);
    });
  }
}

NormalEquations evaluate(std::vector<Side>& sides, const Eigen::VectorXd& unknowns,
                         const Objective& objective, double softening) {
  NormalEquations sum;
  sum.matrix = Eigen::MatrixXd::Zero(unknowns.size(), unknowns.size());
  sum.gradient = Eigen::VectorXd::Zero(unknowns.size());
  for (Side& side : sides) add_side(side, unknowns, objective, softening, sum);
  return sum;
}

/// Damped Gauss-Newton step inside the box; unknowns held by a bound do not take part.
Eigen::VectorXd bounded_step(const NormalEquations& equations, const Eigen::VectorXd& unknowns,
                             const Eigen::VectorXd& widths, double damping) {
  std::vector<int> free;
  for (int i = 0; i < unknowns.size(); ++i) {
    const bool held = (unknowns[i] >= widths[i] && equations.gradient[i] <= 0) ||
                      (unknowns[i] <= -widths[i] && equations.gradient[i] >= 0);
    if (!held && equations.matrix(i, i) > 0) free.push_back(i);
  }
  Eigen::VectorXd result = unknowns;
  if (free.empty()) return result;
  Eigen::MatrixXd matrix = equations.matrix(free, free);
  matrix.diagonal() *= 1 + damping;
  const Eigen::VectorXd step = -matrix.ldlt().solve(Eigen::VectorXd(equations.gradient(free)));
  if (!step.allFinite()) return result;
  for (std::size_t k = 0; k < free.size(); ++k) {
    const int i = free[k];
    result[i] = std::clamp(unknowns[i] + step[static_cast<Eigen::Index>(k)], -widths[i], widths[i]);
  }
  return result;
}

double minimize(std::vector<Side>& sides, const Eigen::VectorXd& widths, const Objective& objective,
                const RegistrationSettings& settings, Eigen::VectorXd& unknowns) {
  NormalEquations here = evaluate(sides, unknowns, objective, settings.softening);
  double damping = 1e-3;
  for (int iteration = 0; iteration < settings.iterations && damping < 1e6;) {
    const Eigen::VectorXd trial = bounded_step(here, unknowns, widths, damping);
    if (trial == unknowns) break;
    NormalEquations there = evaluate(sides, trial, objective, settings.softening);
    ++iteration;
    if (there.score >= here.score) {
      damping *= 10;
      continue;
    }
    const double gain = here.score - there.score;
    unknowns = trial;
    here = std::move(there);
    damping = std::max(damping * 0.1, 1e-9);
    if (gain < settings.tolerance * here.score) break;
  }
  return here.score;
}

/// All problems, what is free of them, and where they fit best.
struct Registered {
  std::vector<Side> sides;
  Eigen::VectorXd box, best;
};

Registered registered(const std::vector<RegistrationProblem>& problems, const Objective& objective,
                      const RegistrationSettings& settings, const SharedRegistration& shared) {
  const bool is_shared[kParameters] = {shared.offset, shared.offset, shared.offset, shared.yaw, shared.time};
  std::vector<Side> sides;
  sides.reserve(problems.size());
  std::vector<double> widths, starts;
  for (const RegistrationProblem& problem : problems) {
    Side& side = sides.emplace_back(problem, settings.points_per_keyframe);
    Eigen::Matrix<double, kParameters, 1> start;
    start << problem.start.offset, problem.start.yaw, problem.start.time_offset;
    const auto limits = half_widths(problem.bounds);
    for (int k = 0; k < kParameters; ++k) {
      if (is_shared[k] && sides.size() > 1) {
        side.index[k] = sides.front().index[k];
        widths[side.index[k]] = std::min(widths[side.index[k]], limits[k]);
        continue;
      }
      side.index[k] = static_cast<int>(widths.size());
      widths.push_back(limits[k]);
      starts.push_back(start[k]);
    }
  }
  const Eigen::VectorXd box =
      Eigen::Map<Eigen::VectorXd>(widths.data(), static_cast<Eigen::Index>(widths.size()));
  const Eigen::VectorXd start = Eigen::Map<Eigen::VectorXd>(starts.data(), box.size());

  Eigen::VectorXd best = start.cwiseMax(-box).cwiseMin(box);
  double best_score = std::numeric_limits<double>::infinity();
  for (const double time : settings.time_starts) {
    Eigen::VectorXd unknowns = start;
    for (const Side& side : sides) unknowns[side.index[4]] = start[side.index[4]] + time;
    unknowns = unknowns.cwiseMax(-box).cwiseMin(box);
    if ((box.array() == 0).all()) break;  // nothing is free
    const double score = minimize(sides, box, objective, settings, unknowns);
    if (score < best_score) {
      best_score = score;
      best = unknowns;
    }
  }
  return {std::move(sides), box, best};
}

}  // namespace

std::vector<Registration> find_registrations(const std::vector<RegistrationProblem>& problems,
                                             const Objective& objective, const RegistrationSettings& settings,
                                             const SharedRegistration& shared) {
  const Registered found = registered(problems, objective, settings, shared);
  std::vector<Registration> registrations;
  for (const Side& side : found.sides) registrations.push_back(side.at(found.best));
  return registrations;
}

std::vector<RegistrationFit> register_motions(const std::vector<RegistrationProblem>& problems,
                                              const Objective& objective,
                                              const RegistrationSettings& settings,
                                              const SharedRegistration& shared) {
  auto [sides, box, best] = registered(problems, objective, settings, shared);
  std::vector<RegistrationFit> fits;
  for (Side& side : sides) {
    RegistrationFit& fit = fits.emplace_back();
    fit.registration = side.at(best);
    std::vector<std::span<const sim::SurfaceFoot>> feet;
    if (side.search) feet = side.search(CloudPoints::all, fit.registration);
    for (std::size_t k = 0; k < side.problem.observations->size(); ++k)
      fit.keyframe_scores.push_back(keyframe_score(*side.problem.motion, (*side.problem.observations)[k],
                                                   fit.registration, objective, side.problem.crop, side.sheet,
                                                   side.search ? &feet[k] : nullptr));
    fit.score = weighted_mean_score(fit.keyframe_scores, *side.problem.observations);
    for (int k = 0; k < kParameters; ++k) {
      const int i = side.index[k];
      if (box[i] > 0 && std::abs(best[i]) >= box[i]) fit.bounds_hit.emplace_back(kNames[k]);
    }
  }
  return fits;
}

RegistrationProblem registration_problem(const Replay& replay, const Motion& motion) {
  RegistrationProblem problem;
  problem.triangles = &replay.surface.triangles;
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
