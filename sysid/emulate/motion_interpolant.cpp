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

MotionInterpolant MotionInterpolant::slice(double value) const {
  MotionInterpolant rest;
  slice(value, rest);
  return rest;
}

void MotionInterpolant::slice(double value, MotionInterpolant& rest) const {
  rest.logarithmic_.assign(logarithmic_.begin() + 1, logarithmic_.end());
  rest.splines_.assign(splines_.begin() + 1, splines_.end());
  rest.layout_ = layout_;
  const Eigen::RowVectorXd weights = splines_.front().weights(logarithmic_.front() ? std::log(value) : value);
  const Eigen::Index columns = points_->cols() / weights.size();
  if (rest.points_.use_count() != 1 || rest.points_->rows() != points_->rows() ||
      rest.points_->cols() != columns)
    rest.points_ = std::make_shared<Eigen::MatrixXd>(points_->rows(), columns);
  for (Eigen::Index j = 0; j < columns; ++j) {
    auto sum = rest.points_->col(j);
    sum = weights[0] * points_->col(j);
    for (Eigen::Index i = 1; i < weights.size(); ++i)
      if (weights[i] != 0) sum += weights[i] * points_->col(i * columns + j);
  }
}

Motion MotionInterpolant::zero() const {
  Motion motion{layout_->start, layout_->step, {}};
  motion.positions.reserve(layout_->positions.size());
  for (const data::Points& positions : layout_->positions)
    motion.positions.emplace_back(data::Points::Zero(positions.rows(), 3));
  motion.forces.assign(layout_->forces.size(), Eigen::Vector3d::Zero());
  return motion;
}

Motion MotionInterpolant::at(const std::vector<double>& values) const {
  Motion motion = zero();
  add_to(motion, values, 1);
  return motion;
}

void MotionInterpolant::add_to(Motion& motion, const std::vector<double>& values, double share) const {
  if (values.size() > 1) {
    MotionInterpolant rest = slice(values.front());
    for (std::size_t k = 1; k + 1 < values.size(); ++k) rest = rest.slice(values[k]);
    return rest.add_to(motion, {values.back()}, share);
  }
  // The sum over the last axis, without a slice between.
  const Eigen::RowVectorXd weights =
      values.empty() ? Eigen::RowVectorXd::Ones(1)
                     : splines_.front().weights(logarithmic_.front() ? std::log(values[0]) : values[0]);
  Eigen::Index first = 0;
  for_each_block(motion, [&](double* to, Eigen::Index count) {
    Eigen::Map<Eigen::VectorXd> sum(to, count);
    for (Eigen::Index i = 0; i < weights.size(); ++i)
      if (weights[i] != 0) sum += share * weights[i] * points_->col(i).segment(first, count);
    first += count;
  });
}

MotionInterpolant MotionInterpolant::only(const std::vector<bool>& steps) const {
  MotionInterpolant part = *this;
  Motion layout = *layout_;
  std::vector<std::pair<Eigen::Index, Eigen::Index>> kept;  // first row and count, of this
  Eigen::Index first = 0, rows = 0;
  for (std::size_t i = 0; i < layout.positions.size(); ++i) {
    const Eigen::Index count = layout.positions[i].size();
    if (steps[i])
      kept.emplace_back(first, count);
    else
      layout.positions[i].resize(0, 3);
    first += count;
  }
  kept.emplace_back(first, points_->rows() - first);  // the forces
  for (const auto& [from, count] : kept) rows += count;
  const auto points = std::make_shared<Eigen::MatrixXd>(rows, points_->cols());
  Eigen::Index to = 0;
  for (const auto& [from, count] : kept) {
    points->middleRows(to, count) = points_->middleRows(from, count);
    to += count;
  }
  part.points_ = points;
  part.layout_ = std::make_shared<const Motion>(std::move(layout));
  return part;
}

}  // namespace flash::sysid
