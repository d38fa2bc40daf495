#pragma once
#include <Eigen/Core>
#include <vector>

#include "calib/geometry/projection.h"

namespace flash::calib {

/// The lens as unknowns: fx fy cx cy k1 k2 p1 p2 k3.
constexpr int kLensUnknowns = 9;

/// What is known of a lens before a picture is taken: independent parts r = W (lens - stated), each of unit
/// variance near zero and with the long tail of Student's distribution,
///     cost = kLensTail log(1 + |r|^2 / kLensTail):
/// most stated lenses are nearly right, and one that is not is told by the pictures alone.
struct LensPrior {
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, kIntrinsics>;
  IntrinsicsVector stated = IntrinsicsVector::Zero();
  std::vector<Rows> parts = {};  ///< empty: nothing is known
};
constexpr double kLensTail = 4;

/// Of a lens that is stated without a word on how well it is known: focal lengths to 0.5 %, the centre to 0.5
/// % of half the diagonal, and each coefficient to what moves the picture's corner by 0.5 % of its distance
/// from the centre.
LensPrior usual_lens_prior(const data::CameraIntrinsics& camera);

/// The same with the covariance that a calibration stated, in the order of IntrinsicsVector; unknowns without
/// a variance there are known as usual.
LensPrior lens_prior(const data::CameraIntrinsics& camera, const LensCovariance& covariance);

/// [W r]^T [W r] of the first `unknowns` at this lens, each part with its weight 1 / (1 + |r|^2 / kLensTail).
Eigen::MatrixXd lens_prior_gram(const LensPrior& prior, const IntrinsicsVector& lens, int unknowns);

}  // namespace flash::calib
