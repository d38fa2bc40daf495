#include "calib/dataset/edge_offset.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

namespace flash::calib {
namespace {

using Line = Eigen::Hyperplane<double, 2>;

/// The quadrilateral whose sides stand `d` farther out.
Eigen::Matrix<double, 2, 4> grown(const Eigen::Matrix<double, 2, 4>& corners, double d) {
  const Eigen::Vector2d middle = corners.rowwise().mean();
  std::vector<Line> sides;
  for (int i = 0; i < 4; ++i) {
    Line side = Line::Through(corners.col(i), corners.col((i + 1) % 4));
    side.offset() += side.signedDistance(middle) > 0 ? d : -d;
    sides.push_back(side);
  }
  Eigen::Matrix<double, 2, 4> result;
  for (std::size_t i = 0; i < 4; ++i)
    result.col(static_cast<Eigen::Index>(i)) = sides[(i + 3) % 4].intersection(sides[i]);
  return result;
}

TEST(EdgeOffset, MovesCornersToWhereEdgesMeetThatStandOutwards) {
  // A square from the front, one seen from the side, and a mirrored one.
  Eigen::Matrix<double, 2, 4> square, aslant, mirrored;
  square << 10, 60, 60, 10, 20, 20, 70, 70;
  aslant << 10, 52, 61, 14, 22, 31, 66, 90;
  mirrored << 60, 10, 10, 60, 20, 20, 70, 70;
  Eigen::Matrix2Xd all(2, 12);
  all << square, aslant, mirrored;
  const Eigen::Matrix2Xd motion = outward_motion(TargetKind::aruco_grid, all);
  EXPECT_LT((motion.col(0) - Eigen::Vector2d(-1, -1)).norm(), 1e-12);
  for (const double d : {-0.3, 0.2}) {
    Eigen::Matrix2Xd expected(2, 12);
    expected << grown(square, d), grown(aslant, d), grown(mirrored, d);
    EXPECT_LT((all + d * motion - expected).cwiseAbs().maxCoeff(), 1e-10);
  }
}

TEST(EdgeOffset, IsNoneOfCrossingsAndDots) {
  for (const TargetKind kind : {TargetKind::chessboard, TargetKind::charuco, TargetKind::circle_grid})
    EXPECT_EQ(outward_motion(kind, Eigen::Matrix2Xd::Random(2, 12)).cols(), 0);
}

}  // namespace
}  // namespace flash::calib
