#include "calib/uncertainty/step_of_pairs.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

namespace flash::calib {
namespace {

constexpr std::size_t kSide = 2;  // pairs on either side of a step, at least: one is an outlier

using Scatter = std::vector<Vector6d>;

/// The likeliest step of a sequence.
StepOfPairs likeliest_step(const Scatter& sequence, const Matrix6d& total) {
  const auto n = static_cast<double>(sequence.size());
  const Vector6d sum = std::accumulate(sequence.begin(), sequence.end(), Vector6d(Vector6d::Zero()));
  const double of_one_mean = total.ldlt().vectorD().array().log().sum();
  StepOfPairs best{.gain = -INFINITY};
  Vector6d before = Vector6d::Zero();
  for (std::size_t k = 1; k + kSide <= sequence.size(); ++k) {
    before += sequence[k - 1];
    if (k < kSide) continue;
    const auto first = static_cast<double>(k);
    const Vector6d motion = (sum - before) / (n - first) - before / first;
    const Matrix6d within = total - first * (n - first) / n * motion * motion.transpose();
    const double of_two_means = within.ldlt().vectorD().array().log().sum();
    const double unknowns = 7;  // the motion, and when it was
    const double gain = n * (of_one_mean - of_two_means) - unknowns * std::log(n);
    if (gain <= best.gain) continue;
    const Vector6d variances = within.diagonal() / (n - 2);
    best = {.first = k,
            .motion = motion,
            .distance = std::max(motion.head<3>().norm() / std::sqrt(variances.head<3>().mean()),
                                 motion.tail<3>().norm() / std::sqrt(variances.tail<3>().mean())),
            .gain = gain};
  }
  return best;
}

std::optional<StepOfPairs> step_of(const Scatter& sequence) {
  constexpr int kOrders = 100, kChance = 2;
  constexpr double kGain = 20;
  Vector6d mean = Vector6d::Zero();
  for (const Vector6d& one : sequence) mean += one / static_cast<double>(sequence.size());
  Matrix6d total = Matrix6d::Zero();
  for (const Vector6d& one : sequence) total += (one - mean) * (one - mean).transpose();
  // What scatters by less than a micrometre and 1e-6 rad is alike.
  total.diagonal().array() += 1e-12 * static_cast<double>(sequence.size());
  const StepOfPairs step = likeliest_step(sequence, total);
  Scatter other = sequence;
  std::mt19937 random(1);
  int as_likely = 0;
  for (int order = 0; order < kOrders; ++order) {
    for (std::size_t i = other.size(); i > 1; --i) std::swap(other[i - 1], other[random() % i]);
    as_likely += likeliest_step(other, total).gain >= step.gain;
  }
  if (!(step.gain > kGain) || as_likely > kChance) return std::nullopt;
  return step;
}

}  // namespace

std::optional<StepOfPairs> step_of_pairs(const std::vector<PoseLoop>& loops, const HandEyePoses& poses) {
  constexpr std::size_t kFewest = 10;
  if (loops.size() < kFewest) return std::nullopt;
  Scatter of_camera, of_target;
  for (const PoseLoop& loop : loops) {
    of_camera.push_back(motion_between(poses.X, loop.G.inverse() * poses.Z * loop.C.inverse()));
    of_target.push_back(motion_between(poses.Z, loop.G * poses.X * loop.C));
  }
  std::optional<StepOfPairs> step = step_of(of_camera);
  std::optional<StepOfPairs> other = step_of(of_target);
  if (other) other->of_target = true;
  return !step || (other && other->gain > step->gain) ? other : step;
}

}  // namespace flash::calib
