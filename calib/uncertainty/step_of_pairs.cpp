#include "calib/uncertainty/step_of_pairs.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "data/numbers/median.h"

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

/// Of each component by itself.
Vector6d median_of(Scatter::const_iterator begin, Scatter::const_iterator end) {
  Vector6d medians;
  for (Eigen::Index c = 0; c < 6; ++c) {
    std::vector<double> values;
    for (auto one = begin; one != end; ++one) values.push_back((*one)[c]);
    medians[c] = data::median(std::move(values));
  }
  return medians;
}

/// Whether more than outliers moved.
bool medians_move(const Scatter& sequence, const StepOfPairs& step) {
  const auto since = sequence.begin() + static_cast<std::ptrdiff_t>(step.first);
  const Vector6d medians = median_of(since, sequence.end()) - median_of(sequence.begin(), since);
  return medians.head<3>().norm() > 0.5 * step.motion.head<3>().norm() ||
         medians.tail<3>().norm() > 0.5 * step.motion.tail<3>().norm();
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
  if (!(step.gain > kGain) || as_likely > kChance || !medians_move(sequence, step)) return std::nullopt;
  return step;
}

/// Past the last of the pairs from `first` on for which the robot stood still.
std::size_t end_of_pose(const std::vector<PoseLoop>& loops, std::size_t first) {
  constexpr double kStill = 1e-5;  // [m], [rad]: what a robot reports anew where it stands
  std::size_t end = first + 1;
  while (end < loops.size() && motion_between(loops[first].G, loops[end].G).cwiseAbs().maxCoeff() < kStill)
    ++end;
  return end;
}

}  // namespace

std::optional<StepOfPairs> step_of_pairs(const std::vector<PoseLoop>& loops, const HandEyePoses& poses) {
  constexpr std::size_t kFewest = 10;
  Scatter of_camera, of_target;
  std::vector<std::size_t> firsts;  // of the pairs that count as one
  for (std::size_t i = 0; i < loops.size();) {
    const std::size_t end = end_of_pose(loops, i);
    firsts.push_back(i);
    Vector6d camera = Vector6d::Zero(), target = Vector6d::Zero();
    for (const std::size_t first = i; i < end; ++i) {
      const PoseLoop& loop = loops[i];
      const auto share = 1 / static_cast<double>(end - first);
      camera += share * motion_between(poses.X, loop.G.inverse() * poses.Z * loop.C.inverse());
      target += share * motion_between(poses.Z, loop.G * poses.X * loop.C);
    }
    of_camera.push_back(camera);
    of_target.push_back(target);
  }
  if (firsts.size() < kFewest) return std::nullopt;
  std::optional<StepOfPairs> step = step_of(of_camera);
  std::optional<StepOfPairs> other = step_of(of_target);
  if (other) other->of_target = true;
  if (!step || (other && other->gain > step->gain)) step = other;
  if (step) step->first = firsts[step->first];
  return step;
}

}  // namespace flash::calib
