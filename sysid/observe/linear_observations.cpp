#include "sysid/observe/linear_observations.h"

#include <algorithm>
#include <cmath>

#include "data/machine/parallel.h"

namespace flash::sysid {
namespace {

Eigen::Vector3d at(const data::Points& points, const Eigen::Vector3i& corners,
                   const Eigen::Vector3d& barycentric) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int k = 0; k < 3; ++k) sum += barycentric[k] * points.row(corners[k]).transpose();
  return sum;
}

Eigen::Vector3d normal_of(const data::Points& positions, const Eigen::Vector3i& corners) {
  const Eigen::Vector3d a = positions.row(corners[0]), b = positions.row(corners[1]),
                        c = positions.row(corners[2]);
  return (b - a).cross(c - a).normalized();
}

/// Out of the sheet, in its surface, across the border edge that the place lies on.
Eigen::Vector3d border_normal(const data::Points& positions, const Eigen::Vector3i& corners,
                              const Eigen::Vector3d& barycentric) {
  int opposite;
  barycentric.minCoeff(&opposite);
  const Eigen::Vector3d a = positions.row(corners[(opposite + 1) % 3]),
                        b = positions.row(corners[(opposite + 2) % 3]);
  return (b - a).cross(normal_of(positions, corners)).normalized();
}

/// Calls work(first, last) for as many parts of `count` keyframes as there are threads: a hierarchy takes
/// about as long to copy as to move, so each thread has one.
template <class Work>
void for_each_part(std::size_t count, int threads, const Work& work) {
  const auto parts = std::clamp<std::size_t>(count, 1, static_cast<std::size_t>(std::max(threads, 1)));
  data::for_each_in_parallel(
      parts, threads, [&](std::size_t part) { work(part * count / parts, (part + 1) * count / parts); });
}

}  // namespace

SheetDistance sheet_of(const Replay& replay) {
  const data::TriangleMesh& mesh = replay.surface;
  return replay.queries ? *replay.queries : SheetDistance(mesh.triangles, mesh.vertices);
}

void LinearObservations::add_term(const data::Points& points, Eigen::Index at_most, const Place& common,
                                  const Seen& seen, std::vector<Place>& places) {
  const Eigen::Index count = std::min(points.rows(), at_most);
  if (count == 0 || !(common.weight > 0)) return;
  const data::TriangleMesh& mesh = seen.replay.surface;
  int hint = -1;
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::Index row = i * points.rows() / count;
    const Eigen::Vector3d point = seen.simulated_from_observed * points.row(row).transpose();
    Place place = common;
    place.mark = static_cast<std::size_t>(row);
    SurfacePoint nearest;
    if (places.size() < seen.near.size()) hint = seen.near[places.size()].triangle;
    if (place.term == Term::surface) nearest = seen.sheet.nearest(point, hint);
    if (place.term == Term::border) nearest = seen.sheet.nearest_on_border(point);
    if (place.term == Term::mark)
      nearest = seen.sheet.mark(seen.replay.observations[place.observation].marks[place.mark], point);
    hint = nearest.triangle;
    const Eigen::Vector3i corners = mesh.triangles.row(nearest.triangle);
    place.triangle = nearest.triangle;
    place.barycentric = nearest.barycentric;
    place.position = nearest.position;
    place.velocity = at(seen.velocities, corners, nearest.barycentric);
    place.rest = at(mesh.vertices, corners, nearest.barycentric);
    const bool mark = place.term == Term::mark;
    if (mark) {
      place.corners = corners_of(seen.positions, mesh.triangles, nearest.triangle);
      place.velocity =
          mark_shift(seen.replay.observations[place.observation].marks[place.mark], place.corners,
                     corners_of(seen.velocities, mesh.triangles, nearest.triangle));
    }
    place.weight = std::sqrt(common.weight / static_cast<double>(count));
    for (int k = 0; k < (mark ? 3 : 1); ++k) {
      place.direction = mark ? Eigen::Vector3d(Eigen::Vector3d::Unit(k))
                        : place.term == Term::surface
                            ? normal_of(seen.positions, corners)
                            : border_normal(seen.positions, corners, nearest.barycentric);
      place.residual = place.direction.dot(point - place.position);
      place.axis = k;
      places.push_back(place);
    }
  }
}

std::span<const LinearObservations::Place> LinearObservations::places_of_keyframe(
    std::size_t observation) const {
  const auto first =
      std::lower_bound(places_.begin(), places_.end(), observation,
                       [](const Place& place, std::size_t k) { return place.observation < k; });
  const auto last = std::find_if(first, places_.end(),
                                 [&](const Place& place) { return place.observation != observation; });
  return {places_.data() + (first - places_.begin()), static_cast<std::size_t>(last - first)};
}

