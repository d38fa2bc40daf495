#include "sysid/infer/sampled_look.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "sysid/infer/agreed_numbers.h"

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

/// The least deviance of draws near the ends of each coordinate, over that of all.
Eigen::ArrayX2d ends_of(const WeightedDraws& draws, const Eigen::VectorXd& low, const Eigen::VectorXd& high) {
  // Of the box: draws so near to an end say how likely it is. Chosen: not varied.
  constexpr double kNear = 0.02;
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

}  // namespace

Posterior posterior_of(const std::vector<Axis>& axes, const WeightedDraws& draws) {
  // Of the density under which the mean is the estimate: near the mode, and no single draw. Chosen: not
  // varied.
  constexpr double kPower = 8;
  const std::vector<Eigen::Index> searched = searched_of(axes);
  const Eigen::VectorXd low = corner_of(axes, false), high = corner_of(axes, true);
  Posterior posterior{axes, low, low.transpose().replicate(posterior_draws, 1),
                      Eigen::ArrayX2d::Zero(low.size(), 2)};
  posterior.estimate(searched) = draws.points.transpose() * weights_of_power(draws, kPower);
  posterior.samples(Eigen::all, searched) = draws.resampled(posterior_draws);
  posterior.ends(searched, Eigen::all) = ends_of(draws, low(searched), high(searched));
  return posterior;
}

Sampled sample_extents(const DensityAbout& density, const Extent& start, const std::vector<double>& at,
                       const std::vector<Axis>& axes, const WeightedDraws* before) {
  constexpr int kRounds = 12;  // Of a look. Work: a cap where the extent does not settle.
  // Agreement in a round before the last. Work: the last one has what is asked.
  constexpr double kRough = 0.9;
  constexpr double kRoughDraws = 700;  // Effective size there, of a surrogate. Work: likewise.
  constexpr double kRoughSize = 100;   // And without one. Work: likewise.
  const std::vector<Eigen::Index> searched = searched_of(axes);
  Extent extent = start;
  std::vector<double> values = at;
  Sampled sampled;
  WeightedDraws rough_draws;
  for (int round = 1;; ++round) {
    const LogDensities here = density(values, extent);
    const std::vector<Axis> box = axes_over(extent, axes);
    const Eigen::VectorXd low = corner_of(box, false)(searched), high = corner_of(box, true)(searched);
    AskedPoints asked;
    SurrogateSettings settings;
    settings.before = before;
    settings.agreement = kRough;
    settings.enough = kRoughDraws;
    settings.enough_without = kRoughSize;
    sampled.of = sample_by_surrogate(here, low, high, asked, settings);
    sampled.posterior = posterior_of(box, sampled.of.draws);
    Extent next = next_extent(extent, sampled.posterior, axes);
    const auto keeps = [&] { return next == extent || round == kRounds; };
    if (keeps()) {
      rough_draws = std::move(sampled.of.draws);
      settings = {};
      settings.before = &rough_draws;
      sampled.of = sample_by_surrogate(here, low, high, asked, settings);
      sampled.posterior = posterior_of(box, sampled.of.draws);
      next = next_extent(extent, sampled.posterior, axes);  // more draws may find an end likely
    }
    sampled.asked += static_cast<int>(asked.size());
    if (keeps()) return sampled;
    values = sampled.posterior.values();
    extent = next;
    rough_draws = std::move(sampled.of.draws);
    before = &rough_draws;
  }
}

Look sampled_look(const Emulator& emulator, const Extent& start, const std::vector<double>& at,
                  const std::vector<Axis>& axes, const GridSettings& grid,
                  std::optional<double> repeatability, const std::vector<KnownError>& errors,
                  const TellWork& told, const WeightedDraws* before) {
  const std::vector<Eigen::Index> searched = searched_of(axes);
  if (searched.empty()) return narrow(emulator, start, at, axes, grid, repeatability, errors, told);
  std::vector<Replay> replays;
  for (const ModelledReplay& model : emulator.models) replays.push_back(model.replay);
  std::optional<MotionLikelihood> likelihood;
  int asked = 0, allowed = most_scores(axes);
  const auto density = [&](const std::vector<double>& values, const Extent& extent) -> LogDensities {
    likelihood.emplace(replays, motions_at(emulator, values, emulator.share), grid.score, repeatability,
                       errors, rates_at(emulator, values, extent, axes), emulator.first);
    return [&](const Eigen::MatrixXd& draws) -> Eigen::VectorXd {
      std::vector<std::vector<double>> points(static_cast<std::size_t>(draws.rows()));
      for (std::size_t i = 0; i < points.size(); ++i) {
        for (const Axis& axis : axes) points[i].push_back(axis.values.front());
        for (std::size_t j = 0; j < searched.size(); ++j) {
          const auto k = static_cast<std::size_t>(searched[j]);
          points[i][k] = value_of(axes[k], draws(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)));
        }
      }
      asked += static_cast<int>(points.size());
      if (told && asked > allowed) told({}, {0, allowed - asked});
      allowed = std::max(allowed, asked);
      return -0.5 * deviance_at(emulator, points, *likelihood, grid, told);
    };
  };
  Sampled sampled = sample_extents(density, start, at, axes, before);
  if (told) told({}, {0, allowed - asked});
  return {std::move(*likelihood), std::move(sampled.posterior), std::move(sampled.of.draws)};
}

}  // namespace flash::sysid
