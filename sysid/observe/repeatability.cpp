#include "sysid/observe/repeatability.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <nanoflann.hpp>
#include <unsupported/Eigen/LevenbergMarquardt>
#include <utility>

#include "data/files/error.h"
#include "data/files/text.h"

namespace flash::sysid {
namespace {

using data::Points;
using Eigen::Vector3d;
using Eigen::VectorXd;

/// Spacings of points within which the other trial saw a point. Chosen: not varied.
constexpr double reach_in_spacings = 3;
/// Distance below which residuals count as quadratic [m]. Chosen: below the noise of depth cameras; not
/// varied.
constexpr double softening = 5e-4;
constexpr double unseen = std::numeric_limits<double>::quiet_NaN();

/// The surface that a cloud shows.
class LocalPlanes {
 public:
  LocalPlanes(const Points& points, int neighbours)
      : points_(points),
        neighbours_(std::min<Eigen::Index>(neighbours, points.rows())),
        tree_(3, std::cref(points_)) {
    std::vector<double> spacings;
    for (Eigen::Index i = 0; i < points_.rows(); ++i) {
      search(points_.row(i).transpose());
      spacings.push_back(std::sqrt(squared_[std::min<Eigen::Index>(3, neighbours_ - 1)]));
    }
    std::nth_element(spacings.begin(), spacings.begin() + spacings.size() / 2, spacings.end());
    reach_ = reach_in_spacings * spacings[spacings.size() / 2];
  }

  /// Signed distance of `point` to the plane through the points nearest to it, and its unit normal. The
  /// distance is not a number where no point is within reach along the plane.
  double distance(const Vector3d& point, Vector3d& normal) {
    search(point);
    Vector3d mean = Vector3d::Zero();
    for (const Eigen::Index i : nearest_)
      mean += points_.row(i).transpose() / static_cast<double>(neighbours_);
    Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
    for (const Eigen::Index i : nearest_) {
      const Vector3d off = points_.row(i).transpose() - mean;
      scatter += off * off.transpose();
    }
    normal = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter).eigenvectors().col(0);
    const double distance = normal.dot(point - mean);
    const Vector3d to_nearest = points_.row(nearest_[0]).transpose() - point;
    const double along = (to_nearest - normal * normal.dot(to_nearest)).norm();
    return along <= reach_ ? distance : unseen;
  }

 private:
  void search(const Vector3d& point) {
    nearest_.resize(static_cast<std::size_t>(neighbours_));
    squared_.resize(static_cast<std::size_t>(neighbours_));
    tree_.index->knnSearch(point.data(), static_cast<std::size_t>(neighbours_), nearest_.data(),
                           squared_.data());
  }

  Points points_;
  Eigen::Index neighbours_;
  nanoflann::KDTreeEigenMatrixAdaptor<Points, 3> tree_;
  double reach_ = 0;
  std::vector<Eigen::Index> nearest_;
  std::vector<double> squared_;
};

struct Seen {
  double time;
  Points points;
  std::unique_ptr<LocalPlanes> planes;
};

/// What one trial saw over time.
struct Trial {
  std::vector<Seen> keyframes;
  double longest_gap = 0;  ///< between keyframes that are interpolated [s]

  /// Signed distances of points to the surface at `time`; not a number where it was not seen. Rows of
  /// `normals` that are not zero say which side is positive; the others become the normals that were taken.
  VectorXd distances(const Points& points, double time, Points& normals) const {
    VectorXd result = VectorXd::Constant(points.rows(), unseen);
    const auto after = std::find_if(keyframes.begin(), keyframes.end(),
                                    [&](const Seen& seen) { return seen.time >= time - 1e-9; });
    if (after == keyframes.end()) return result;
    const bool exact = after->time <= time + 1e-9;
    if (!exact && (after == keyframes.begin() || after->time - (after - 1)->time > longest_gap))
      return result;
    for (Eigen::Index i = 0; i < points.rows(); ++i) {
      const auto distance_to = [&](const Seen& seen) {
        Vector3d normal;
        const double distance = seen.planes->distance(points.row(i).transpose(), normal);
        if (normals.row(i).isZero(0)) normals.row(i) = normal.transpose();
        return std::copysign(1.0, normals.row(i).dot(normal)) * distance;
      };
      result[i] = distance_to(*after);
      if (exact) continue;
      const double share = (time - (after - 1)->time) / (after->time - (after - 1)->time);
      result[i] = share * result[i] + (1 - share) * distance_to(*(after - 1));
    }
    return result;
  }