LinearObservations::LinearObservations(const Replay& replay, const Motion& motion,
                                       const Registration& registration, const Objective& objective,
                                       const SheetShifts& shifts, const LinearObservations* near,
                                       Eigen::Index points_per_term)
    : registration_(registration) {
  const Eigen::Isometry3d simulated_from_observed = registration.observed_from_simulated().inverse();
  double total = 0;
  std::vector<std::size_t> weighing;
  for (std::size_t k = 0; k < replay.observations.size(); ++k) {
    const Observation& observation = replay.observations[k];
    if (!observation.seen()) continue;
    total += observation.weight;
    if (observation.weight > 0) weighing.push_back(k);
  }
  std::vector<std::vector<Place>> of_keyframes(weighing.size());
  const auto add_keyframe = [&](std::size_t i, SheetDistance& sheet) {
    const std::size_t k = weighing[i];
    const Observation& observation = replay.observations[k];
    std::vector<Place>& places = of_keyframes[i];
    const double t = observation.t + registration.time_offset;
    data::Points positions, velocities;
    surface_at(motion, t, positions, &velocities);
    if (!shifts.empty()) positions += shifts[k].positions;
    sheet.move(positions);
    const std::array<double, 5> weights = term_weights(observation, objective);
    const auto common = [&](Term term, double weight) {
      Place place{};
      place.term = term;
      place.observation = k;
      place.weight = observation.weight / total * weight;
      return place;
    };
    const Seen seen{replay,
                    sheet,
                    positions,
                    velocities,
                    simulated_from_observed,
                    near != nullptr ? near->places_of_keyframe(k) : std::span<const Place>()};
    const auto add = [&](const data::Points& points, Term term, double weight) {
      add_term(points, points_per_term, common(term, weight), seen, places);
    };
    add(observation.points, Term::surface, weights[0]);
    add(observation.contour, Term::border, weights[1]);
    add(observation.markers, Term::mark, weights[2]);
    if (!observation.force || !(weights[3] > 0)) return;
    Place place = common(Term::force, weights[3]);
    place.position = force_at(motion, t);
    if (!shifts.empty()) place.position += shifts[k].force;
    place.velocity.setZero();
    // A force in newtons times its weight is a length; squared, the weight counts twice.
    place.weight = weights[3] * std::sqrt(observation.weight / total);
    for (int axis = 0; axis < 3; ++axis) {
      place.direction = Eigen::Vector3d::Unit(axis);
      place.residual = place.direction.dot(*observation.force - place.position);
      place.axis = axis;
      places.push_back(place);
    }
  };
  for_each_part(weighing.size(), replay.settings.threads, [&](std::size_t first, std::size_t last) {
    SheetDistance sheet = sheet_of(replay);
    for (std::size_t i = first; i < last; ++i) add_keyframe(i, sheet);
  });
  for (const std::vector<Place>& places : of_keyframes)
    places_.insert(places_.end(), places.begin(), places.end());
}

LinearObservations::Row LinearObservations::row(Eigen::Index i) const {
  const Place& place = places_[static_cast<std::size_t>(i)];
  return {place.observation, place.term, place.axis, place.rest, place.residual, place.weight};
}

std::vector<Eigen::Index> LinearObservations::rows_of_keyframes() const {
  std::vector<Eigen::Index> counts;
  for (std::size_t i = 0; i < places_.size(); ++i) {
    if (i == 0 || places_[i].observation != places_[i - 1].observation) counts.push_back(0);
    ++counts.back();
  }
  return counts;
}

Eigen::VectorXd LinearObservations::residuals() const {
  Eigen::VectorXd rows(this->rows());
  for (Eigen::Index i = 0; i < rows.size(); ++i) {
    const Place& place = places_[static_cast<std::size_t>(i)];
    rows[i] = place.weight * place.residual;
  }
  return rows;
}

