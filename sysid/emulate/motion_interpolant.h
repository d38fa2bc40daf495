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

  /// The interpolant over all axes but the first, which is held at `value`: cheaper where many points share
  /// it.
  MotionInterpolant slice(double value) const;

  /// The same in place of `rest`, a former slice, of which the memory is used again.
  void slice(double value, MotionInterpolant& rest) const;

  /// motion += share times that at `values`; both have positions at the same steps.
  void add_to(Motion& motion, const std::vector<double>& values, double share) const;

  /// The interpolant of positions at these steps alone; others are empty.
  MotionInterpolant only(const std::vector<bool>& steps) const;

 private:
  MotionInterpolant() = default;
  Motion zero() const;

  std::vector<bool> logarithmic_;
  std::vector<Spline> splines_;
  std::shared_ptr<const Motion> layout_;  // of which the numbers do not count
  /// One column a point of the grid: positions step by step, then forces. Shared by copies; only a slice that
  /// no copy shares is ever changed.
  std::shared_ptr<Eigen::MatrixXd> points_;
};

}  // namespace flash::sysid