  VectorXd distances(const Points& points, double time) const {
    Points normals = Points::Zero(points.rows(), 3);
    return distances(points, time, normals);
  }
};

Trial trial_of(const data::Recording& recording, const RepeatabilitySettings& settings) {
  std::vector<std::string> notices;
  Trial trial;
  for (data::Keyframe& keyframe : data::load_keyframes(recording, notices)) {
    if (keyframe.cloud.rows() < std::max(settings.min_points, settings.neighbours)) continue;
    auto planes = std::make_unique<LocalPlanes>(keyframe.cloud, settings.neighbours);
    trial.keyframes.push_back({keyframe.time, std::move(keyframe.cloud), std::move(planes)});
  }
  std::vector<double> gaps;
  for (std::size_t k = 1; k < trial.keyframes.size(); ++k)
    gaps.push_back(trial.keyframes[k].time - trial.keyframes[k - 1].time);
  if (!gaps.empty()) {
    std::nth_element(gaps.begin(), gaps.begin() + gaps.size() / 2, gaps.end());
    trial.longest_gap = 2.5 * gaps[gaps.size() / 2];
  }
  return trial;
}

bool is_scored(const Seen& seen, const RepeatabilitySettings& settings) {
  return seen.time >= settings.score_from && seen.time <= settings.score_to;
}

Points thinned(const Points& points, int count) {
  if (points.rows() <= count) return points;
  Points few(count, 3);
  for (int i = 0; i < count; ++i) few.row(i) = points.row(i * points.rows() / count);
  return few;
}

/// `registration` takes the second trial to the first.
Points in_second(const Points& first, const Registration& registration) {
  const Eigen::Isometry3d back = registration.observed_from_simulated().inverse();
  return (first * back.linear().transpose()).rowwise() + back.translation().transpose();
}
Points in_first(const Points& second, const Registration& registration) {
  const Eigen::Isometry3d there = registration.observed_from_simulated();
  return (second * there.linear().transpose()).rowwise() + there.translation().transpose();
}

/// Points of the first trial at a time.
struct Wanted {
  double time;
  Points points;
};

int count_points(const std::vector<Wanted>& wanted) {
  Eigen::Index count = 0;
  for (const Wanted& each : wanted) count += each.points.rows();
  return static_cast<int>(count);
}

/// The distances of `wanted` from the second trial over its offset, yaw and clock. Each of these is its bound
/// times the sine of a free number. Those without a bound stay where they are.
struct DistanceFunctor : Eigen::DenseFunctor<double> {
  DistanceFunctor(const Trial& second_in, const std::vector<Wanted>& wanted_in, std::vector<int> free_in,
                  const data::NuisanceBounds& nuisance, const Registration& start_in)
      : DenseFunctor(static_cast<int>(free_in.size()), count_points(wanted_in)),
        second(second_in),
        wanted(wanted_in),
        free(std::move(free_in)),
        bounds(bounds_of(nuisance)),
        start(start_in),
        weights(VectorXd::Ones(values())) {}

  const Trial& second;
  const std::vector<Wanted>& wanted;
  std::vector<int> free;
  std::array<double, 5> bounds;
  Registration start;
  VectorXd weights;  ///< of the distances

  static std::array<double, 5> bounds_of(const data::NuisanceBounds& nuisance) {
    return {nuisance.offset[0], nuisance.offset[1], nuisance.offset[2], nuisance.yaw, nuisance.time};
  }

  Registration at(const VectorXd& x) const {
    Registration registration = start;
    for (std::size_t j = 0; j < free.size(); ++j) {
      const int k = free[j];
      const double value = bounds[static_cast<std::size_t>(k)] * std::sin(x[static_cast<Eigen::Index>(j)]);
      if (k < 3)
        registration.offset[k] = value;
      else
        (k == 3 ? registration.yaw : registration.time_offset) = value;
    }
    return registration;
  }

  int operator()(const VectorXd& x, VectorXd& residuals) const {
    Points normals = Points::Zero(values(), 3);
    evaluate(x, normals, residuals);
    return 0;
  }

