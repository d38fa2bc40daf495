#include "sysid/infer/model_comparison.h"

#include <Eigen/Eigenvalues>
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
    each.spread = likelihood.of_recording(r).spread();
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

Eigen::VectorXd open_information(const MotionLikelihood& likelihood, const std::vector<double>& spreads) {
  const auto parameters = static_cast<Eigen::Index>(spreads.size());
  Eigen::Index size = parameters;
  for (std::size_t r = 0; r < likelihood.recordings(); ++r)
    size += likelihood.linear(r).rows.free.cols() + likelihood.linear(r).rows.known.cols();
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(size, size);
  double precision = 0;
  for (std::size_t r = 0; r < likelihood.recordings(); ++r)
    precision +=
        std::pow(likelihood.of_recording(r).spread(), -2) / static_cast<double>(likelihood.recordings());
  Eigen::Index own = parameters;  // first of a recording
  for (std::size_t r = 0; r < likelihood.recordings(); ++r) {
    const ObservedRows& rows = likelihood.linear(r).rows;
    const Eigen::Index errors = rows.free.cols() + rows.known.cols();
    Eigen::MatrixXd columns(rows.weights.size(), parameters + errors);
    // What is even from -1 to 1 has a standard deviation of 1 / sqrt(3).
    columns << rows.rates * Eigen::Map<const Eigen::VectorXd>(spreads.data(), parameters).asDiagonal(),
        rows.free / std::sqrt(3.0), rows.known;
    const double share = std::pow(likelihood.of_recording(r).spread(), -2) / precision;
    const Eigen::MatrixXd here = share * (columns.transpose() * rows.weights.asDiagonal() * columns);
    information.topLeftCorner(parameters, parameters) += here.topLeftCorner(parameters, parameters);
    information.block(own, 0, errors, parameters) = here.bottomLeftCorner(errors, parameters);
    information.block(0, own, parameters, errors) = here.topRightCorner(parameters, errors);
    information.block(own, own, errors, errors) = here.bottomRightCorner(errors, errors);
    own += errors;
  }
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(information).eigenvalues().cwiseMax(0.0);
}

double log_occupied(const Eigen::VectorXd& open_information, double spread) {
  return -0.5 * (1 + open_information.array() / (spread * spread)).log().sum();
}

std::vector<double> spreads_over(const std::vector<Axis>& axes, const Extent& extent) {
  std::vector<double> spreads;
  for (std::size_t k = 0; k < axes.size(); ++k) {
    if (axes[k].values.size() < 2 || !(extent[k][0] < extent[k][1])) continue;
    const auto width = [&](double low, double high) {
      return coordinate_of(axes[k], high) - coordinate_of(axes[k], low);
    };
    spreads.push_back(width(axes[k].values.front(), axes[k].values.back()) / std::sqrt(12.0) /
                      width(extent[k][0], extent[k][1]));
  }
  return spreads;
}

}  // namespace flash::sysid
