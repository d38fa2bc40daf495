#include "calib/solve/linearization.h"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "tests/calib/hand_eye_scene.h"

namespace flash::calib {
namespace {

class Linearization : public testing::TestWithParam<Setup> {};
INSTANTIATE_TEST_SUITE_P(HandEye, Linearization, testing::Values(Setup::eye_in_hand, Setup::eye_to_hand));

TEST_P(Linearization, HasTheDerivativesOfTheResiduals) {
  const HandEyeScene scene = protocol_scene(GetParam(), 0.5, 5, 2);
  Bundle bundle = seeded_bundle(scene);
  bundle.bases.push_back(make_pose({0.3, -0.2, 0.1}, {0.1, 0.2, -0.4}));
  bundle.time_offsets.push_back(0.02);
  bundle.pivots.push_back({0.1, 0.2, 0.3});
  bundle.views.resize(1);
  bundle.poses.resize(1);
  bundle.poses[0].arm = 1;
  bundle.poses[0].correction = make_pose({0.004, -0.003, 0.002}, {0.02, -0.01, 0.03});
  bundle.poses[0].velocity << 0.1, -0.2, 0.05, 0.3, 0.1, -0.2;
  bundle.intrinsics[0].model = data::DistortionModel::rational_polynomial;
  bundle.intrinsics[0].distortion = {0.1, -0.2, 0.001, -0.002, 0.05, 0.02, -0.03, 0.01};
  bundle.scales[0] = 1.02;
  bundle.warps = {Warp(0.004, -0.003, 0.002)};
  bundle.views[0].outward = Eigen::Matrix2Xd::Random(2, scene.points.cols());
  bundle.edge_offsets = {0.3};
  bundle.views[0].corner_noise = 2;
  const Unknowns unknowns{.corrections = true,
                          .intrinsics = kIntrinsics,
                          .scales = true,
                          .warps = true,
                          .edge_offsets = true,
                          .time_offsets = true};
  const SharedColumns columns = shared_columns(bundle, unknowns);
  double count = 0;
  const Eigen::MatrixXd gram = corner_gram(bundle, bundle.views[0], unknowns, columns, 1, 0, count);
  const Eigen::Index width = 6 + columns.count;
  const auto shifted = [&](Eigen::Index column, double step) {
    Bundle b = bundle;
    const Eigen::Index shared = column - 6;
    const auto pose_step = [&](Eigen::Isometry3d& T, Eigen::Index first) {
      if (first < 0 || column - first < 0 || column - first >= 6) return;
      T = moved(T, step * Vector6d::Unit(column - first));
    };
    pose_step(b.poses[0].correction, 0);
    pose_step(b.cameras[0], 6 + columns.cameras[0]);
    pose_step(b.targets[0], 6 + columns.targets[0]);
    pose_step(b.bases[1], 6 + columns.bases[1]);
    if (shared >= columns.intrinsics[0] && shared < columns.intrinsics[0] + kIntrinsics) {
      IntrinsicsVector v = to_vector(b.intrinsics[0]);
      v[shared - columns.intrinsics[0]] += step;
      b.intrinsics[0] = with_vector(b.intrinsics[0], v);
    }
    if (shared == columns.scales[0]) b.scales[0] += step;
    if (shared >= columns.warps[0] && shared < columns.warps[0] + kWarp)
      b.warps[0][shared - columns.warps[0]] += step;
    if (shared == columns.edge_offsets[0]) b.edge_offsets[0] += step;
    if (shared == columns.time_offsets[1]) b.time_offsets[1] += step;
    const Eigen::Matrix2Xd r = -residuals(b, b.views[0]) / b.views[0].corner_noise;
    return Eigen::VectorXd(r.reshaped());
  };
  Eigen::MatrixXd J(2 * scene.points.cols(), width + 1);
  constexpr double kStep = 1e-6;
  for (Eigen::Index c = 0; c < width; ++c) J.col(c) = (shifted(c, kStep) - shifted(c, -kStep)) / (2 * kStep);
  J.col(width) = shifted(0, 0);
  const Eigen::MatrixXd expected = J.transpose() * J;
  // Central differences of 1e-6 on residuals of some hundred pixels: 1e-8 of each column's size.
  const Eigen::VectorXd size = expected.diagonal().cwiseSqrt().cwiseMax(1e-9);
  EXPECT_EQ(count, 2 * static_cast<double>(scene.points.cols()));
  EXPECT_LT(
      (size.asDiagonal().inverse() * (gram - expected) * size.asDiagonal().inverse()).cwiseAbs().maxCoeff(),
      1e-6);
}

// The prior's Gram matrix against differences of its cost, in which each part's weight is held.
TEST(LensPrior, StandsInTheLinearModelAsItsResidualsDo) {
  const HandEyeScene scene = protocol_scene(Setup::eye_in_hand, 0, 0, 3);
  LensCovariance covariance = LensCovariance::Zero();
  covariance.topLeftCorner<2, 2>() << 4, 3, 3, 9;  // fx and fy; the others as usual
  LensPrior prior = lens_prior(scene.camera, covariance);
  IntrinsicsVector lens = to_vector(scene.camera);
  lens[0] += 2;
  lens[4] += 0.01;
  const Eigen::Vector2d off(2, 0);
  const Eigen::MatrixXd gram = lens_prior_gram(prior, lens, kLensUnknowns);
  const double squared = off.dot(covariance.topLeftCorner<2, 2>().inverse() * off);
  const Eigen::Matrix2d stated = covariance.topLeftCorner<2, 2>().inverse() / (1 + squared / kLensTail);
  EXPECT_LT((gram.topLeftCorner<2, 2>() - stated).norm(), 1e-12);
  EXPECT_LT((gram.col(kLensUnknowns).head<2>() - stated * off).norm(), 1e-12);
  // k1 moves the picture's corner, 400 px away at f = 615, by 0.5 % of that where it is off by one deviation.
  const double sd = 0.005 / (400.0 * 400.0 / (615.0 * 615.0)), k1 = 0.01 / sd;
  EXPECT_NEAR(gram(4, 4), 1 / (sd * sd) / (1 + k1 * k1 / kLensTail), 1e-9 * gram(4, 4));
}

TEST(TargetWarp, LeavesTheEndsRaisesTheMiddleAndTwists) {
  const Bows bows = target_bows(board_points(5, 3));
  EXPECT_EQ(bows.col(0), Warp(0, 0, 1));
  EXPECT_EQ(bows.col(7), Warp(1, 1, 0));
  EXPECT_EQ(bows.col(2), Warp(1, 0, 0));
  EXPECT_EQ(bows.col(4), Warp(0, 0, -1));
  EXPECT_TRUE(target_bows(tag_points()).topRows<2>().isZero(0));
}

}  // namespace
}  // namespace flash::calib