Eigen::VectorXd LinearObservations::distances(const Replay& replay, const Motion& motion,
                                              const Registration& registration, const SheetShifts& shifts,
                                              SheetDistance& sheet, std::vector<int>& triangles,
                                              int threads) const {
  const Eigen::Isometry3d simulated_from_observed = registration.observed_from_simulated().inverse();
  const data::Triangles& corners = replay.surface.triangles;
  Eigen::VectorXd rows(this->rows());
  if (triangles.empty())
    for (const Place& place : places_) triangles.push_back(place.triangle);
  const auto measure = [&](std::size_t first, std::size_t last, SheetDistance& there) {
    data::Points positions;
    Eigen::Vector3d force = Eigen::Vector3d::Zero();
    std::size_t current = static_cast<std::size_t>(-1);
    for (std::size_t i = first; i < last; ++i) {
      const Place& place = places_[i];
      const Observation& observation = replay.observations[place.observation];
      if (place.observation != current) {
        current = place.observation;
        const double t = observation.t + registration.time_offset;
        surface_at(motion, t, positions);
        force = force_at(motion, t);
        if (!shifts.empty()) {
          positions += shifts[current].positions;
          force += shifts[current].force;
        }
        there.move(positions);
      }
      double& distance = rows[static_cast<Eigen::Index>(i)];
      if (place.term == Term::force) {
        distance = (*observation.force - force)[place.axis];
        continue;
      }
      const auto point = [&](const data::Points& points) {
        return Eigen::Vector3d(simulated_from_observed *
                               points.row(static_cast<Eigen::Index>(place.mark)).transpose());
      };
      if (place.term == Term::mark) {
        const Eigen::Vector3d seen = point(observation.markers);
        distance = (seen - there.mark(observation.marks[place.mark], seen).position)[place.axis];
        continue;
      }
      const bool border = place.term == Term::border;
      const Eigen::Vector3d seen = point(border ? observation.contour : observation.points);
      const SurfacePoint nearest = border ? there.nearest_on_border(seen) : there.nearest(seen, triangles[i]);
      triangles[i] = nearest.triangle;
      const Eigen::Vector3i at_corners = corners.row(nearest.triangle);
      const Eigen::Vector3d direction = border ? border_normal(positions, at_corners, nearest.barycentric)
                                               : normal_of(positions, at_corners);
      distance = direction.dot(seen - nearest.position);
    }
  };
  if (threads <= 1) {
    measure(0, places_.size(), sheet);
    return rows;
  }
  const std::vector<Eigen::Index> counts = rows_of_keyframes();
  std::vector<std::size_t> ends = {0};
  for (const Eigen::Index count : counts) ends.push_back(ends.back() + static_cast<std::size_t>(count));
  for_each_part(counts.size(), threads, [&](std::size_t first, std::size_t last) {
    SheetDistance own = sheet;
    measure(ends[first], ends[last], own);
  });
  return rows;
}

Eigen::VectorXd LinearObservations::displacements(const Replay& replay, const Motion& motion) const {
  SheetDistance sheet = sheet_of(replay);
  Eigen::VectorXd rows(this->rows());
  data::Points positions;
  std::size_t current = static_cast<std::size_t>(-1);
  int hint = -1;
  for (Eigen::Index i = 0; i < rows.size(); ++i) {
    const Place& place = places_[static_cast<std::size_t>(i)];
    const Observation& observation = replay.observations[place.observation];
    const double t = observation.t + registration_.time_offset;
    if (place.observation != current) {
      surface_at(motion, t, positions);
      sheet.move(positions);
      current = place.observation;
    }
    Eigen::Vector3d there = Eigen::Vector3d::Zero();
    if (place.term == Term::surface) {
      const SurfacePoint nearest = sheet.nearest(place.position, hint);
      hint = nearest.triangle;
      there = nearest.position;
    }
    if (place.term == Term::border) there = sheet.nearest_on_border(place.position).position;
    if (place.term == Term::mark) there = sheet.mark(observation.marks[place.mark], place.position).position;
    if (place.term == Term::force) there = force_at(motion, t);
    rows[i] = place.weight * place.direction.dot(there - place.position);
  }
  return rows;
}

Eigen::VectorXd LinearObservations::moved_by(const Replay& replay, const SheetShifts& shifts) const {
  Eigen::VectorXd rows(this->rows());
  for (Eigen::Index i = 0; i < rows.size(); ++i) {
    const Place& place = places_[static_cast<std::size_t>(i)];
    const SheetShift& shift = shifts[place.observation];
    const data::Triangles& triangles = replay.surface.triangles;
    const Eigen::Vector3d moved =
        place.term == Term::force ? shift.force
        : place.term == Term::mark
            ? mark_shift(replay.observations[place.observation].marks[place.mark], place.corners,
                         corners_of(shift.positions, triangles, place.triangle))
            : at(shift.positions, triangles.row(place.triangle), place.barycentric);
    rows[i] = place.weight * place.direction.dot(moved);
  }
  return rows;
}

Eigen::Matrix<double, Eigen::Dynamic, 5> LinearObservations::registration_derivatives() const {
  Eigen::Matrix<double, Eigen::Dynamic, 5> rows(this->rows(), 5);
  const Eigen::Matrix3d observed_from_simulated = registration_.observed_from_simulated().linear();
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    const Place& place = places_[static_cast<std::size_t>(i)];
    if (place.term == Term::force) {
      rows.row(i).setZero();
      continue;
    }
    rows.row(i).head<3>() = place.weight * (observed_from_simulated * place.direction).transpose();
    rows(i, 3) =
        place.weight * place.direction.dot(registration_.up.cross(place.position - registration_.pivot));
    rows(i, 4) = place.weight * place.direction.dot(place.velocity);
  }
  return rows;
}

}  // namespace flash::sysid
