#include "calib/solve/held_out.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <random>

#include "calib/geometry/closed_form.h"
#include "calib/geometry/pose_from_pixels.h"
#include "data/machine/parallel.h"

namespace flash::calib {
namespace {

std::vector<PoseLoop> loops_of(const Bundle& bundle, const std::vector<BundleView>& views,
                               const std::vector<Eigen::Isometry3d>& T_camera_target) {
  std::vector<PoseLoop> loops;
  loops.reserve(views.size());
  for (const BundleView& view : views) {
    const auto pose = static_cast<std::size_t>(view.pose);
    loops.push_back(pose_loop(bundle.setup, bundle.poses[pose].T_base_gripper, T_camera_target[pose]));
  }
  return loops;
}

void fit(Bundle& bundle, const std::vector<Eigen::Isometry3d>& T_camera_target, Method method,
         const RefineSettings& settings) {
  if (method == Method::errors_in_variables || method == Method::pixels) {
    RefineSettings anew = settings;
    anew.estimate_pivots = false;
    bundle = refine(std::move(bundle), anew).bundle;
  }
  if (method == Method::errors_in_variables) return;
  if (method == Method::bundle || method == Method::pixels) {
    for (RobotPose& pose : bundle.poses) pose.correction = usual_correction(bundle, pose);
    solve_bundle(bundle, settings.noise, {.unknowns = {.corrections = false}, .huber = 0});
    return;
  }
  const std::vector<PoseLoop> loops = loops_of(bundle, bundle.views, T_camera_target);
  const HandEyePoses poses = method == Method::park ? park(loops) : shah(loops);
  bundle.cameras.front() = poses.X;
  bundle.targets.front() = poses.Z;
}

/// The same on every machine, unlike the standard library's.
template <class Random>
void shuffle(std::vector<int>& order, Random&& random) {
  for (std::size_t i = order.size() - 1; i > 0; --i) std::swap(order[i], order[random() % (i + 1)]);
}

}  // namespace

const char* to_string(Method method) {
  switch (method) {
    case Method::park:
      return "park";
    case Method::shah:
      return "shah";
    case Method::bundle:
      return "bundle";
    case Method::pixels:
      return "pixels";
    case Method::errors_in_variables:
      break;
  }
  return "errors_in_variables";
}

namespace {

/// Sums of one part of the views, predicted by a solution without them.
struct HeldOutSums {
  double px = 0, mm = 0, deg = 0, corners = 0, views = 0;
  std::vector<std::pair<int, Eigen::Vector3d>> squares = {};  // of a pose, as HeldOut has them
};

HeldOutSums hold_out_part(const Bundle& bundle, const std::vector<Eigen::Isometry3d>& T_camera_target,
                          Method method, const RefineSettings& settings, const std::vector<int>& fold,
                          int part) {
  HeldOutSums sums;
  Bundle train = views_of(bundle, fold, part, false);
  fit(train, T_camera_target, method, settings);
  const Bundle test = views_of(bundle, fold, part, true);
  for (const BundleView& view : test.views) {
    const Eigen::Isometry3d predicted = predicted_pose(train, view, false);
    // With lens and size of the target as they were solved for.
    const Eigen::Matrix3Xd points = true_points(train, view);
    const Eigen::Isometry3d seen =
        fitted_pose(train.intrinsics[static_cast<std::size_t>(view.camera)], points, true_pixels(train, view),
                    T_camera_target[static_cast<std::size_t>(view.pose)]);
    const Eigen::Vector3d centre = points.rowwise().mean();
    const double angle = rotation_angle(predicted.linear().transpose() * seen.linear());
    const auto corners = static_cast<double>(view.points.cols());
    const Eigen::Vector3d squares(residuals(train, view, false).squaredNorm() / corners,
                                  (1e3 * (predicted * centre - seen * centre)).squaredNorm(),
                                  std::pow(angle * 180 / M_PI, 2));
    sums.squares.emplace_back(view.pose, squares);
    sums.px += corners * squares[0];
    sums.mm += squares[1];
    sums.deg += squares[2];
    sums.corners += corners;
    ++sums.views;
  }
  return sums;
}

}  // namespace

std::vector<int> parts_of(int count, int folds, unsigned seed) {
  std::vector<int> order(static_cast<std::size_t>(count));
  std::iota(order.begin(), order.end(), 0);
  if (seed > 0) shuffle(order, std::mt19937(seed));
  std::vector<int> part(order.size());
  for (std::size_t i = 0; i < order.size(); ++i)
    part[static_cast<std::size_t>(order[i])] = static_cast<int>(i) % std::min(folds, count);
  return part;
}

HeldOut hold_out(const Bundle& bundle, const std::vector<Eigen::Isometry3d>& T_camera_target, Method method,
                 const RefineSettings& settings, int folds, int threads, unsigned seed) {
  const int count = static_cast<int>(bundle.poses.size());
  const int parts = std::min(folds, count);
  HeldOut result;
  result.fold = parts_of(count, folds, seed);
  std::vector<HeldOutSums> sums(static_cast<std::size_t>(parts));
  data::for_each_in_parallel(sums.size(), threads, [&](std::size_t part) {
    sums[part] =
        hold_out_part(bundle, T_camera_target, method, settings, result.fold, static_cast<int>(part));
  });
  HeldOutSums all;
  result.squares.assign(static_cast<std::size_t>(count), Eigen::Vector3d::Zero());
  for (const HeldOutSums& part : sums) {
    all.px += part.px;
    all.mm += part.mm;
    all.deg += part.deg;
    all.corners += part.corners;
    all.views += part.views;
    for (const auto& [pose, squares] : part.squares) result.squares[static_cast<std::size_t>(pose)] = squares;
  }
  result.px = std::sqrt(all.px / all.corners);
  result.mm = std::sqrt(all.mm / all.views);
  result.deg = std::sqrt(all.deg / all.views);
  return result;
}

double Halves::rms() const {
  double sum = 0;
  for (const double distance : apart) sum += distance * distance;
  return std::sqrt(sum / static_cast<double>(apart.size()));
}

Halves halves_apart(const Bundle& bundle, const std::vector<Eigen::Isometry3d>& T_camera_target,
                    Method method, const RefineSettings& settings, const Eigen::Vector3d& middle, int splits,
                    int threads) {
  const std::size_t count = bundle.poses.size();
  Halves halves;
  std::mt19937 random(1);
  std::vector<std::vector<int>> half_of;
  for (int split = 0; split < splits; ++split) {
    std::vector<int> order(count);
    std::iota(order.begin(), order.end(), 0);
    shuffle(order, random);
    order.resize(count / 2);
    std::sort(order.begin(), order.end());
    half_of.emplace_back(count, 1);
    for (const int pose : order) half_of.back()[static_cast<std::size_t>(pose)] = 0;
    halves.first.push_back(std::move(order));
  }
  halves.apart.resize(half_of.size());
  data::for_each_in_parallel(half_of.size(), threads, [&](std::size_t split) {
    std::array<Eigen::Isometry3d, 2> X;
    for (std::size_t half = 0; half < 2; ++half) {
      Bundle own = views_of(bundle, half_of[split], static_cast<int>(half), true);
      fit(own, T_camera_target, method, settings);
      X[half] = own.cameras.front();
    }
    halves.apart[split] = 1e3 * (X[0] * (X[1].inverse() * middle) - middle).norm();
  });
  return halves;
}

std::vector<double> means_of_folds(const HeldOut& held, int measure) {
  const int folds = held.fold.empty() ? 0 : *std::max_element(held.fold.begin(), held.fold.end()) + 1;
  std::vector<double> means(static_cast<std::size_t>(folds), 0), counts = means;
  for (std::size_t i = 0; i < held.squares.size(); ++i) {
    means[static_cast<std::size_t>(held.fold[i])] += held.squares[i][measure];
    ++counts[static_cast<std::size_t>(held.fold[i])];
  }
  for (std::size_t f = 0; f < means.size(); ++f) means[f] /= std::max(1.0, counts[f]);
  return means;
}

MeanDifference mean_difference(const std::vector<double>& a, const std::vector<double>& b) {
  MeanDifference result;
  const auto count = static_cast<double>(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) result.mean += (a[i] - b[i]) / count;
  for (std::size_t i = 0; i < a.size(); ++i)
    result.sd += std::pow(a[i] - b[i] - result.mean, 2) / (count * (count - 1));
  result.sd = std::sqrt(result.sd);
  return result;
}

}  // namespace flash::calib
