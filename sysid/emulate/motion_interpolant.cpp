#include "sysid/emulate/motion_interpolant.h"

#include <cmath>

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
    : layout_(motions.front()) {
  for (const Axis& axis : axes) {
    Eigen::VectorXd knots(static_cast<Eigen::Index>(axis.values.size()));
    for (std::size_t i = 0; i < axis.values.size(); ++i)
      knots[static_cast<Eigen::Index>(i)] = axis.logarithmic ? std::log(axis.values[i]) : axis.values[i];
    logarithmic_.push_back(axis.logarithmic);
    splines_.emplace_back(std::move(knots));
  }
  Eigen::Index size = 0;
  for_each_block(layout_, [&](const double*, Eigen::Index count) { size += count; });
  const auto points = std::make_shared<Eigen::MatrixXd>(size, static_cast<Eigen::Index>(motions.size()));
  for (std::size_t c = 0; c < motions.size(); ++c) {
    double* to = points->col(static_cast<Eigen::Index>(c)).data();
    for_each_block(motions[c],
                   [&](const double* from, Eigen::Index count) { to = std::copy(from, from + count, to); });
  }
  points_ = points;
}

MotionInterpolant MotionInterpolant::slice(double value) const {
  MotionInterpolant rest;
  rest.logarithmic_.assign(logarithmic_.begin() + 1, logarithmic_.end());
  rest.splines_.assign(splines_.begin() + 1, splines_.end());
  rest.layout_ = layout_;
  const Eigen::RowVectorXd weights = splines_.front().weights(logarithmic_.front() ? std::log(value) : value);
  const Eigen::Index columns = points_->cols() / weights.size();
  const auto points = std::make_shared<Eigen::MatrixXd>(Eigen::MatrixXd::Zero(points_->rows(), columns));
  for (Eigen::Index i = 0; i < weights.size(); ++i)
    if (weights[i] != 0) *points += weights[i] * points_->middleCols(i * columns, columns);
  rest.points_ = points;
  return rest;
}

Motion MotionInterpolant::at(const std::vector<double>& values) const {
  if (values.empty()) return motion();
  MotionInterpolant surface = slice(values.front());
  for (std::size_t k = 1; k < values.size(); ++k) surface = surface.slice(values[k]);
  return surface.motion();
}

Motion MotionInterpolant::motion() const {
  Motion motion = layout_;
  const double* from = points_->data();
  for_each_block(motion, [&](double* to, Eigen::Index count) {
    std::copy(from, from + count, to);
    from += count;
  });
  return motion;
}

}  // namespace flash::sysid
