#include "sysid/emulate/motion_interpolant.h"

#include <cmath>
#include <utility>

namespace flash::sysid {
namespace {

/// Calls `use` with every array of numbers of a motion, in one order.
template <class AMotion, class Use>
void for_each_block(AMotion& motion, const Use& use) {
  for (auto& positions : motion.positions) use(positions.data(), positions.size());
  for (auto& force : motion.forces) use(force.data(), force.size());
}

}  // namespace

MotionInterpolant::MotionInterpolant(const std::vector<Axis>& axes, const std::vector<Motion>& motions)
    : layout_(std::make_shared<const Motion>(motions.front())) {
  for (const Axis& axis : axes) {
    Eigen::VectorXd knots(static_cast<Eigen::Index>(axis.values.size()));
    for (std::size_t i = 0; i < axis.values.size(); ++i)
      knots[static_cast<Eigen::Index>(i)] = axis.logarithmic ? std::log(axis.values[i]) : axis.values[i];
    logarithmic_.push_back(axis.logarithmic);
    splines_.emplace_back(std::move(knots));
  }
  Eigen::Index size = 0;
  for_each_block(*layout_, [&](const double*, Eigen::Index count) { size += count; });
  const auto points = std::make_shared<Eigen::MatrixXd>(size, static_cast<Eigen::Index>(motions.size()));
  for (std::size_t c = 0; c < motions.size(); ++c) {
    double* to = points->col(static_cast<Eigen::Index>(c)).data();
    for_each_block(motions[c],
                   [&](const double* from, Eigen::Index count) { to = std::copy(from, from + count, to); });
  }
  points_ = points;
}

Eigen::VectorXd MotionInterpolant::weights(const std::vector<double>& values) const {
  Eigen::VectorXd all = Eigen::VectorXd::Ones(1);
  for (std::size_t k = 0; k < splines_.size(); ++k) {
    const Eigen::RowVectorXd of_axis = splines_[k].weights(logarithmic_[k] ? std::log(values[k]) : values[k]);
    const Eigen::MatrixXd product = of_axis.transpose() * all.transpose();  // the last axis fastest
    all = product.reshaped();
  }
  return all;
}

std::vector<Motion> MotionInterpolant::at_points(const std::vector<std::vector<double>>& points) const {
  Eigen::MatrixXd weights(points_->cols(), static_cast<Eigen::Index>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i)
    weights.col(static_cast<Eigen::Index>(i)) = this->weights(points[i]);
  const Eigen::MatrixXd numbers = *points_ * weights;
  std::vector<Motion> motions(points.size(), *layout_);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double* from = numbers.col(static_cast<Eigen::Index>(i)).data();
    for_each_block(motions[i], [&](double* to, Eigen::Index count) {
      std::copy(from, from + count, to);
      from += count;
    });
  }
  return motions;
}

Motion MotionInterpolant::at(const std::vector<double>& values) const {
  return std::move(at_points({values}).front());
}

void MotionInterpolant::add_to(Motion& motion, const std::vector<double>& values, double share) const {
  const Eigen::VectorXd numbers = *points_ * weights(values);
  Eigen::Index first = 0;
  for_each_block(motion, [&](double* to, Eigen::Index count) {
    Eigen::Map<Eigen::VectorXd>(to, count) += share * numbers.segment(first, count);
    first += count;
  });
}

}  // namespace flash::sysid
