#include "sysid/infer/surrogate_sampling.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

namespace flash::sysid {
namespace {

using Eigen::Index;

constexpr double kMostLog = 300;  // Of a weight. Work: the square of the exponential is finite.

/// 1 for weights of 1, given by their logarithms: 1 / (1 + mean (w - 1)^2), which is the effective size over
/// the number where their mean is 1. That a surrogate is off by a constant counts, too: it is so where it is
/// high far from what is likely.
double agreement_of(const Eigen::VectorXd& logs) {
  return 1 / (1 + (logs.array().min(kMostLog).exp() - 1).square().mean());
}

/// In which draws look like a Gaussian.
BentStudent coordinates_of(const WeightedDraws& draws, const Eigen::VectorXd& width) {
  constexpr double kLeast = 1e-6;  // Of the box. Work: rounding.
  const Eigen::MatrixXd prior = (kLeast * width).cwiseAbs2().asDiagonal();
  return fitted_student(draws.points, draws.weights, prior);
}

class Asking {
 public:
  Asking(const LogDensities& log_densities, AskedPoints& asked)
      : log_densities_(&log_densities), asked_(&asked) {}

  Eigen::VectorXd operator()(const Eigen::MatrixXd& points) {
    Eigen::VectorXd logs = (*log_densities_)(points);
    if (!(logs.array() < INFINITY).all())
      throw std::domain_error("importance sampling: a log density is NaN or infinite");
    asked_->add(points, logs);
    return logs;
  }

 private:
  const LogDensities* log_densities_;
  AskedPoints* asked_;
};

/// Of draws of a density like the one at hand, those inside of a box, from the tails too.
Eigen::MatrixXd first_points(const WeightedDraws& before, const Eigen::VectorXd& low,
                             const Eigen::VectorXd& high) {
  // Of a density like the one at hand, so that tails are asked for. Work.
  constexpr double kPower = 0.5;
  const Index count = 2 * quadratic_coefficients(low.size());
  const Eigen::MatrixXd points =
      before.points(systematic_rows(weights_of_power(before, kPower), count, 0.5), Eigen::all);
  std::vector<Index> inside;
  for (Index i = 0; i < count; ++i) {
    const auto x = points.row(i).transpose().array();
    if ((x >= low.array()).all() && (x <= high.array()).all()) inside.push_back(i);
  }
  return points(inside, Eigen::all);
}

/// Draws that show where the density is likely.
WeightedDraws located(Asking& ask, const Eigen::VectorXd& low, const Eigen::VectorXd& high,
                      const SurrogateSettings& settings, const AskedPoints& asked) {
  // Points a coordinate that come first, and of a batch. Work: they locate, and do not count.
  constexpr int kFirst = 24, kBatch = 32;
  constexpr double kEnough = 30;  // Effective size a coordinate that locates. Work: likewise.
  const Index d = low.size();
  if (settings.before != nullptr && asked.size() == 0) {
    const Eigen::MatrixXd points = first_points(*settings.before, low, high);
    if (points.rows() > quadratic_coefficients(d)) ask(points);
  }
  if (settings.before != nullptr && asked.size() > 0 && asked.log_densities.maxCoeff() > -INFINITY)
    return *settings.before;
  return sample_by_importance([&](const Eigen::MatrixXd& points) { return ask(points); }, low, high,
                              {.first_per_dimension = kFirst,
                               .batch = kBatch,
                               .enough = kEnough * static_cast<double>(d),
                               .most = settings.most,
                               .seed = settings.seed});
}

}  // namespace

Eigen::VectorXd weights_of_power(const WeightedDraws& draws, double power) {
  Eigen::VectorXd logs = Eigen::VectorXd::Constant(draws.weights.size(), -INFINITY);
  for (Index i = 0; i < logs.size(); ++i)
    if (draws.weights[i] > 0) logs[i] = std::log(draws.weights[i]) + (power - 1) * draws.log_densities[i];
  const double highest = logs.maxCoeff();
  const Eigen::VectorXd weights = logs.unaryExpr([&](double log) { return std::exp(log - highest); });
  return weights / weights.sum();
}

SurrogateDraws sample_by_surrogate(const LogDensities& log_densities, const Eigen::VectorXd& low,
                                   const Eigen::VectorXd& high, AskedPoints& asked,
                                   const SurrogateSettings& settings) {
  // Of the density, for the draws of the tails. Work: these are asked for, and not kept.
  constexpr double kPower = 0.5;
  // Agreement of draws that tell coordinates; without a likely one it is 0.5. Work: a surrogate, whose draws
  // are tried.
  constexpr double kTrusted = 0.6;
  // Agreement of draws that may stand. Half of them in cells that are empty have 2 / 3. Chosen: above that;
  // not varied.
  constexpr double kLeast = 0.75;
  const Index d = low.size(), fresh = 4 * (d + 1), tails = 2 * (d + 1);
  // Surrogates in a row that have hardly any likely draw. Work: then the likelihood itself is sampled.
  constexpr int kTries = 4;
  Asking ask(log_densities, asked);
  SurrogateDraws found;
  found.draws = located(ask, low, high, settings, asked);
  BentStudent coordinates = coordinates_of(found.draws, high - low);
  int failed = 0;  // in a row
  for (int batch = 0; batch < settings.batches; ++batch) {
    const LogDensitySurrogate surrogate(asked, coordinates);
    found.draws = sample_by_importance(surrogate, low, high,
                                       {.batch = static_cast<int>(settings.enough / 4),
                                        .enough = settings.enough,
                                        .most = static_cast<int>(10 * settings.enough),
                                        .seed = settings.seed + static_cast<unsigned>(batch)});
    const auto agreement = [&](double power, Index count) {
      const std::vector<Index> rows = systematic_rows(weights_of_power(found.draws, power), count, 0.5);
      const Eigen::MatrixXd points = found.draws.points(rows, Eigen::all);
      return agreement_of(power * (ask(points) - surrogate(points)));
    };
    found.agreement = std::min(agreement(1, fresh), agreement(kPower, tails));
    if (found.agreement >= settings.agreement) break;
    failed = found.agreement > kTrusted ? 0 : failed + 1;
    if (failed == 0) coordinates = coordinates_of(found.draws, high - low);
    if (failed == kTries) break;
  }
  if (!(found.agreement > kLeast)) {
    found.draws = sample_by_importance(
        [&](const Eigen::MatrixXd& points) { return ask(points); }, low, high,
        {.enough = settings.enough_without, .most = settings.most, .seed = settings.seed});
    found.agreement = 1;
    return found;
  }
  found.draws.effective_size *= found.agreement;
  found.draws.enough = found.draws.effective_size >= settings.enough_without;
  return found;
}

}  // namespace flash::sysid
