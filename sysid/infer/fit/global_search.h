#pragma once
#include <Eigen/Core>
#include <functional>
#include <vector>

namespace flash::sysid {

struct GlobalSearchSettings {
  int generations = 0;  ///< batches evaluated; 0: no search
  int population = 16;  ///< points of a generation
  unsigned seed = 1;
};

/// Costs of the points of one generation, in order; where there is none, infinite or not a number.
using BatchCost = std::function<std::vector<double>(const std::vector<Eigen::VectorXd>& points)>;

/// The best point of one generation.
struct Generation {
  Eigen::VectorXd point;
  double cost = 0;        ///< infinite where no point of the generation has one
  bool improved = false;  ///< below every generation before
};

/// Least cost over the box [low, high], a call of `cost` a generation. The first half of the generations is
/// `start` and a Latin hypercube: a swarm from few points is soon drawn to the wrong basin. From the best of
/// these a particle swarm goes on, with constriction coefficient (Clerc and Kennedy 2002) and neighbours on a
/// ring: pagmo's pso_gen. Returns the generations in order, the last that improved being the answer, never
/// worse than `start`; the same seed gives the same ones. `report` is called after each.
std::vector<Generation> global_search(const BatchCost& cost, const Eigen::VectorXd& low,
                                      const Eigen::VectorXd& high, const Eigen::VectorXd& start,
                                      const GlobalSearchSettings& settings,
                                      const std::function<void(const Generation&)>& report = {});

}  // namespace flash::sysid
