#include "sysid/infer/ensemble_sampler.h"

#include <cmath>
#include <random>

namespace flash::sysid {

Eigen::MatrixXd sample_ensemble(const std::function<double(const Eigen::VectorXd&)>& log_density,
                                const Eigen::MatrixXd& start, const EnsembleSettings& settings) {
  constexpr double kStretch = 2;  // Of the stretch moves. Work: a of Goodman and Weare 2010.
  const Eigen::Index walkers = start.rows(), half = walkers / 2;
  std::mt19937_64 random(settings.seed);
  // The distributions of the standard library differ between libraries.
  const auto uniform = [&] { return static_cast<double>(random() >> 11U) * 0x1p-53; };
  Eigen::MatrixXd places = start;
  Eigen::VectorXd logs(walkers), trial(start.cols());
  for (Eigen::Index i = 0; i < walkers; ++i) logs[i] = log_density(places.row(i).transpose());
  Eigen::MatrixXd draws(walkers * (settings.sweeps / settings.keep_every), start.cols());
  Eigen::Index kept = 0;
  for (int sweep = 0; sweep < settings.burn_in + settings.sweeps; ++sweep) {
    for (Eigen::Index i = 0; i < walkers; ++i) {
      // A partner of the other half, so that each half moves given the other.
      const bool first = i < half;
      const Eigen::Index others = first ? walkers - half : half;
      const Eigen::Index partner =
          (first ? half : 0) + static_cast<Eigen::Index>(uniform() * static_cast<double>(others));
      const double root = 1 + (kStretch - 1) * uniform();
      const double z = root * root / kStretch;
      trial = (places.row(partner) + z * (places.row(i) - places.row(partner))).transpose();
      const double log = log_density(trial);
      const double accept = static_cast<double>(start.cols() - 1) * std::log(z) + log - logs[i];
      if (std::log(1 - uniform()) >= accept) continue;
      places.row(i) = trial.transpose();
      logs[i] = log;
    }
    const int after = sweep - settings.burn_in;
    if (after < 0 || (after + 1) % settings.keep_every != 0 || kept >= draws.rows()) continue;
    draws.middleRows(kept, walkers) = places;
    kept += walkers;
  }
  return draws.topRows(kept);
}

}  // namespace flash::sysid
