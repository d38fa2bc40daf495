#include "sysid/infer/importance_sampling.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>
#include <vector>

#include "sysid/infer/bent_student.h"
#include "sysid/infer/scrambled_halton.h"

namespace flash::sysid {
namespace {

using Eigen::Index;

double effective_size_of(const Eigen::VectorXd& weights) { return 1 / weights.squaredNorm(); }

struct Mixture {
  std::vector<BentStudent> components;
  std::vector<double> shares;
  double draws = 0;  ///< how many were drawn of it, those outside of the box among them

  /// Number of draws times their density, at points of the unit box.
  Eigen::ArrayXd drawn_at(const Eigen::MatrixXd& points) const {
    Eigen::ArrayXd sum = Eigen::ArrayXd::Zero(points.rows());
    for (std::size_t c = 0; c < components.size(); ++c)
      sum += draws * shares[c] * components[c].densities(points);
    return sum;
  }

  /// Draws until `count` are in the unit box, a row each. Fewer where hardly any is.
  Eigen::MatrixXd draw(Index count, RandomNumbers& random) {
    // Draws a point in the box. Work: a cap where hardly any is inside.
    constexpr double kMostPerPoint = 10'000;
    Eigen::MatrixXd inside(count, components.front().mean.size());
    Index found = 0;
    while (found < count && draws < kMostPerPoint * static_cast<double>(count)) {
      double left = random.uniform();
      std::size_t c = 0;
      while (c + 1 < shares.size() && left >= shares[c]) left -= shares[c++];
      const Eigen::VectorXd x = components[c].draw(random);
      ++draws;
      if ((x.array() >= 0).all() && (x.array() <= 1).all()) inside.row(found++) = x.transpose();
    }
    return inside.topRows(found);
  }
};

/// Points of the unit box that were asked for, and of what they were drawn.
class Sample {
 public:
  Sample(const Eigen::MatrixXd& even, const Eigen::VectorXd& logs)
      : even_(static_cast<double>(even.rows())),
        points_(even),
        logs_(logs),
        drawn_(Eigen::ArrayXd::Constant(even.rows(), even_)) {}

  Index size() const { return points_.rows(); }
  const Eigen::MatrixXd& points() const { return points_; }
  const Eigen::VectorXd& logs() const { return logs_; }

  /// Of each point for a power of the density. Some log is finite.
  Eigen::VectorXd weights(double power) const {
    const Eigen::ArrayXd logs = power * logs_.array() - drawn_.log();
    // Eigen's vectorized exp(-infinity) is not 0.
    const Eigen::ArrayXd shares = logs.isFinite().select((logs - logs.maxCoeff()).exp(), 0);
    return shares / shares.sum();
  }

  /// For the largest power up to `most` at which the effective size is `least`.
  Eigen::VectorXd tempered_weights(double least, double most) const {
    Eigen::VectorXd at = weights(most);
    if (effective_size_of(at) >= least) return at;
    double low = 0, high = most;
    for (int i = 0; i < 40; ++i) {
      const double middle = (low + high) / 2;
      (effective_size_of(weights(middle)) >= least ? low : high) = middle;
    }
    return weights(high);  // above 0, which would give points of density 0 a weight
  }

  void add(const Mixture& mixture, const Eigen::MatrixXd& points, const Eigen::VectorXd& logs) {
    drawn_ += mixture.drawn_at(points_);
    mixtures_.push_back(mixture);
    Eigen::ArrayXd drawn = Eigen::ArrayXd::Constant(points.rows(), even_);
    for (const Mixture& each : mixtures_) drawn += each.drawn_at(points);
    const Index before = size(), after = before + points.rows();
    points_.conservativeResize(after, Eigen::NoChange);
    points_.bottomRows(points.rows()) = points;
    logs_.conservativeResize(after);
    logs_.tail(points.rows()) = logs;
    drawn_.conservativeResize(after);
    drawn_.tail(points.rows()) = drawn;
  }

 private:
  double even_;  ///< number of points that fill the box
  Eigen::MatrixXd points_;
  Eigen::VectorXd logs_;
  Eigen::ArrayXd drawn_;  ///< number of draws times their density
  std::vector<Mixture> mixtures_;
};

/// One component for all points, which has half, and some for neighbourhoods of points drawn by weight.
Mixture fitted_mixture(const Eigen::MatrixXd& all, const Eigen::VectorXd& all_weights,
                       RandomNumbers& random) {
  constexpr double kNothing = 1e-9;  // Weight of a point that tells nothing. Work.
  // Share of the component for all. Work: a proposal, whose draws are weighted.
  constexpr double kWhole = 0.5;
  constexpr Index kLocal = 8;     // Components for neighbourhoods. Work: likewise.
  constexpr double kNear = 0.7;   // Size of a neighbourhood, in standard deviations. Work: likewise.
  constexpr double kWider = 1.1;  // Than fitted: weights are bounded by tails. Work: likewise.
  std::vector<Index> telling;
  for (Index i = 0; i < all_weights.size(); ++i)
    if (all_weights[i] > kNothing) telling.push_back(i);
  const Eigen::MatrixXd points = all(telling, Eigen::all);
  const Eigen::VectorXd weights = all_weights(telling) / all_weights(telling).sum();
  const Eigen::MatrixXd from = points.rowwise() - weights.transpose() * points;
  Eigen::MatrixXd covariance = from.transpose() * weights.asDiagonal() * from;
  covariance.diagonal().array() += std::numeric_limits<double>::epsilon();  // where all are one point
  const Eigen::MatrixXd white = covariance.llt().matrixL().solve(from.transpose());
  Mixture mixture{{fitted_student(points, weights, covariance)}, {kWhole}};
  for (const Index centre : systematic_rows(weights, kLocal, random.uniform())) {
    const Eigen::ArrayXd squares =
        (white.colwise() - white.col(centre)).colwise().squaredNorm().transpose().array();
    const Eigen::VectorXd near = weights.array() * (-squares / (2 * kNear * kNear)).exp();
    mixture.components.push_back(fitted_student(points, near / near.sum(), kNear * kNear * covariance));
    mixture.shares.push_back((1 - kWhole) / kLocal);
  }
  for (BentStudent& component : mixture.components) component.root *= kWider;
  return mixture;
}

std::string count_of(Index points) { return std::to_string(points) + " points of the box"; }

/// Log densities at points of the unit box.
class Asked {
 public:
  Asked(const LogDensities& log_densities, const Eigen::VectorXd& low, const Eigen::VectorXd& high)
      : log_densities_(&log_densities), low_(low), width_(high - low) {
    if (low.size() == 0 || low.size() != high.size() || !(width_.array() > 0).all() || !width_.allFinite())
      throw std::invalid_argument("importance sampling: the box needs low < high in every coordinate");
  }