  /// Central differences. The planes of all evaluations face to the same sides.
  int df(const VectorXd& x, Eigen::MatrixXd& jacobian) const {
    constexpr double step = 0.02;  // Of a bound, for central differences. Work.
    Points normals = Points::Zero(values(), 3);
    VectorXd here, above, below;
    evaluate(x, normals, here);
    for (Eigen::Index j = 0; j < x.size(); ++j) {
      evaluate(x + step * VectorXd::Unit(x.size(), j), normals, above);
      evaluate(x - step * VectorXd::Unit(x.size(), j), normals, below);
      jacobian.col(j) = (above - below) / (2 * step);
    }
    return 0;
  }

  /// Weighted distances. Points that the second trial did not see count as if they were on its surface.
  void evaluate(const VectorXd& x, Points& normals, VectorXd& residuals) const {
    const Registration registration = at(x);
    Eigen::Index next = 0;
    residuals.setZero(values());
    for (const Wanted& each : wanted) {
      const Eigen::Index count = each.points.rows();
      Points sides = normals.middleRows(next, count);
      const VectorXd distances =
          second.distances(in_second(each.points, registration), each.time + registration.time_offset, sides);
      normals.middleRows(next, count) = sides;
      for (Eigen::Index i = 0; i < count; ++i, ++next)
        if (!std::isnan(distances[i])) residuals[next] = weights[next] * distances[i];
    }
  }
};

/// Lowers the mean distance from `x` on; returns it [m].
double minimize_mean_distance(DistanceFunctor& functor, VectorXd& x) {
  VectorXd distances;
  const auto evaluate = [&] {
    functor.weights = VectorXd::Ones(functor.values());
    functor(x, distances);
  };
  // Weights 1 / d, renewed: the fixed point minimizes the mean distance, not its square.
  for (int round = 0; round < 20; ++round) {
    const VectorXd before = x;
    evaluate();
    functor.weights = (distances.cwiseAbs().array() + softening).sqrt().inverse();
    Eigen::LevenbergMarquardt<DistanceFunctor> solver(functor);
    solver.setMaxfev(3);  // the weights change after it
    solver.minimize(x);
    if ((x - before).cwiseAbs().maxCoeff() < 1e-3) break;
  }
  evaluate();
  return distances.cwiseAbs().mean();
}

Registration fit_registration(const Trial& first, const Trial& second, const data::NuisanceBounds& nuisance,
                              const RepeatabilitySettings& settings, const Registration& start) {
  std::vector<Wanted> wanted;
  for (const Seen& seen : first.keyframes)
    if (is_scored(seen, settings))
      wanted.push_back({seen.time, thinned(seen.points, settings.points_per_keyframe)});
  const std::array<double, 5> bounds = DistanceFunctor::bounds_of(nuisance);
  std::vector<int> free;
  for (int k = 0; k < 5; ++k)
    if (bounds[static_cast<std::size_t>(k)] > 0) free.push_back(k);
  DistanceFunctor functor(second, wanted, free, nuisance, start);
  if (free.empty() || functor.values() <= functor.inputs()) return start;
  // A cloth in motion has several clocks that fit nearly.
  std::vector<double> clocks = {0};
  if (free.back() == 4) clocks = {0, -0.5, 0.5};
  VectorXd best;
  double least = std::numeric_limits<double>::infinity();
  for (const double clock : clocks) {
    VectorXd x = VectorXd::Zero(functor.inputs());
    x[functor.inputs() - 1] = clock;
    const double distance = minimize_mean_distance(functor, x);
    if (!(distance < least)) continue;
    least = distance;
    best = x;
  }
  return functor.at(best);
}

std::vector<std::string> bounds_hit(const Registration& registration, const data::NuisanceBounds& nuisance) {
  constexpr const char* kNames[] = {"offset_x", "offset_y", "offset_z", "yaw", "time"};
  const std::array<double, 5> bounds = DistanceFunctor::bounds_of(nuisance);
  const double values[] = {registration.offset[0], registration.offset[1], registration.offset[2],
                           registration.yaw, registration.time_offset};
  std::vector<std::string> hit;
  for (std::size_t k = 0; k < bounds.size(); ++k)
    if (bounds[k] > 0 && std::abs(values[k]) > 0.99 * bounds[k]) hit.emplace_back(kNames[k]);
  return hit;
}

double diagonal_of(const Points& rest) {
  return (rest.colwise().maxCoeff() - rest.colwise().minCoeff()).norm();
}

void check_same_sheet(const data::Recording& first, const data::Recording& second) {
  // Of the diagonal: meshes of one cloth may be cut to whole cells. Work: a refusal.
  constexpr double kSame = 0.02;
  const double one = diagonal_of(first.mesh.vertices), other = diagonal_of(second.mesh.vertices);
  if (std::abs(one - other) > kSame * one)
    throw data::input_error(second.source, "object.mesh",
                            "found a sheet of " + data::format_short(other) +
                                " m from corner to corner, expected " + data::format_short(one) +
                                " m as in " + first.source + ": two trials are of one cloth");
}

/// A window that leaves out all that was seen is its own cause.
void check_window(const data::Recording& first, const Trial& a, const data::Recording& second, const Trial& b,
                  const RepeatabilitySettings& settings) {
  std::string seen;
  for (const auto& [recording, trial] : {std::pair(&first, &a), std::pair(&second, &b)}) {
    if (trial->keyframes.empty()) return;
    if (std::any_of(trial->keyframes.begin(), trial->keyframes.end(),
                    [&](const Seen& each) { return is_scored(each, settings); }))
      return;
    seen += (seen.empty() ? "" : ", ") + recording->source + " " +
            data::format_short(trial->keyframes.front().time) + " to " +
            data::format_short(trial->keyframes.back().time) + " s";
  }
  constexpr double kOpen = 1e200;  // An end that was not given is beyond [s]. Work.
  const auto end = [](const char* option, double value) {
    return std::abs(value) < kOpen ? std::string(option) + " " + data::format_short(value) : "";
  };
  const std::string from = end("--from", settings.score_from), until = end("--until", settings.score_to);
  throw data::InputError(from + (from.empty() || until.empty() ? "" : ", ") + until +
                         ": found no keyframe with cloth in between, expected some of " + seen);
}

void add_distances(const Trial& from, const RepeatabilitySettings& settings,
                   const std::function<VectorXd(const Seen&)>& distances_of, Repeatability& result) {
  for (const Seen& seen : from.keyframes) {
    if (!is_scored(seen, settings)) continue;
    std::vector<double> distances;
    for (const double distance : distances_of(seen))
      if (!std::isnan(distance)) distances.push_back(std::abs(distance));
    if (static_cast<int>(distances.size()) < settings.min_points) continue;
    const double share = static_cast<double>(distances.size()) / static_cast<double>(seen.points.rows());
    result.keyframes.push_back({seen.time, robust_mean(distances, settings.robust), share});
  }
}

}  // namespace

