#include "calib/dataset/told_shape.h"

#include <gtest/gtest.h>

namespace flash::calib {
namespace {

// A number that is known no better than before was not told by pictures.
TEST(WarpEstimate, SaysOnlyWhatPicturesTell) {
  WarpEstimate warp{.estimate = {3e-4, -1e-6, 1e-4}, .sd = {5e-5, 4e-5, 2.7e-4}, .prior_sd = 3e-4};
  EXPECT_EQ(describe(warp),
            "its middle 0.30 +- 0.05 mm behind its ends along x, its middle 0.00 +- 0.04 mm behind its ends "
            "along y");
  warp.sd = {3e-4, 3e-4, 1e-4};
  EXPECT_EQ(describe(warp, 2), "twisted by 0.10 +- 0.20 mm");
  warp.sd.setConstant(3e-4);
  EXPECT_EQ(describe(warp), "");
  EXPECT_EQ(describe(WarpEstimate{}), "");
}

// The middle of four corners is none of them.
TEST(WarpEstimate, OfFourCornersIsTheTwist) {
  Eigen::Matrix3Xd corners(3, 4);
  corners << -1, 1, 1, -1, -1, -1, 1, 1, 0, 0, 0, 0;
  const Bows bows = target_bows(corners);
  EXPECT_EQ(bows.topRows<2>().norm(), 0);
  EXPECT_EQ(bows.row(2).cwiseAbs().sum(), 4);
}

TEST(EdgeOffset, IsToldWherePicturesHalveWhatWasKnown) {
  EXPECT_TRUE(told(EdgeOffset{.estimate = 0.1, .sd = 0.4 * kUsualEdgeOffset}));
  EXPECT_FALSE(told(EdgeOffset{.estimate = 0.1, .sd = 0.9 * kUsualEdgeOffset}));
}

}  // namespace
}  // namespace flash::calib
