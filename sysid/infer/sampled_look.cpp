#include "sysid/infer/sampled_look.h"

#include <algorithm>
#include <cmath>

namespace flash::sysid {
namespace {

std::vector<Eigen::Index> searched_of(const std::vector<Axis>& axes) {
  std::vector<Eigen::Index> searched;
  for (std::size_t k = 0; k < axes.size(); ++k)
    if (axes[k].values.size() > 1) searched.push_back(static_cast<Eigen::Index>(k));
  return searched;
}

/// Coordinates of the first or of the last values.
Eigen::VectorXd corner_of(const std::vector<Axis>& axes, bool last) {
  Eigen::VectorXd corner(static_cast<Eigen::Index>(axes.size()));
  for (std::size_t k = 0; k < axes.size(); ++k)
    corner[static_cast<Eigen::Index>(k)] =
        coordinate_of(axes[k], last ? axes[k].values.back() : axes[k].values.front());
  return corner;
}

/// The weights under a power of the density above 1.
Eigen::VectorXd sharpened(const WeightedDraws& draws, double power) {
  const double highest = draws.log_densities.maxCoeff();
  Eigen::VectorXd weights = draws.weights;
  for (Eigen::Index i = 0; i < weights.size(); ++i)
    weights[i] *= std::exp((power - 1) * (draws.log_densities[i] - highest));
  return weights / weights.sum();
}

/// The least deviance of draws near the ends of each coordinate, over that of all.
Eigen::ArrayX2d ends_of(const WeightedDraws& draws, const Eigen::VectorXd& low, const Eigen::VectorXd& high) {
  constexpr double kNear = 0.02;  // of the box
  Eigen::ArrayX2d ends = Eigen::ArrayX2d::Constant(low.size(), 2, INFINITY);
  const double highest = draws.log_densities.maxCoeff();
  for (Eigen::Index i = 0; i < draws.points.rows(); ++i)
    for (Eigen::Index k = 0; k < low.size(); ++k) {
      const double place = (draws.points(i, k) - low[k]) / (high[k] - low[k]);
      const double deviance = 2 * (highest - draws.log_densities[i]);
      if (place < kNear) ends(k, 0) = std::min(ends(k, 0), deviance);
      if (place > 1 - kNear) ends(k, 1) = std::min(ends(k, 1), deviance);
    }
  return ends;
}

/// Draws of the likelihood over the box of `axes`.
WeightedDraws drawn(const Emulator& emulator, const std::vector<Axis>& axes,
                    const MotionLikelihood& likelihood, const GridSettings& grid,
                    const ImportanceSettings& settings, const TellWork& told) {
  const std::vector<Eigen::Index> searched = searched_of(axes);
  const Eigen::VectorXd low = corner_of(axes, false), high = corner_of(axes, true);
  const auto log_densities = [&](const Eigen::MatrixXd& draws) -> Eigen::VectorXd {
    std::vector<std::vector<double>> points(static_cast<std::size_t>(draws.rows()));
    for (std::size_t i = 0; i < points.size(); ++i) {
      for (const Axis& axis : axes) points[i].push_back(axis.values.front());
      for (std::size_t j = 0; j < searched.size(); ++j) {
        const auto k = static_cast<std::size_t>(searched[j]);
        points[i][k] = value_of(axes[k], draws(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)));
      }
    }
    return -0.5 * deviance_at(emulator, points, likelihood, grid, told);
  };
  return sample_by_importance(log_densities, low(searched), high(searched), settings);
}

}  // namespace

Posterior posterior_of(const std::vector<Axis>& axes, const WeightedDraws& draws) {
  constexpr Eigen::Index kDraws = 12'800;
  constexpr double kPower = 8;
  const std::vector<Eigen::Index> searched = searched_of(axes);
  const Eigen::VectorXd low = corner_of(axes, false), high = corner_of(axes, true);
  Posterior posterior{axes, low, low.transpose().replicate(kDraws, 1), Eigen::ArrayX2d::Zero(low.size(), 2)};
  posterior.estimate(searched) = draws.points.transpose() * sharpened(draws, kPower);
  posterior.samples(Eigen::all, searched) = draws.resampled(kDraws);
  posterior.ends(searched, Eigen::all) = ends_of(draws, low(searched), high(searched));
  return posterior;
}

Look sampled_look(const Emulator& emulator, const Extent& start, const std::vector<double>& at,
                  const std::vector<Axis>& axes, const GridSettings& grid,
                  std::optional<double> repeatability, const std::vector<KnownError>& errors,
                  const TellWork& told) {
  constexpr int kRounds = 12;
  constexpr double kRough = 100;  // effective size of a round before the last
  if (searched_of(axes).empty()) return narrow(emulator, start, at, axes, grid, repeatability, errors, told);
  std::vector<Replay> replays;
  for (const ModelledReplay& model : emulator.models) replays.push_back(model.replay);
  Extent extent = start;
  std::vector<double> values = at;
  for (int round = 1;; ++round) {
    MotionLikelihood likelihood(replays, motions_at(emulator, values, emulator.share), grid.score,
                                repeatability, errors, rates_at(emulator, values, extent, axes),
                                emulator.first);
    const std::vector<Axis> here = axes_over(extent, axes);
    const Posterior rough =
        posterior_of(here, drawn(emulator, here, likelihood, grid, {.enough = kRough}, told));
    const Extent next = next_extent(extent, rough, axes);
    if (next == extent || round == kRounds) {
      const WeightedDraws draws = drawn(emulator, here, likelihood, grid, {}, told);
      if (told) told({}, {0, most_scores(axes)});
      return {std::move(likelihood), posterior_of(here, draws), draws.effective_size};
    }
    values = rough.values();
    extent = next;
  }
}

}  // namespace flash::sysid