  Eigen::MatrixXd in_box(const Eigen::MatrixXd& unit) const {
    return (unit * width_.asDiagonal()).rowwise() + low_.transpose();
  }

  Eigen::VectorXd operator()(const Eigen::MatrixXd& unit) const {
    const Eigen::VectorXd logs = (*log_densities_)(in_box(unit));
    if (!(logs.array() < INFINITY).all())
      throw std::domain_error("importance sampling: a log density is NaN or infinite");
    return logs;
  }

 private:
  const LogDensities* log_densities_;
  Eigen::VectorXd low_, width_;
};

/// Points that fill the box: twice as many as long as no density is above 0.
Sample first_sample(const Asked& asked, Index dimensions, const ImportanceSettings& settings) {
  Eigen::MatrixXd even =
      scrambled_halton(settings.first_per_dimension * dimensions, dimensions, settings.seed);
  Eigen::VectorXd logs = asked(even);
  while (logs.maxCoeff() == -INFINITY) {
    const Index before = even.rows();
    if (before >= settings.most)
      throw std::domain_error("importance sampling: the density is 0 at " + count_of(before));
    even = scrambled_halton(2 * before, dimensions, settings.seed);
    logs = Eigen::VectorXd::Constant(2 * before, -INFINITY);
    logs.tail(before) = asked(even.bottomRows(before));
  }
  return {even, logs};
}

}  // namespace

std::vector<Index> systematic_rows(const Eigen::VectorXd& weights, Index count, double offset) {
  std::vector<Index> rows;
  double sum = weights[0];
  Index row = 0;
  for (Index i = 0; i < count; ++i) {
    const double at = (static_cast<double>(i) + offset) / static_cast<double>(count);
    while (sum <= at && row + 1 < weights.size()) sum += weights[++row];
    rows.push_back(row);
  }
  return rows;
}

double WeightedDraws::quantile(Eigen::Index k, double share) const {
  std::vector<Index> order;
  for (Index i = 0; i < points.rows(); ++i)
    if (weights[i] > 0) order.push_back(i);
  std::sort(order.begin(), order.end(), [&](Index a, Index b) { return points(a, k) < points(b, k); });
  double below = 0, last = points(order.front(), k), last_share = 0;
  for (const Index i : order) {
    const double here = points(i, k), middle = below + weights[i] / 2;
    if (middle >= share) return last + (here - last) * (share - last_share) / (middle - last_share);
    below += weights[i];
    last = here;
    last_share = middle;
  }
  return last;
}

Eigen::MatrixXd WeightedDraws::resampled(Eigen::Index count, unsigned seed) const {
  return points(systematic_rows(weights, count, RandomNumbers(seed).uniform()), Eigen::all);
}

WeightedDraws sample_by_importance(const LogDensities& log_densities, const Eigen::VectorXd& low,
                                   const Eigen::VectorXd& high, const ImportanceSettings& settings) {
  constexpr double kPower = 0.5;  // Of every second proposal. Work: finds the ends of ridges.
  // Effective size that a fit needs. Work: a proposal, whose draws are weighted.
  constexpr double kPerDimension = 10;
  const Asked asked(log_densities, low, high);
  const Index dimensions = low.size();
  Sample sample = first_sample(asked, dimensions, settings);
  RandomNumbers random(settings.seed);
  Eigen::VectorXd weights = sample.weights(1);
  for (int round = 0; effective_size_of(weights) < settings.enough && sample.size() < settings.most;
       ++round) {
    const double least = kPerDimension * static_cast<double>(dimensions + 1);
    Mixture mixture =
        fitted_mixture(sample.points(), sample.tempered_weights(least, round % 2 == 0 ? kPower : 1), random);
    const Eigen::MatrixXd points = mixture.draw(settings.batch, random);
    if (points.rows() == 0) break;
    sample.add(mixture, points, asked(points));
    weights = sample.weights(1);
  }
  const double size = effective_size_of(weights);
  return {asked.in_box(sample.points()), sample.logs(), weights, size, size >= settings.enough};
}

}  // namespace flash::sysid
