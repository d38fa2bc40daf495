#pragma once
#include <Eigen/Core>
#include <functional>
#include <vector>

namespace flash::sysid {

/// Log densities, up to a constant, of points, a row each; -infinity where the density is 0. Points that are
/// asked for together may be worked out in parallel.
using LogDensities = std::function<Eigen::VectorXd(const Eigen::MatrixXd& points)>;

struct ImportanceSettings {
  int first_per_dimension = 64;  ///< points that fill the box first
  int batch = 128;               ///< points that are asked for together after these
  double enough = 800;           ///< effective size at which sampling ends
  int most = 8000;               ///< points at which it ends in any case
  unsigned seed = 1;
};

/// Draws of a density, each with its weight.
struct WeightedDraws {
  Eigen::MatrixXd points;         ///< a draw a row
  Eigen::VectorXd log_densities;  ///< of each
  Eigen::VectorXd weights;        ///< of each, 1 in all
  double effective_size = 0;      ///< 1 / sum of squared weights: as many independent draws tell as much
  bool enough = false;            ///< whether that is what was asked for; else quantiles are rough

  /// Of coordinate k, linear between the middles of the steps of the weighted distribution.
  double quantile(Eigen::Index k, double share) const;

  /// Draws of one weight each, a row each, by systematic resampling.
  Eigen::MatrixXd resampled(Eigen::Index count, unsigned seed = 1) const;
};

/// Rows of draws of one weight each, by systematic resampling: those at the middles of `count` even parts of
/// the weights' sum, moved by `offset` of a part.
std::vector<Eigen::Index> systematic_rows(const Eigen::VectorXd& weights, Eigen::Index count, double offset);

/// Adaptive multiple importance sampling in the box from `low` to `high` (Cornuet, Marin, Mira and Robert
/// 2012). Points that fill the box evenly come first, then batches drawn from mixtures of BentStudent,
/// each fitted to all points so far: one to all, some to neighbourhoods. While the effective size is small,
/// they are fitted to a power of the density below 1. Later every second is, so that the ends of ridges are
/// found. The weight of a point is its density over that of all draws together, the deterministic mixture of
/// Veach and Guibas 1995. Draws outside of the box count there, have density 0 and are not asked for. The
/// same settings give the same draws.
/// Throws std::invalid_argument unless low < high; std::domain_error where a log density is NaN or +infinity,
/// and where no point has a density above 0.
WeightedDraws sample_by_importance(const LogDensities& log_densities, const Eigen::VectorXd& low,
                                   const Eigen::VectorXd& high, const ImportanceSettings& settings = {});

}  // namespace flash::sysid
