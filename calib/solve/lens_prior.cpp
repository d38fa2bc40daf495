#include "calib/solve/lens_prior.h"

#include <Eigen/Cholesky>
#include <cmath>

namespace flash::calib {
namespace {

constexpr double kUsualShare = 0.005;

/// Standard deviations of fx fy cx cy k1 k2 p1 p2 k3.
Eigen::Matrix<double, kLensUnknowns, 1> usual_deviations(const data::CameraIntrinsics& camera) {
  const double half_diagonal = 0.5 * std::hypot(camera.width, camera.height);
  const double R = half_diagonal / std::sqrt(camera.fx * camera.fy), R2 = R * R;
  const double centre = kUsualShare * half_diagonal;
  Eigen::Matrix<double, kLensUnknowns, 1> sd;
  // Tangential coefficients move a place at distance r from the centre by up to 3 p r^2.
  sd << kUsualShare * camera.fx, kUsualShare * camera.fy, centre, centre, kUsualShare / R2,
      kUsualShare / (R2 * R2), kUsualShare / (3 * R), kUsualShare / (3 * R), kUsualShare / (R2 * R2 * R2);
  return sd;
}

}  // namespace

LensPrior usual_lens_prior(const data::CameraIntrinsics& camera) {
  return lens_prior(camera, LensCovariance::Zero());
}

LensPrior lens_prior(const data::CameraIntrinsics& camera, const LensCovariance& covariance) {
  LensPrior prior{.stated = to_vector(camera)};
  const Eigen::Matrix<double, kLensUnknowns, 1> usual = usual_deviations(camera);
  std::vector<int> told;
  for (int i = 0; i < kLensUnknowns; ++i) {
    if (covariance(i, i) > 0) {
      told.push_back(i);
      continue;
    }
    LensPrior::Rows& row = prior.parts.emplace_back(LensPrior::Rows::Zero(1, kIntrinsics));
    row(0, i) = 1 / usual[i];
  }
  if (told.empty()) return prior;
  const auto count = static_cast<Eigen::Index>(told.size());
  const Eigen::MatrixXd own = covariance(told, told);
  LensPrior::Rows& rows = prior.parts.emplace_back(LensPrior::Rows::Zero(count, kIntrinsics));
  const Eigen::MatrixXd whitened = own.llt().matrixL().solve(Eigen::MatrixXd::Identity(count, count));
  rows(Eigen::all, told) = whitened;
  return prior;
}

Eigen::MatrixXd lens_prior_gram(const LensPrior& prior, const IntrinsicsVector& lens, int unknowns) {
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(unknowns + 1, unknowns + 1);
  for (const LensPrior::Rows& part : prior.parts) {
    Eigen::MatrixXd rows(part.rows(), unknowns + 1);
    rows << part.leftCols(unknowns), part * (lens - prior.stated);
    gram += rows.transpose() * rows / (1 + rows.col(unknowns).squaredNorm() / kLensTail);
  }
  return gram;
}

}  // namespace flash::calib