Repeatability measure_repeatability(const data::Recording& first, const data::Recording& second,
                                    const RepeatabilitySettings& settings) {
  if (!(settings.score_from < settings.score_to))
    throw data::InputError("--from, --until: found " + data::format_short(settings.score_from) + " to " +
                           data::format_short(settings.score_to) + " s, expected --from below --until");
  check_same_sheet(first, second);
  const Trial a = trial_of(first, settings), b = trial_of(second, settings);
  check_window(first, a, second, b, settings);
  Registration start;
  start.pivot = first.start.colwise().mean().transpose();
  if (first.gravity.norm() > 0) start.up = -first.gravity.normalized();
  Repeatability result;
  result.registration = fit_registration(a, b, first.nuisance, settings, start);
  const Registration& r = result.registration;
  result.bounds_hit = bounds_hit(r, first.nuisance);
  add_distances(
      a, settings,
      [&](const Seen& seen) { return b.distances(in_second(seen.points, r), seen.time + r.time_offset); },
      result);
  add_distances(
      b, settings,
      [&](const Seen& seen) { return a.distances(in_first(seen.points, r), seen.time - r.time_offset); },
      result);
  if (result.keyframes.empty())
    throw data::InputError(
        first.source + ", " + second.source +
        ": no keyframe of one shows cloth that the other saw at the same time after its start");
  for (const TrialDistance& keyframe : result.keyframes)
    result.distance += keyframe.distance / static_cast<double>(result.keyframes.size());
  return result;
}

}  // namespace flash::sysid
