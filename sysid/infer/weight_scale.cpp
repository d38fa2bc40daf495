#include "sysid/infer/weight_scale.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "sysid/infer/held.h"

namespace flash::sysid {

bool is_stiffness(const std::string& name) { return name == "young" || name == "bending"; }

double spread_of_scale(const GridSettings& grid, const std::vector<Replay>& replays) {
  for (const Replay& replay : replays) {
    if (!replay.recording.loads.empty()) return 0;
    for (const Observation& observation : replay.observations)
      if (observation.weight > 0 && observation.force) return 0;
  }
  for (const HeldParameter& held : held_parameters(grid, replays))
    if (held.name == "areal_density" || held.name == "density")
      return 0.5 * std::log(held.values[1] / held.values[0]);
  return 0;
}

Eigen::VectorXd scale_together(Posterior& posterior, const std::vector<std::size_t>& scaled, double spread,
                               const std::vector<Axis>& ranges, unsigned seed) {
  // Standard deviations that an axis takes in. Work: draws beyond have a chance of 6e-5.
  constexpr double kFar = 4;
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  const Eigen::VectorXd factors = Eigen::VectorXd::NullaryExpr(
      posterior.samples.rows(), [&] { return std::exp(spread * normal(random)); });
  for (const std::size_t k : scaled) {
    Axis& axis = posterior.axes[k];
    const double first = ranges[k].values.front(), last = ranges[k].values.back();
    axis.values.front() = std::max(first, axis.values.front() * std::exp(-kFar * spread));
    axis.values.back() = std::min(last, axis.values.back() * std::exp(kFar * spread));
    auto column = posterior.samples.col(static_cast<Eigen::Index>(k));
    for (Eigen::Index i = 0; i < column.size(); ++i) {
      const double value = axis.logarithmic ? std::exp(column[i]) : column[i];
      column[i] = coordinate_of(axis, std::clamp(factors[i] * value, first, last));
    }
  }
  return factors;
}

}  // namespace flash::sysid
