#pragma once
#include <Eigen/Core>
#include <optional>

#include "sysid/infer/discrepancy.h"

namespace flash::sysid {

/// The likelihood of residuals by which parameters are judged, as wide as a wrong model needs.
///
/// A likelihood with a smooth discrepancy in it hardly minds smooth residuals. It finds the parameters by
/// what is rough in them, where the model says least, and these need not predict well (Tuo and Wu 2015). So
/// every row counts by itself, by Huber's function rho of its size, errors of known shape fitted under their
/// prior:
///
///     -2 log likelihood = min_a 2 / s^2 sum_i w_i rho(y_i - K_i a) + |a|^2
///
/// rho is a square up to 1.345 times the noise, where it is all but as good as least squares, and a distance
/// beyond (Huber 1964): a model that misses by much more than noise is judged by the mean distance, as scores
/// are. The discrepancy decides how much a row counts. G: how rows change with the parameters; H: curvature
/// along them; J: covariance of the slope G^T psi(y) under the covariance of DiscrepancyModel. The parameters
/// that are found scatter by H^-1 J H^-1 (Godambe 1960, Huber 1967), and s is the least for which the
/// curvature of no direction claims more (Muller 2013). Without a discrepancy s is sigma.
class ResidualLikelihood {
 public:
  /// `limit`: where rho turns [m]; by the noise without it.
  ResidualLikelihood(ObservedRows rows, const Eigen::VectorXd& residuals,
                     std::optional<double> repeatability = {}, std::optional<double> limit = {},
                     int threads = 1);

  Eigen::Index rows() const { return weights_.size(); }

  struct Fit {
    double deviance = 0;           ///< -2 log likelihood, up to a constant
    Eigen::VectorXd free = {};     ///< the free errors, between -1 and 1
    Eigen::VectorXd known = {};    ///< the known errors, in standard deviations
    Eigen::VectorXd left = {};     ///< residuals without errors of known shape [m]
    Eigen::VectorXd weights = {};  ///< psi(left) / left, times those of the rows
  };
  /// `known`: the errors of known shape, in place of those of the rows.
  Fit fit(const Eigen::VectorXd& residuals, const Eigen::MatrixXd& known = {}) const;
  double deviance(const Eigen::VectorXd& residuals) const { return fit(residuals).deviance; }

  /// What `left` costs where the errors are given, `free` and `known` as in Fit.
  double deviance_of(const Eigen::VectorXd& left, const Eigen::VectorXd& free,
                     const Eigen::VectorXd& known) const;

  double spread() const { return spread_; }  ///< s [m]

  /// How well the residuals tell each known error beside the parameters, in its standard deviations.
  Eigen::VectorXd known_spread() const;

  /// The same of each free error, of its bound: at most that of an even distribution between its bounds.
  Eigen::VectorXd free_spread() const;

  /// At the residuals given to the constructor.
  const Misfit& misfit() const { return misfit_; }

 private:
  /// Variances of the errors of known shape, parameters unknown.
  Eigen::VectorXd error_variances() const;
  /// By how much rho'' / 2 is of each row on average, where `left` is left of rows: 1 below the limit and 0
  /// beyond it, or, where half are beyond, the density of rows about 0 by the nearer half (Powell 1991).
  Eigen::VectorXd curvature_of(const Eigen::VectorXd& left) const;
  /// (spread^2 weights^-1 + K K^T)^-1 times columns.
  Eigen::MatrixXd weigh(const Eigen::MatrixXd& columns, const Eigen::VectorXd& weights) const;

  Eigen::VectorXd weights_;
  Eigen::Index free_;  ///< of the columns of known_, how many are bounded and of no other prior
  Eigen::MatrixXd known_, rates_;
  Eigen::VectorXd priors_;  ///< precision of each column of known_
  double limit_ = 0, spread_ = 0;
  Misfit misfit_;
};

}  // namespace flash::sysid
