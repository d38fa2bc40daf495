#pragma once
#include "sysid/infer/importance_sampling.h"
#include "sysid/infer/log_density_surrogate.h"

namespace flash::sysid {

struct SurrogateSettings {
  double agreement = 0.95;  ///< of fresh draws at which it ends
  double enough = 2000;     ///< effective size of the draws of the surrogate
  double enough_without =
      800;           ///< effective size where no surrogate agrees and the density itself is drawn from
  int batches = 12;  ///< of fresh draws, after which it ends in any case
  int most = 8000;   ///< points that a sampler of the density itself asks for at most
  unsigned seed = 1;
  const WeightedDraws* before = nullptr;  ///< of a density like the one at hand: asked for first
};

struct SurrogateDraws {
  WeightedDraws draws;  ///< effective_size: of the surrogate's draws times `agreement`
  /// 1 / (1 + mean (w - 1)^2) of the last fresh draws, w their density over the surrogate: the effective size
  /// over the number where w is 1 in the mean. 1 where draws are of the density itself.
  double agreement = 0;
};

/// The weights of draws under another power of the density.
Eigen::VectorXd weights_of_power(const WeightedDraws& draws, double power);

/// Importance sampling of a density that is dear. sample_by_importance finds where it is likely, by few
/// points, unless draws `before` show it. Then a LogDensitySurrogate is sampled, some of its draws are asked
/// for, weighted by what they turn out to be, and added to what the surrogate is fitted to, until these
/// weights are as good as 1. Some are of the square root of the density, so that its tails are known. Where
/// four surrogates in a row have hardly any likely draw, or the last agrees by less than 0.75,
/// sample_by_importance goes on by itself. `asked`:
/// what is known of the density already, if anything; it grows. Throws what sample_by_importance does.
SurrogateDraws sample_by_surrogate(const LogDensities& log_densities, const Eigen::VectorXd& low,
                                   const Eigen::VectorXd& high, AskedPoints& asked,
                                   const SurrogateSettings& settings = {});

}  // namespace flash::sysid
