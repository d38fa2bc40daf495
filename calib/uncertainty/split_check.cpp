#include "calib/uncertainty/split_check.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>

#include "calib/solve/linearization.h"
#include "data/machine/parallel.h"
#include "data/numbers/chi_square.h"

namespace flash::calib {
namespace {

constexpr Split kSystematic[] = {Split::consecutive, Split::place_1, Split::place_2, Split::place_3};

/// Where each of these gripper places stands along their principal axis of the given rank.
std::vector<double> along_axis(const std::vector<Eigen::Vector3d>& places, int rank) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& place : places) mean += place / static_cast<double>(places.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& place : places) scatter += (place - mean) * (place - mean).transpose();
  const Eigen::Vector3d axis =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter).eigenvectors().col(2 - rank);
  std::vector<double> along;
  along.reserve(places.size());
  for (const Eigen::Vector3d& place : places) along.push_back(axis.dot(place - mean));
  return along;
}

/// What orders the poses of one arm; the upper half of the order is the second half.
std::vector<double> order_of(const std::vector<Eigen::Vector3d>& places, Split split) {
  std::vector<double> order(places.size());
  for (std::size_t i = 0; i < order.size(); ++i)
    order[i] = static_cast<double>(split == Split::interleaved ? i % 2 : i);
  if (split == Split::place_1) return along_axis(places, 0);
  if (split == Split::place_2) return along_axis(places, 1);
  if (split == Split::place_3) return along_axis(places, 2);
  return order;
}

/// 0 or 1 for each pose.
std::vector<int> halves_of(const Bundle& bundle, Split split) {
  std::vector<int> half(bundle.poses.size(), 0);
  for (int arm = 0; arm < static_cast<int>(bundle.bases.size()); ++arm) {
    std::vector<std::size_t> poses;
    std::vector<Eigen::Vector3d> places;
    for (std::size_t i = 0; i < half.size(); ++i) {
      if (bundle.poses[i].arm != arm) continue;
      poses.push_back(i);
      places.emplace_back(bundle.poses[i].T_base_gripper.translation());
    }
    const std::vector<int> own = halves_of(places, split);
    for (std::size_t i = 0; i < own.size(); ++i) half[poses[i]] = own[i];
  }
  return half;
}

}  // namespace

std::vector<int> halves_of(const std::vector<Eigen::Vector3d>& places, Split split) {
  if (places.empty()) return {};
  const std::vector<double> order = order_of(places, split);
  std::vector<std::size_t> rank(places.size());
  for (std::size_t i = 0; i < rank.size(); ++i) rank[i] = i;
  std::stable_sort(rank.begin(), rank.end(),
                   [&](std::size_t a, std::size_t b) { return order[a] < order[b]; });
  std::vector<int> half(places.size(), 0);
  for (std::size_t i = rank.size() / 2; i < rank.size(); ++i) half[rank[i]] = 1;
  return half;
}

SplitCheck check_halves(const Refinement& refined, const BundleSettings& settings, Split split,
                        std::size_t base) {
  const Bundle& bundle = refined.bundle;
  const std::vector<int> half = halves_of(bundle, split);
  RefineSettings fixed;
  fixed.bundle = settings;
  fixed.estimate_noise = false;
  fixed.noise = refined.noise;
  const SharedColumns columns = shared_columns(bundle, settings.unknowns);
  const int column = base == 0 ? columns.cameras.front() : columns.bases[base];
  Eigen::Isometry3d T[2];
  Matrix6d covariance = Matrix6d::Zero();
  for (int part = 0; part < 2; ++part) {
    const Refinement fit = refine(views_of(bundle, half, part, true), fixed);
    T[part] = base == 0 ? fit.bundle.cameras.front() : fit.bundle.bases[base];
    covariance += fit.covariance.block<6, 6>(column, column);
  }
  SplitCheck check{.split = split};
  check.apart = motion_between(T[0], T[1]);
  check.chi_square = check.apart.dot(covariance.ldlt().solve(check.apart));
  return check;
}

std::vector<SplitCheck> check_systematic(const Refinement& refined, const BundleSettings& settings,
                                         std::size_t base, int threads) {
  std::vector<SplitCheck> checks(std::size(kSystematic));
  data::for_each_in_parallel(checks.size(), threads, [&](std::size_t k) {
    checks[k] = check_halves(refined, settings, kSystematic[k], base);
  });
  return checks;
}

double split_inflation(const std::vector<SplitCheck>& checks, const SplitCheck** worst) {
  // Once in twenty by any: of one split, of four, of five.
  const double limit = checks.size() > 4   ? data::chi_square_99_of_6
                       : checks.size() > 1 ? data::chi_square_9875_of_6
                                           : data::chi_square_95_of_6;
  const auto largest = std::max_element(
      checks.begin(), checks.end(), [](const auto& a, const auto& b) { return a.chi_square < b.chi_square; });
  if (largest == checks.end() || largest->chi_square <= limit) return 1;
  if (worst) *worst = &*largest;
  return largest->chi_square / 6;
}

const char* to_string(Split split) {
  switch (split) {
    case Split::interleaved:
      return "interleaved";
    case Split::consecutive:
      return "consecutive";
    case Split::place_1:
      return "place_1";
    case Split::place_2:
      return "place_2";
    case Split::place_3:
      break;
  }
  return "place_3";
}

std::string describe(Split split) {
  switch (split) {
    case Split::interleaved:
      return "every other view";
    case Split::consecutive:
      return "first and second half of the views";
    case Split::place_1:
    case Split::place_2:
    case Split::place_3:
      break;
  }
  return "views from two halves of the robot's places";
}

}  // namespace flash::calib
