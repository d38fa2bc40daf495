#include "calib/dataset/symmetry.h"

#include <cmath>

#include "calib/geometry/pose.h"

namespace flash::calib {

std::vector<Symmetry> grid_symmetries(const Eigen::Matrix3Xd& points) {
  std::vector<Symmetry> symmetries;
  const Eigen::Vector3d centre = points.rowwise().mean();
  const double size = (points.colwise() - centre).colwise().norm().maxCoeff();
  for (int quarter = 0; quarter < 4; ++quarter) {
    Symmetry symmetry;
    symmetry.turn.linear() = rotation_exp({0, 0, quarter * M_PI / 2});
    symmetry.turn.translation() = centre - symmetry.turn.linear() * centre;
    for (Eigen::Index i = 0; i < points.cols(); ++i) {
      Eigen::Index nearest = 0;
      const Eigen::Vector3d target = symmetry.turn * points.col(i);
      if ((points.colwise() - target).colwise().norm().minCoeff(&nearest) > 1e-6 * size) break;
      symmetry.permutation.push_back(static_cast<int>(nearest));
    }
    if (static_cast<Eigen::Index>(symmetry.permutation.size()) == points.cols())
      symmetries.push_back(symmetry);
  }
  return symmetries;
}

std::vector<Symmetry> confusable_symmetries(const Target& target) {
  std::vector<Symmetry> all = grid_symmetries(target_points(target));
  if (target.kind != TargetKind::chessboard && target.kind != TargetKind::circle_grid) all.resize(1);
  return all;
}

}  // namespace flash::calib
