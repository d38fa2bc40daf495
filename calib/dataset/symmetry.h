#pragma once
#include <Eigen/Geometry>
#include <vector>

#include "calib/dataset/target.h"

namespace flash::calib {

/// A turn of the target onto itself: i -> permutation[i], turn * points.col(i) = points.col(permutation[i]).
struct Symmetry {
  std::vector<int> permutation;
  Eigen::Isometry3d turn = Eigen::Isometry3d::Identity();
};

/// Turns by quarters and halves about the middle of a flat grid that map its points onto themselves, the
/// identity first. Colours are not asked: a detector may have numbered a board from the wrong end.
std::vector<Symmetry> grid_symmetries(const Eigen::Matrix3Xd& points);

/// Numberings that a detector may have confused: those of plain grids; markers say who they are.
std::vector<Symmetry> confusable_symmetries(const Target& target);

}  // namespace flash::calib
