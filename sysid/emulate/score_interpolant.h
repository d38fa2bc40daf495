#pragma once
#include <Eigen/Core>
#include <vector>

#include "sysid/emulate/results_store.h"
#include "sysid/emulate/spline.h"

namespace flash::sysid {

/// The scores of all keyframes between the points of a grid: tensor-product cubic splines (not-a-knot) of the
/// squared score of each keyframe, along the logarithm of logarithmic axes. The square, because it is nearly
/// a parabola both near the truth, where noise rules, and far from it, where the displacement does.
class ScoreInterpolant {
 public:
  /// `results` holds every candidate of the grid, in order. Diverged ones take the worst score found.
  explicit ScoreInterpolant(const GridResults& results);

  /// Coordinate of a value of axis k and back: the logarithm where the axis is logarithmic.
  double coordinate(std::size_t k, double value) const;
  double value(std::size_t k, double coordinate) const;
  Eigen::VectorXd coordinates(const std::vector<double>& values) const;  ///< of values, one an axis

  Eigen::Index parameters() const { return static_cast<Eigen::Index>(splines_.size()); }
  const Eigen::VectorXd& knots(std::size_t k) const {
    return splines_[k].knots();
  }  ///< coordinates of the axis

  /// One sample a weighing keyframe of a recording: its share in the score and whose it is.
  const Eigen::VectorXd& weights() const { return weights_; }
  const std::vector<int>& recordings() const { return recordings_; }

  /// Scores of the samples at coordinates x inside the grid [m].
  Eigen::VectorXd scores(const Eigen::VectorXd& x) const;

  /// Derivatives of the samples' scores by the coordinates, one row a sample.
  Eigen::MatrixXd gradients(const Eigen::VectorXd& x) const;

  /// The score [m], weights . scores(x), with gradient and Hessian.
  double score(const Eigen::VectorXd& x, Eigen::VectorXd& gradient, Eigen::MatrixXd& hessian) const;

  /// Lowest score over the coordinates that `free` names, the others held, by Newton's method inside the grid
  /// from x. Returns it and moves x.
  double minimize(const std::vector<bool>& free, Eigen::VectorXd& x) const;

 private:
  Eigen::VectorXd contract(const Eigen::VectorXd& x, const std::vector<int>& derivatives) const;

  std::vector<bool> logarithmic_;
  std::vector<Spline> splines_;
  Eigen::VectorXd squares_;  // last axis fastest, then the other axes, then samples
  Eigen::VectorXd weights_;
  std::vector<int> recordings_;
};

}  // namespace flash::sysid
