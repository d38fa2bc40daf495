#pragma once
#include <Eigen/Core>

namespace flash::sysid {

/// Points that fill the unit cube evenly, a point a row: the sequence of Halton with every digit permuted at
/// random (Owen 2017). Each point is evenly distributed in [0, 1)^dimensions. The same seed gives the same
/// ones.
Eigen::MatrixXd scrambled_halton(Eigen::Index count, Eigen::Index dimensions, unsigned seed);

}  // namespace flash::sysid
