#include "sysid/infer/fit/global_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <pagmo/algorithms/pso_gen.hpp>
#include <pagmo/batch_evaluators/member_bfe.hpp>
#include <pagmo/bfe.hpp>
#include <pagmo/population.hpp>
#include <pagmo/problem.hpp>
#include <random>

namespace flash::sysid {
namespace {

using Points = std::vector<Eigen::VectorXd>;

/// Evaluates generations and keeps the best of each.
class Generations {
 public:
  Generations(const BatchCost& cost, const std::function<void(const Generation&)>& report)
      : cost_(cost), report_(report) {}

  /// Costs of one generation; what is not finite comes back as the largest number, which a swarm can compare.
  std::vector<double> evaluate(const Points& points) {
    std::vector<double> costs = cost_(points);
    for (double& cost : costs)
      if (!std::isfinite(cost)) cost = kNone;
    const auto least = std::min_element(costs.begin(), costs.end());
    const bool improved = *least < lowest_;
    lowest_ = std::min(lowest_, *least);
    found.push_back({points[static_cast<std::size_t>(least - costs.begin())],
                     *least < kNone ? *least : std::numeric_limits<double>::infinity(), improved});
    if (report_) report_(found.back());
    return costs;
  }

  std::vector<Generation> found;

 private:
  static constexpr double kNone = std::numeric_limits<double>::max();
  const BatchCost& cost_;
  const std::function<void(const Generation&)>& report_;
  double lowest_ = kNone;
};

/// The box and its cost as pagmo's user-defined problem; copied by pagmo, so it only refers.
struct BoxProblem {
  const Eigen::VectorXd* low = nullptr;
  const Eigen::VectorXd* high = nullptr;
  Generations* generations = nullptr;

  std::pair<pagmo::vector_double, pagmo::vector_double> get_bounds() const {
    return {{low->begin(), low->end()}, {high->begin(), high->end()}};
  }
  pagmo::vector_double batch_fitness(const pagmo::vector_double& all) const {
    const Eigen::Index size = low->size();
    Points points;
    for (std::size_t at = 0; at < all.size(); at += static_cast<std::size_t>(size))
      points.emplace_back(Eigen::Map<const Eigen::VectorXd>(all.data() + at, size));
    return generations->evaluate(points);
  }
  pagmo::vector_double fitness(const pagmo::vector_double& x) const { return batch_fitness(x); }
};

/// `start`, then one point in each of count - 1 slices of every axis.
Points spread_out(const Eigen::VectorXd& low, const Eigen::VectorXd& high, const Eigen::VectorXd& start,
                  int count, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> within(0, 1);
  Points points(static_cast<std::size_t>(count), start.cwiseMax(low).cwiseMin(high));
  std::vector<int> slices(static_cast<std::size_t>(count - 1));
  std::iota(slices.begin(), slices.end(), 0);
  for (Eigen::Index k = 0; k < low.size(); ++k) {
    std::shuffle(slices.begin(), slices.end(), random);
    for (std::size_t i = 0; i < slices.size(); ++i) {
      const double share = (slices[i] + within(random)) / (count - 1);
      points[i + 1][k] = std::clamp(low[k] + share * (high[k] - low[k]), low[k], high[k]);
    }
  }
  return points;
}

}  // namespace

std::vector<Generation> global_search(const BatchCost& cost, const Eigen::VectorXd& low,
                                      const Eigen::VectorXd& high, const Eigen::VectorXd& start,
                                      const GlobalSearchSettings& settings,
                                      const std::function<void(const Generation&)>& report) {
  if (settings.generations <= 0) return {};
  Generations generations(cost, report);
  const int population = std::max(settings.population, 2), drawn = std::max(settings.generations / 2, 1);
  const Points points = spread_out(low, high, start, drawn * population, settings.seed);
  std::vector<double> costs;
  for (auto at = points.begin(); at != points.end(); at += population) {
    const std::vector<double> more = generations.evaluate({at, at + population});
    costs.insert(costs.end(), more.begin(), more.end());
  }
  if (settings.generations == drawn) return generations.found;

  std::vector<std::size_t> best(points.size());
  std::iota(best.begin(), best.end(), std::size_t{0});
  std::stable_sort(best.begin(), best.end(),
                   [&](std::size_t i, std::size_t j) { return costs[i] < costs[j]; });
  best.resize(static_cast<std::size_t>(population));
  std::sort(best.begin(), best.end());  // as drawn: neighbours on the ring are not alike in cost
  pagmo::population swarm(pagmo::problem(BoxProblem{&low, &high, &generations}), 0, settings.seed);
  for (const std::size_t i : best) swarm.push_back({points[i].begin(), points[i].end()}, {costs[i]});
  constexpr double kInertia = 0.7298, kOwn = 2.05, kNeighbours = 2.05, kFastest = 0.5;
  constexpr unsigned kConstriction = 5, kRing = 2, kNeighbourCount = 2;
  pagmo::pso_gen algorithm(static_cast<unsigned>(settings.generations - drawn), kInertia, kOwn, kNeighbours,
                           kFastest, kConstriction, kRing, kNeighbourCount);
  algorithm.set_seed(settings.seed);
  algorithm.set_bfe(pagmo::bfe(pagmo::member_bfe()));
  algorithm.evolve(std::move(swarm));
  return generations.found;
}

}  // namespace flash::sysid
