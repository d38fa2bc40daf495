#include "sysid/design/plan.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <cmath>

#include "data/error.h"
#include "sysid/emulate/sensitivity.h"

namespace flash::sysid {

std::vector<double> spread_of_ranges(const std::vector<Axis>& axes) {
  std::vector<double> spreads;
  for (const Axis& axis : axes) {
    const double low = axis.values.front(), high = axis.values.back();
    spreads.push_back((axis.logarithmic ? std::log(high / low) : high - low) / std::sqrt(12.0));
  }
  return spreads;
}

PlannedExperiment plan_experiment(const std::string& name, const std::vector<Replay>& replays,
                                  const PlanSettings& settings) {
  const Sensitivity sensitivity = measure_sensitivity(replays, settings.grid, settings.at);
  if (sensitivity.places.empty()) throw data::InputError(name + ": the simulation diverges");
  Eigen::MatrixXd rates = sensitivity.parameters;
  if (sensitivity.nuisance.cols() > 0)
    rates -= sensitivity.nuisance * sensitivity.nuisance.colPivHouseholderQr().solve(sensitivity.parameters);
  const std::vector<double> ranges = spread_of_ranges(settings.grid.axes);
  Eigen::MatrixXd information =
      settings.keyframes / (settings.error * settings.error) * (rates.transpose() * rates);
  for (std::size_t k = 0; k < ranges.size(); ++k)
    information(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(k)) += 1 / (ranges[k] * ranges[k]);
  const Eigen::MatrixXd covariance =
      information.ldlt().solve(Eigen::MatrixXd::Identity(information.rows(), information.cols()));
  PlannedExperiment planned{name, {}};
  for (std::size_t k = 0; k < ranges.size(); ++k)
    planned.spread.push_back(
        std::sqrt(covariance(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(k))));
  return planned;
}

}  // namespace flash::sysid
