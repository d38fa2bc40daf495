#pragma once
#include <Eigen/Core>
#include <memory>
#include <utility>
#include <vector>

#include "sysid/emulate/parameter_grid.h"
#include "sysid/emulate/spline.h"
#include "sysid/observe/score.h"

namespace flash::sysid {

/// Positions of a step, column by column; with their count as `step` all forces.
void set_step(Motion& motion, std::size_t step, const Eigen::Ref<const Eigen::VectorXd>& numbers);

/// The motions between the points of a grid: tensor-product cubic splines (Spline) of every position and
/// force, along the logarithm of logarithmic axes. Positions move evenly with the parameters where scores,
/// distances of a millimetre of noise, have a sharp valley; so few values an axis do.
class MotionInterpolant {
 public:
  /// `motions`: one a point of the grid of `axes`, the last axis fastest; alike in steps and in which
  /// positions are empty.
  MotionInterpolant(const std::vector<Axis>& axes, const std::vector<Motion>& motions, int threads = 1);

  std::size_t axes() const { return splines_.size(); }

  /// The motion at values inside the grid, one an axis.
  Motion at(const std::vector<double>& values) const;

  /// Motions at several points, for little more than one alone takes; the steps on up to `threads` threads.
  std::vector<Motion> at_points(const std::vector<std::vector<double>>& points, int threads = 1) const;

 private:
  friend class MotionSlice;
  friend class TwoMeshMotions;

  /// Of each column, at each point.
  Eigen::MatrixXd weights(const std::vector<std::vector<double>>& points) const;

  /// The numbers of a step, a column a point; with their count as `step` those of the forces.
  Eigen::MatrixXd numbers(std::size_t step, const Eigen::MatrixXd& weights) const;

  /// A motion of as many steps and forces, without numbers.
  Motion without_numbers() const;

  std::vector<bool> logarithmic_;
  std::vector<Spline> splines_;
  std::shared_ptr<const Motion> layout_;  // of which the numbers do not count
  /// Rows of each step, and at last of the forces: first and count.
  std::vector<std::pair<Eigen::Index, Eigen::Index>> rows_;
  /// One column a point of the grid: positions step by step, then forces. Shared by copies.
  std::shared_ptr<const Eigen::MatrixXd> points_;
};

}  // namespace flash::sysid
