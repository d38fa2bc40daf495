#include "calib/geometry/chain.h"

#include <gtest/gtest.h>

#include "tests/calib/hand_eye_scene.h"

namespace flash::calib {
namespace {

class Chains : public testing::TestWithParam<Setup> {};
INSTANTIATE_TEST_SUITE_P(HandEye, Chains, testing::Values(Setup::eye_in_hand, Setup::eye_to_hand));

TEST_P(Chains, DepthResidualHasTheDerivativesOfTheChain) {
  const HandEyeScene scene = protocol_scene(GetParam(), 0.5, 5, 3);
  Bundle bundle = seeded_bundle(scene);
  const BundleView& view = bundle.views[0];
  const Eigen::Vector3d measured = 1.01 * (predicted_pose(bundle, view) * Eigen::Vector3d(0.02, 0.03, 0));
  const DepthResidual depth = depth_residual(chain_of(bundle, view), measured);
  EXPECT_NEAR(depth.value, 0.01 / 1.01 * measured.z(), 1e-12);
  const Chain::Derivative d = chain_of(bundle, view).d_correction(depth.material);
  for (int k = 0; k < 6; ++k) {
    const auto value = [&](double step) {
      Bundle b = bundle;
      b.poses[0].correction = moved(b.poses[0].correction, step * Vector6d::Unit(k));
      return depth_residual(chain_of(b, view), measured).value;
    };
    EXPECT_NEAR((value(1e-6) - value(-1e-6)) / 2e-6, -depth.d_material.dot(d.col(k)),
                2e-2 * std::abs(depth.d_material.dot(d.col(k))) + 2e-2)
        << "the factor along the ray is held, to first order in the residual";
  }
}

}  // namespace
}  // namespace flash::calib
