#include "sysid/infer/expected_information.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "sysid/infer/agreed_numbers.h"
#include "sysid/infer/sheet_modes.h"

namespace flash::sysid {
namespace {

/// Precision of what is even between -1 and 1. Theory: the variance is a third.
constexpr double kEven = 3;
constexpr int kRounds = 30;     // Of the spread. Work: a cap.
constexpr double kSame = 1e-3;  // Of the spread. Work: where rounds end.

/// Columns that make the information 1; directions of none are left out.
Eigen::MatrixXd inverse_root(const Eigen::MatrixXd& information) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(information);
  const Eigen::VectorXd& values = eigen.eigenvalues();
  std::vector<Eigen::Index> told;
  for (Eigen::Index i = 0; i < values.size(); ++i)
    if (values[i] > 0 && values[i] > least_information * values[values.size() - 1]) told.push_back(i);
  return eigen.eigenvectors()(Eigen::all, told) * values(told).cwiseSqrt().cwiseInverse().asDiagonal();
}

/// Covariance that the discrepancy gives to combinations of rows, a combination a column.
Eigen::MatrixXd covariance_of_discrepancy(const ObservedRows& rows, const Misfit& misfit,
                                          const Eigen::MatrixXd& combinations) {
  const SheetModes modes = sheet_modes(rows.places);
  const Eigen::VectorXd along = misfit.rms * misfit.rms * variances_along(modes, misfit.reach_sheet);
  const Eigen::Index count = along.size();
  const auto keyframes = static_cast<Eigen::Index>(rows.times.size());
  const int channels = 1 + *std::max_element(rows.channel.begin(), rows.channel.end());
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(combinations.cols(), combinations.cols());
  for (int channel = 0; channel < channels; ++channel) {
    Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(keyframes * count, combinations.cols());
    for (Eigen::Index i = 0; i < combinations.rows(); ++i) {
      const auto at = static_cast<std::size_t>(i);
      if (rows.channel[at] == channel)
        sums.middleRows(rows.keyframe[at] * count, count).noalias() +=
            modes.values.row(i).transpose() * combinations.row(i);
    }
    for (Eigen::Index k = 0; k < keyframes; ++k)
      for (Eigen::Index l = 0; l < keyframes; ++l) {
        const double apart =
            std::abs(rows.times[static_cast<std::size_t>(k)] - rows.times[static_cast<std::size_t>(l)]);
        covariance.noalias() += correlation_in_time(apart / misfit.reach_time) *
                                sums.middleRows(k * count, count).transpose() * along.asDiagonal() *
                                sums.middleRows(l * count, count);
      }
  }
  return covariance;
}

}  // namespace

Eigen::MatrixXd expected_information(const ObservedRows& rows, const Misfit& misfit) {
  const Eigen::MatrixXd& rates = rows.rates;
  Eigen::MatrixXd beside(rates.rows(), rows.free.cols() + rows.known.cols());
  if (rows.free.cols() > 0) beside.leftCols(rows.free.cols()) = rows.free;
  if (rows.known.cols() > 0) beside.rightCols(rows.known.cols()) = rows.known;
  Eigen::VectorXd priors = Eigen::VectorXd::Ones(beside.cols());
  priors.head(rows.free.cols()).setConstant(kEven);
  const Eigen::VectorXd spreads = rows.weights.unaryExpr([](double w) { return w > 0 ? 1 / w : 0.0; });
  const Eigen::MatrixXd of_beside = rows.weights.asDiagonal() * beside;
  double spread = misfit.noise;
  Eigen::MatrixXd information;
  for (int round = 0; round < kRounds; ++round) {
    Eigen::MatrixXd normal = beside.transpose() * of_beside;
    normal.diagonal() += spread * spread * priors;
    Eigen::MatrixXd weighed = rows.weights.asDiagonal() * rates;
    if (beside.cols() > 0) weighed -= of_beside * normal.llt().solve(of_beside.transpose() * rates);
    const Eigen::MatrixXd precise = rates.transpose() * weighed;
    information = 0.5 * (precise + precise.transpose()) / (spread * spread);
    const Eigen::MatrixXd root = inverse_root(information);
    if (root.cols() == 0) return Eigen::MatrixXd::Zero(rates.cols(), rates.cols());
    const Eigen::MatrixXd slopes = weighed * root / (spread * spread);
    // What is fitted beside the parameters scatters by its prior.
    const Eigen::MatrixXd by_beside =
        (slopes.transpose() * beside) * priors.cwiseSqrt().cwiseInverse().asDiagonal();
    Eigen::MatrixXd covariance =
        misfit.rough * misfit.rough * slopes.transpose() * spreads.asDiagonal() * slopes +
        by_beside * by_beside.transpose();
    if (misfit.rms > 0) covariance += covariance_of_discrepancy(rows, misfit, slopes);
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(covariance);
    const double next =
        std::max(spread * std::sqrt(std::max(eigen.eigenvalues().maxCoeff(), 0.0)), misfit.noise);
    if (!(std::abs(next - spread) > kSame * spread)) break;
    spread = next;
  }
  return information;
}

}  // namespace flash::sysid
