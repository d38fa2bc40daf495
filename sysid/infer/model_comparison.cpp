#include "sysid/infer/model_comparison.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "sysid/infer/residual_likelihood.h"

namespace flash::sysid {

std::vector<LeftResiduals> left_residuals(const MotionLikelihood& likelihood) {
  std::vector<LeftResiduals> all;
  for (std::size_t r = 0; r < likelihood.recordings(); ++r) {
    const MotionLikelihood::Linear& linear = likelihood.linear(r);
    const ResidualLikelihood::Fit fit = likelihood.of_recording(r).fit(linear.residuals);
    LeftResiduals& each = all.emplace_back();
    each.rows = {linear.rows.times, linear.rows.keyframe, linear.rows.channel, linear.rows.places,
                 linear.rows.weights};
    each.left = fit.left;
    each.error_cost = fit.known.squaredNorm();
  }
  return all;
}

double excess_deviance(const std::vector<LeftResiduals>& reference, const std::vector<LeftResiduals>& other,
                       std::optional<double> repeatability) {
  double excess = 0;
  for (std::size_t r = 0; r < reference.size(); ++r) {
    ObservedRows rows = reference[r].rows;
    rows.rates = other[r].left - reference[r].left;
    if (rows.rates.norm() > 0) {
      const ResidualLikelihood likelihood(std::move(rows), reference[r].left, repeatability);
      excess += likelihood.deviance(other[r].left) - likelihood.deviance(reference[r].left);
    }
    excess += other[r].error_cost - reference[r].error_cost;
  }
  return excess;
}

double log_occupied(const Eigen::MatrixXd& draws, const Eigen::VectorXd& widths) {
  if (draws.cols() == 0) return 0;
  // In units of the ranges, where a standard deviation is 1 / sqrt(2 pi) at most and, of draws that are all
  // alike, a thousandth.
  const Eigen::MatrixXd scaled = draws * widths.cwiseInverse().asDiagonal();
  const Eigen::MatrixXd centred = scaled.rowwise() - scaled.colwise().mean();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(centred.transpose() * centred /
                                                             static_cast<double>(draws.rows()));
  double log = 0;
  for (const double variance : eigen.eigenvalues())
    log += 0.5 * std::log(2 * M_PI * std::clamp(variance, 1e-6, 1 / (2 * M_PI)));
  return log;
}

}  // namespace flash::sysid
