// Whether posteriors on ridges are right, straight and bent ones, against exact answers: quantiles, how often
// intervals hold the truth, and at how many points the likelihood is asked for.
//   ridge_study [WAY [DRAWS [FIRST_SEED [DIMENSIONS]]]]
// WAY is `exact` (the formula), `grid` (refined grids with splines), `importance` (importance sampling),
// `surrogate` (of a surrogate, as sampled_look has it) or empty: all. A row is of DRAWS truths and data, by
// default 200, of DIMENSIONS parameters, by default of 2 to 6.
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "data/machine/parallel.h"
#include "sysid/infer/adaptive_design.h"
#include "sysid/infer/importance_sampling.h"
#include "sysid/infer/sampled_look.h"
#include "tests/sysid/infer/ridge.h"

namespace flash::sysid {
namespace {

constexpr std::array<double, 3> kShares = {0.025, 0.5, 0.975};

struct Found {
  Eigen::MatrixX3d quantiles;  ///< of each coordinate, at kShares
  int likelihoods = 0;
  std::optional<double> effective_size = {};
};

/// As `narrow` does it, on the box from 0 to 1, with the ridge in place of motions.
Found by_grids(const Ridge& ridge, unsigned seed) {
  constexpr int kRounds = 12;
  const std::vector<Axis> searched(static_cast<std::size_t>(ridge.dimensions()),
                                   {.name = "x", .values = {0, 1}});
  Extent extent = extent_of(searched);
  Found found;
  std::optional<Posterior> posterior;
  for (int round = 0; round < kRounds; ++round) {
    const std::vector<Axis> axes = axes_over(extent, searched);
    const std::vector<std::vector<double>> points = cartesian_product(axes);
    Eigen::VectorXd deviance(static_cast<Eigen::Index>(points.size()));
    for (std::size_t i = 0; i < points.size(); ++i)
      deviance[static_cast<Eigen::Index>(i)] =
          -2 * ridge.log_density(Eigen::VectorXd::Map(points[i].data(), ridge.dimensions()));
    found.likelihoods += static_cast<int>(points.size());
    posterior = explore_posterior(axes, deviance, seed);
    const Extent next = next_extent(extent, *posterior, searched);
    if (next == extent) break;
    extent = next;
  }
  found.quantiles.resize(ridge.dimensions(), 3);
  for (std::size_t k = 0; k < searched.size(); ++k)
    for (std::size_t s = 0; s < kShares.size(); ++s)
      found.quantiles(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(s)) =
          posterior->quantile(k, kShares[s]);
  return found;
}

Found by_importance(const Ridge& ridge, unsigned seed) {
  const Eigen::Index d = ridge.dimensions();
  const WeightedDraws draws = sample_by_importance(
      [&](const Eigen::MatrixXd& points) {
        Eigen::VectorXd logs(points.rows());
        for (Eigen::Index i = 0; i < points.rows(); ++i)
          logs[i] = ridge.log_density(points.row(i).transpose());
        return logs;
      },
      Eigen::VectorXd::Zero(d), Eigen::VectorXd::Ones(d), {.seed = seed});
  Found found{Eigen::MatrixX3d(d, 3), static_cast<int>(draws.points.rows()), draws.effective_size};
  for (Eigen::Index k = 0; k < d; ++k)
    for (std::size_t s = 0; s < kShares.size(); ++s)
      found.quantiles(k, static_cast<Eigen::Index>(s)) = draws.quantile(k, kShares[s]);
  return found;
}

/// As sampled_look does it, on the box from 0 to 1.
Found by_surrogate(const Ridge& ridge, unsigned) {
  const Eigen::Index d = ridge.dimensions();
  const std::vector<Axis> searched(static_cast<std::size_t>(d), {.name = "x", .values = {0, 1}});
  const auto density = [&](const std::vector<double>&, const Extent&) -> LogDensities {
    return [&](const Eigen::MatrixXd& points) -> Eigen::VectorXd {
      Eigen::VectorXd logs(points.rows());
      for (Eigen::Index i = 0; i < points.rows(); ++i) logs[i] = ridge.log_density(points.row(i).transpose());
      return logs;
    };
  };
  const Sampled sampled = sample_extents(density, extent_of(searched),
                                         std::vector<double>(static_cast<std::size_t>(d), 0.5), searched);
  Found found{Eigen::MatrixX3d(d, 3), sampled.asked, sampled.of.draws.effective_size};
  for (Eigen::Index k = 0; k < d; ++k)
    for (std::size_t s = 0; s < kShares.size(); ++s)
      found.quantiles(k, static_cast<Eigen::Index>(s)) =
          sampled.posterior.quantile(static_cast<std::size_t>(k), kShares[s]);
  return found;
}

/// How often exact intervals hold these truths, by chance.
Found by_formula(const Ridge& ridge, unsigned) {
  Found found{Eigen::MatrixX3d(ridge.dimensions(), 3)};
  for (Eigen::Index k = 0; k < ridge.dimensions(); ++k)
    for (std::size_t s = 0; s < kShares.size(); ++s)
      found.quantiles(k, static_cast<Eigen::Index>(s)) = ridge.quantile(k, kShares[s]);
  return found;
}

struct Way {
  const char* name;
  Found (*find)(const Ridge& ridge, unsigned seed);
};

constexpr Way kWays[] = {
    {"exact", by_formula}, {"grid", by_grids}, {"importance", by_importance}, {"surrogate", by_surrogate}};

/// Bends and stretches.
constexpr std::array<std::array<double, 2>, 3> kShapes = {{{0, 0}, {0.5, 0}, {0, 0.4}}};

struct Trial {
  Eigen::VectorXd truth;
  Ridge posterior;
  Found found;
};

/// A truth in the box, data that are off by a draw of the ridge, and the posterior of them, which is the same
/// ridge: the prior is flat.
Trial drawn_trial(Ridge ridge, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> place(0.3, 0.6);  // a bent ridge ends above
  Trial trial;
  trial.truth.resize(ridge.dimensions());
  for (double& each : trial.truth) each = place(random);
  ridge.centre.setZero();
  const Eigen::VectorXd off = ridge.draw(random);
  trial.posterior = ridge;
  trial.posterior.centre = trial.truth - off;
  return trial;
}

std::vector<Trial> tried(const Way& way, const Ridge& ridge, int draws, unsigned first_seed) {
  std::vector<Trial> trials(static_cast<std::size_t>(draws));
  data::for_each_in_parallel(trials.size(), 0, [&](std::size_t i) {
    const unsigned seed = first_seed + static_cast<unsigned>(i);
    trials[i] = drawn_trial(ridge, seed);
    trials[i].found = way.find(trials[i].posterior, seed);
  });
  return trials;
}

/// Errors of quantiles in standard deviations, at each of kShares.
struct Errors {
  Eigen::Array3d mean = Eigen::Array3d::Zero(), largest = Eigen::Array3d::Zero();
};

Errors errors_of(const std::vector<Trial>& trials, const Ridge& ridge) {
  Errors errors;
  const Eigen::Index d = ridge.dimensions();
  Eigen::MatrixX3d exact(d, 3);
  Ridge about_zero = ridge;
  about_zero.centre.setZero();
  for (Eigen::Index k = 0; k < d; ++k)
    for (Eigen::Index s = 0; s < 3; ++s)
      exact(k, s) = about_zero.quantile(k, kShares[static_cast<std::size_t>(s)]);
  for (const Trial& trial : trials)
    for (Eigen::Index k = 0; k < d; ++k) {
      const Eigen::Array3d error =
          (trial.found.quantiles.row(k) - exact.row(k)).array().transpose() - trial.posterior.centre[k];
      const Eigen::Array3d in_deviations = error.abs() / ridge.deviation(k);
      errors.mean += in_deviations / static_cast<double>(d * static_cast<Eigen::Index>(trials.size()));
      errors.largest = errors.largest.max(in_deviations);
    }
  return errors;
}

double share_inside(const std::vector<Trial>& trials) {
  Eigen::Index inside = 0, all = 0;
  for (const Trial& trial : trials) {
    const Eigen::MatrixX3d& quantiles = trial.found.quantiles;
    inside +=
        (trial.truth.array() >= quantiles.col(0).array() && trial.truth.array() <= quantiles.col(2).array())
            .count();
    all += trial.truth.size();
  }
  return static_cast<double>(inside) / static_cast<double>(all);
}

std::string effective_sizes(const std::vector<Trial>& trials) {
  double sum = 0, least = INFINITY;
  for (const Trial& trial : trials) {
    if (!trial.found.effective_size) return "- | -";
    sum += *trial.found.effective_size;
    least = std::min(least, *trial.found.effective_size);
  }
  return std::to_string(std::lround(sum / static_cast<double>(trials.size()))) + " | " +
         std::to_string(std::lround(least));
}

void print_head() {
  std::printf(
      "| way | ridge | correlation | parameters | draws | .025, mean sd | .5 | .975 | largest sd | "
      "inside 95 %% | likelihoods | effective size | least | seconds |\n");
  std::printf("|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
}

const char* shape_of(const Ridge& ridge) {
  return ridge.bend > 0 ? "bent" : ridge.stretch > 0 ? "stretched" : "straight";
}

void study(const Way& way, const Ridge& ridge, int draws, unsigned first_seed) {
  const auto start = std::chrono::steady_clock::now();
  const std::vector<Trial> trials = tried(way, ridge, draws, first_seed);
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() / draws;
  double likelihoods = 0;
  for (const Trial& trial : trials) likelihoods += trial.found.likelihoods;
  const Errors errors = errors_of(trials, ridge);
  std::printf("| %s | %s | %.2f | %d | %d | %.3f | %.3f | %.3f | %.2f | %.1f %% | %.0f | %s | %.3f |\n",
              way.name, shape_of(ridge), ridge.correlation, static_cast<int>(ridge.dimensions()), draws,
              errors.mean[0], errors.mean[1], errors.mean[2], errors.largest.maxCoeff(),
              100 * share_inside(trials), likelihoods / draws, effective_sizes(trials).c_str(), seconds);
  std::fflush(stdout);
}

}  // namespace
}  // namespace flash::sysid

int main(int argc, char** argv) {
  const std::string only = argc > 1 ? argv[1] : "";
  const int draws = argc > 2 ? std::atoi(argv[2]) : 200;
  const unsigned first_seed = argc > 3 ? static_cast<unsigned>(std::atoi(argv[3])) : 1;
  const int dimensions = argc > 4 ? std::atoi(argv[4]) : 0;
  flash::sysid::print_head();
  for (const flash::sysid::Way& way : flash::sysid::kWays) {
    if (!only.empty() && only != way.name) continue;
    for (int d = 2; d <= 6; ++d)
      for (const auto& [bend, stretch] : flash::sysid::kShapes)
        for (const double correlation : {0.9, 0.95, 0.99})
          if (dimensions == 0 || dimensions == d)
            flash::sysid::study(way, {Eigen::VectorXd::Zero(d), 0.03, correlation, bend, stretch}, draws,
                                first_seed);
  }
}
