#include "calib/uncertainty/lens_estimate.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iterator>

#include "calib/solve/linearization.h"

namespace flash::calib {
namespace {

constexpr double kFar = 3;  // standard deviations

/// What chi-square exceeds as rarely as a normal distribution its mean by kFar deviations (Wilson and
/// Hilferty 1931).
double far_chi_square(double freedom) {
  const double share = 2 / (9 * freedom);
  return freedom * std::pow(1 - share + kFar * std::sqrt(share), 3);
}

}  // namespace

LensEstimate lens_estimate(const Bundle& bundle, const Unknowns& unknowns, const Eigen::MatrixXd& covariance,
                           std::size_t camera) {
  LensEstimate lens;
  lens.stated = lens.estimate = to_vector(bundle.intrinsics[camera]);
  const SharedColumns columns = shared_columns(bundle, unknowns);
  const int first = columns.intrinsics[camera], count = columns.intrinsics_count;
  if (first < 0) return lens;
  const Eigen::MatrixXd own = covariance.block(first, first, count, count);
  lens.sd.head(count) = own.diagonal().cwiseSqrt();
  if (bundle.priors.lenses.empty()) return lens;
  const LensPrior& prior = bundle.priors.lenses[camera];
  lens.stated = prior.stated;
  for (const LensPrior::Rows& part : prior.parts) {
    const Eigen::MatrixXd rows = part.leftCols(count);
    const Eigen::VectorXd off = part * (lens.estimate - lens.stated);
    Eigen::MatrixXd variance = rows * own * rows.transpose();
    variance.diagonal().array() += 1;
    if (off.dot(variance.ldlt().solve(off)) < far_chi_square(static_cast<double>(part.rows()))) continue;
    for (int i = 0; i < count; ++i)
      if (rows.col(i).norm() > 0) lens.far_off.push_back(i);
  }
  return lens;
}

const char* lens_unknown(int i) {
  constexpr const char* kNames[kLensUnknowns] = {"fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"};
  return kNames[i];
}

bool exceeds_deviations(const Eigen::Isometry3d& X, const Vector6d& motion, const Matrix6d& covariance) {
  Matrix6d turn = Matrix6d::Zero();
  turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() = X.linear();
  const Vector6d variance = (turn * covariance * turn.transpose()).diagonal().cwiseMax(0);
  return ((turn * motion).cwiseAbs2() - variance).maxCoeff() > 0;
}

std::string lens_differs(const LensEstimate& lens) {
  // What is known together is far off together; each number that pictures leave as it was is not named.
  std::vector<int> named;
  std::copy_if(lens.far_off.begin(), lens.far_off.end(), std::back_inserter(named),
               [&](int i) { return std::abs(lens.estimate[i] - lens.stated[i]) > 2 * lens.sd[i]; });
  std::string text = "the lens is not as stated:";
  for (const int i : named.empty() ? lens.far_off : named) {
    char part[100];
    std::snprintf(part, sizeof part,
                  i < 4 ? " %s %.1f +- %.1f, stated %.1f;" : " %s %.3f +- %.3f, stated %.3f;",
                  lens_unknown(i), lens.estimate[i], 2 * lens.sd[i], lens.stated[i]);
    text += part;
  }
  text.pop_back();
  return text;
}

std::string lens_sentence(const LensEstimate& lens) {
  return lens_differs(lens) +
         "; the answer is for the lens solved for (--camera-info writes it); calibrate the lens (flash-calib "
         "intrinsics)";
}

WarpEstimate warp_estimate(const Bundle& bundle, const Unknowns& unknowns, const Eigen::MatrixXd& covariance,
                           std::size_t target) {
  WarpEstimate warp;
  const int first = shared_columns(bundle, unknowns).warps[target];
  if (first < 0) return warp;
  warp.estimate = bundle.warps[target];
  warp.sd = covariance.diagonal().segment<kWarp>(first).cwiseSqrt();
  warp.prior_sd = bundle.priors.warp_sd[target];
  return warp;
}

std::optional<EdgeOffset> edge_estimate(const Bundle& bundle, const Unknowns& unknowns,
                                        const Eigen::MatrixXd& covariance, std::size_t camera) {
  const int column = shared_columns(bundle, unknowns).edge_offsets[camera];
  if (column < 0) return std::nullopt;
  return EdgeOffset{.estimate = edge_offset(bundle, camera), .sd = std::sqrt(covariance(column, column))};
}

}  // namespace flash::calib
