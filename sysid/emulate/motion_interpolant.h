#pragma once
#include <Eigen/Core>
#include <memory>
#include <vector>

#include "sysid/emulate/parameter_grid.h"
#include "sysid/emulate/spline.h"
#include "sysid/observe/score.h"

namespace flash::sysid {

/// The motions between the points of a grid: tensor-product cubic splines (Spline) of every position and
/// force, along the logarithm of logarithmic axes. Positions move evenly with the parameters where scores,
/// distances of a millimetre of noise, have a sharp valley; so few values an axis do.
class MotionInterpolant {
 public:
  /// `motions`: one a point of the grid of `axes`, the last axis fastest; alike in steps and in which
  /// positions are empty.
  MotionInterpolant(const std::vector<Axis>& axes, const std::vector<Motion>& motions);

  std::size_t axes() const { return splines_.size(); }

  /// The motion at values inside the grid, one an axis.
  Motion at(const std::vector<double>& values) const;

  /// Motions at several points, for little more than one alone takes.
  std::vector<Motion> at_points(const std::vector<std::vector<double>>& points) const;

  /// motion += share times that at `values`; both have positions at the same steps.
  void add_to(Motion& motion, const std::vector<double>& values, double share) const;

 private:
  friend class MotionSlice;

  /// Of each column, at a point.
  Eigen::VectorXd weights(const std::vector<double>& values) const;

  std::vector<bool> logarithmic_;
  std::vector<Spline> splines_;
  std::shared_ptr<const Motion> layout_;  // of which the numbers do not count
  /// One column a point of the grid: positions step by step, then forces. Shared by copies.
  std::shared_ptr<const Eigen::MatrixXd> points_;
};

}  // namespace flash::sysid
