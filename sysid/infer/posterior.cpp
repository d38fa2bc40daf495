#include "sysid/infer/posterior.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <utility>

#include "sysid/emulate/tensor_spline.h"
#include "sysid/infer/agreed_numbers.h"
#include "sysid/infer/ensemble_sampler.h"

namespace flash::sysid {
namespace {

constexpr Eigen::Index kWalkers = 64;  // Of the ensemble. Work.
/// Deviance over the least beyond which a spline need not follow. Work: the density there is 4e-44 of the
/// largest.
constexpr double kFarthest = 200;

std::vector<Eigen::VectorXd> knots_of(const std::vector<Axis>& axes) {
  std::vector<Eigen::VectorXd> knots;
  for (const Axis& axis : axes) {
    Eigen::VectorXd& each = knots.emplace_back(static_cast<Eigen::Index>(axis.values.size()));
    for (std::size_t i = 0; i < axis.values.size(); ++i)
      each[static_cast<Eigen::Index>(i)] = coordinate_of(axis, axis.values[i]);
  }
  return knots;
}

Eigen::VectorXd node_of(const TensorSpline& spline, Eigen::Index i) {
  Eigen::VectorXd x(spline.dimensions());
  for (Eigen::Index k = spline.dimensions(); k-- > 0;) {
    const Eigen::Index count = spline.knots(k).size();
    x[k] = spline.knots(k)[i % count];
    i /= count;
  }
  return x;
}

/// Walkers about nodes drawn by their density.
Eigen::MatrixXd walkers_of(const TensorSpline& spline, double least, unsigned seed) {
  std::mt19937_64 random(seed);
  const auto uniform = [&] { return static_cast<double>(random() >> 11U) * 0x1p-53; };
  std::vector<double> sums;
  for (const double deviance : spline.values())
    sums.push_back((sums.empty() ? 0 : sums.back()) + std::exp(-0.5 * std::max(0.0, deviance - least)));
  Eigen::MatrixXd walkers(kWalkers, spline.dimensions());
  for (Eigen::Index w = 0; w < kWalkers; ++w) {
    const auto drawn = std::upper_bound(sums.begin(), sums.end() - 1, uniform() * sums.back());
    walkers.row(w) = node_of(spline, drawn - sums.begin()).transpose();
    for (Eigen::Index k = 0; k < spline.dimensions(); ++k) {
      const Eigen::VectorXd& knots = spline.knots(k);
      const Eigen::Index last = knots.size() - 1;
      if (last == 0) continue;
      const double spacing = (knots[last] - knots[0]) / static_cast<double>(last);
      walkers(w, k) = std::clamp(walkers(w, k) + (uniform() - 0.5) * spacing, knots[0], knots[last]);
    }
  }
  return walkers;
}

}  // namespace

std::vector<Axis> in_own_coordinates(std::vector<Axis> axes) {
  for (Axis& axis : axes)
    if (const Parameter* const found = find_parameter(axis.name))
      if (found->material && axis.name != "poisson") axis.logarithmic = axis.values.front() > 0;
  return axes;
}

double coordinate_of(const Axis& axis, double value) { return axis.logarithmic ? std::log(value) : value; }
double value_of(const Axis& axis, double coordinate) {
  const double value = axis.logarithmic ? std::exp(coordinate) : coordinate;
  return std::clamp(value, axis.values.front(), axis.values.back());
}

std::vector<double> Posterior::values() const {
  std::vector<double> values;
  for (std::size_t k = 0; k < axes.size(); ++k)
    values.push_back(value_of(axes[k], estimate[static_cast<Eigen::Index>(k)]));
  return values;
}

double Posterior::quantile(std::size_t k, double share) const {
  Eigen::VectorXd column = samples.col(static_cast<Eigen::Index>(k));
  const auto at = static_cast<Eigen::Index>(std::lround(share * static_cast<double>(column.size() - 1)));
  std::nth_element(column.data(), column.data() + at, column.data() + column.size());
  return column[at];
}

namespace {

/// The deviance over that of the likeliest point. Far from what is likely the values do not matter, and a
/// spline through them would swing about.
TensorSpline spline_of(const std::vector<Axis>& axes, const Eigen::VectorXd& deviance) {
  const double lowest = deviance.minCoeff();
  const Eigen::VectorXd above = (deviance.array() - lowest).matrix();
  const Eigen::VectorXd bent = above.unaryExpr([](double rise) {
    if (!std::isfinite(rise)) return 2 * kFarthest;
    return rise < kFarthest ? rise : kFarthest * (2 - kFarthest / rise);  // slope 1 at the joint
  });
  return {knots_of(axes), bent};
}

/// Least values at the ends of each axis of a spline, over `least`.
Eigen::ArrayX2d ends_of(const TensorSpline& spline, double least) {
  Eigen::ArrayX2d ends = Eigen::ArrayX2d::Constant(spline.dimensions(), 2, INFINITY);
  for (Eigen::Index i = 0; i < spline.values().size(); ++i) {
    const Eigen::VectorXd node = node_of(spline, i);
    for (Eigen::Index k = 0; k < spline.dimensions(); ++k) {
      const Eigen::VectorXd& knots = spline.knots(k);
      for (const auto& [side, end] : {std::pair(0, knots[0]), {1, knots[knots.size() - 1]}})
        if (node[k] == end) ends(k, side) = std::min(ends(k, side), spline.values()[i]);
    }
  }
  return (ends - least).max(0);
}

/// The part of an axis between the neighbours of one of its knots.
std::array<double, 2> cells_about(const Eigen::VectorXd& knots, double knot) {
  const auto at = std::find(knots.begin(), knots.end(), knot) - knots.begin();
  return {knots[std::max<Eigen::Index>(at - 1, 0)], knots[std::min<Eigen::Index>(at + 1, knots.size() - 1)]};
}

}  // namespace

Posterior explore_posterior(const std::vector<Axis>& axes, const Eigen::VectorXd& deviance, unsigned seed) {
  const TensorSpline spline = spline_of(axes, deviance);
  Posterior posterior{axes, {}, {}, {}};
  Eigen::Index best;
  spline.values().minCoeff(&best);
  posterior.estimate = node_of(spline, best);
  double least = spline.minimize(posterior.estimate);
  std::vector<Eigen::Index> free;  // an axis of one value is no direction
  for (Eigen::Index k = 0; k < spline.dimensions(); ++k)
    if (spline.knots(k).size() > 1) free.push_back(k);
  if (free.empty()) {
    posterior.samples = posterior.estimate.transpose();
    posterior.ends = ends_of(spline, least);
    return posterior;
  }
  Eigen::VectorXd x = posterior.estimate;
  const auto log_density = [&](const Eigen::VectorXd& moved) {
    for (std::size_t i = 0; i < free.size(); ++i) {
      const Eigen::Index k = free[i];
      const Eigen::VectorXd& knots = spline.knots(k);
      x[k] = moved[static_cast<Eigen::Index>(i)];
      if (x[k] < knots[0] || x[k] > knots[knots.size() - 1]) return -std::numeric_limits<double>::infinity();
    }
    return -0.5 * spline(x);
  };
  const Eigen::MatrixXd start = walkers_of(spline, least, seed);
  const Eigen::MatrixXd draws = sample_ensemble(log_density, start(Eigen::all, free), {200, 800, 4, seed});
  posterior.samples = posterior.estimate.transpose().replicate(draws.rows(), 1);
  posterior.samples(Eigen::all, free) = draws;
  // A draw may have found a lower valley than the nodes.
  Eigen::Index lowest_draw = 0;
  double lowest_there = std::numeric_limits<double>::infinity();
  for (Eigen::Index i = 0; i < draws.rows(); i += 8) {
    const double there = spline(posterior.samples.row(i).transpose());
    if (there < lowest_there) {
      lowest_there = there;
      lowest_draw = i;
    }
  }
  Eigen::VectorXd other = posterior.samples.row(lowest_draw).transpose();
  if (const double there = spline.minimize(other); there < least) {
    least = there;
    posterior.estimate = other;
  }
  posterior.ends = ends_of(spline, least);
  return posterior;
}

Posterior explore_at_points(const std::vector<Axis>& axes, const Eigen::VectorXd& deviance, unsigned seed) {
  const TensorSpline points = spline_of(axes, deviance);
  Eigen::Index likeliest;
  const double least = points.values().minCoeff(&likeliest);
  Posterior posterior{axes, node_of(points, likeliest), {}, ends_of(points, least)};
  std::vector<double> sums;
  for (Eigen::Index i = 0; i < points.values().size(); ++i) {
    const Eigen::VectorXd node = node_of(points, i);
    double mass = std::exp(-0.5 * points.values()[i]);
    for (Eigen::Index k = 0; k < points.dimensions(); ++k) {
      const auto [low, high] = cells_about(points.knots(k), node[k]);
      if (high > low) mass *= high - low;
    }
    sums.push_back((sums.empty() ? 0 : sums.back()) + mass);
  }
  std::mt19937_64 random(seed);
  const auto uniform = [&] { return static_cast<double>(random() >> 11U) * 0x1p-53; };
  posterior.samples.resize(posterior_draws, points.dimensions());
  for (Eigen::Index draw = 0; draw < posterior_draws; ++draw) {
    const auto drawn = std::upper_bound(sums.begin(), sums.end() - 1, uniform() * sums.back());
    const Eigen::VectorXd node = node_of(points, drawn - sums.begin());
    for (Eigen::Index k = 0; k < points.dimensions(); ++k) {
      const auto [low, high] = cells_about(points.knots(k), node[k]);
      posterior.samples(draw, k) = low + uniform() * (high - low);
    }
  }
  return posterior;
}

Posterior mixture(const Posterior& posterior, Posterior other, double share) {
  for (Eigen::Index i = 0; i < other.samples.rows(); ++i) {
    const bool kept =
        std::floor(share * static_cast<double>(i + 1)) > std::floor(share * static_cast<double>(i));
    if (!kept) other.samples.row(i) = posterior.samples.row(i % posterior.samples.rows());
  }
  other.ends = -2 * ((1 - share) * (-0.5 * posterior.ends).exp() + share * (-0.5 * other.ends).exp()).log();
  return other;
}

Posterior up_to_neighbours(Posterior posterior, const std::vector<Axis>& searched, unsigned seed) {
  std::mt19937_64 random(seed);
  const auto uniform = [&] { return static_cast<double>(random() >> 11U) * 0x1p-53; };
  posterior.reach.resize(static_cast<Eigen::Index>(searched.size()), 2);
  for (std::size_t k = 0; k < searched.size(); ++k) {
    const auto column = static_cast<Eigen::Index>(k);
    const Eigen::VectorXd knots = knots_of(searched)[k];
    // A value of the search itself, up to rounding of a logarithm and back, is between two others.
    const double rounding = 1e-9 * (knots[knots.size() - 1] - knots[0]);
    const auto below = [&](double x) {
      const auto first = std::lower_bound(knots.begin(), knots.end(), x - rounding);
      return first == knots.begin() ? *first : *(first - 1);
    };
    const auto above = [&](double x) {
      const auto next = std::upper_bound(knots.begin(), knots.end(), x + rounding);
      return next == knots.end() ? *(next - 1) : *next;
    };
    const double mode = posterior.estimate[column];
    const double low = below(std::min(mode, posterior.quantile(k, 0.025))),
                 high = above(std::max(mode, posterior.quantile(k, 0.975)));
    posterior.reach.row(column) << low, high;
    for (double& draw : posterior.samples.col(column)) {
      const double from = below(draw), to = above(draw);
      if (to > from) draw = from + uniform() * (to - from);
    }
    Axis& axis = posterior.axes[k];
    const auto draws = posterior.samples.col(column);
    const auto value_at = [&](double x) { return axis.logarithmic ? std::exp(x) : x; };
    axis.values.front() = std::min(axis.values.front(), value_at(std::min(low, draws.minCoeff())));
    axis.values.back() = std::max(axis.values.back(), value_at(std::max(high, draws.maxCoeff())));
  }
  return posterior;
}

}  // namespace flash::sysid
