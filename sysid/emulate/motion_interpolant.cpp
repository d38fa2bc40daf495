#include "sysid/emulate/motion_interpolant.h"

#include <cmath>
#include <utility>

#include "data/machine/parallel.h"

namespace flash::sysid {
namespace {

/// Calls `use` with every array of numbers of a motion, in one order.
template <class Use>
void for_each_block(const Motion& motion, const Use& use) {
  for (const auto& positions : motion.positions) use(positions.data(), positions.size());
  for (const auto& force : motion.forces) use(force.data(), force.size());
}

}  // namespace

MotionInterpolant::MotionInterpolant(const std::vector<Axis>& axes, const std::vector<Motion>& motions,
                                     int threads)
    : layout_(std::make_shared<const Motion>(motions.front())) {
  for (const Axis& axis : axes) {
    Eigen::VectorXd knots(static_cast<Eigen::Index>(axis.values.size()));
    for (std::size_t i = 0; i < axis.values.size(); ++i)
      knots[static_cast<Eigen::Index>(i)] = axis.logarithmic ? std::log(axis.values[i]) : axis.values[i];
    logarithmic_.push_back(axis.logarithmic);
    splines_.emplace_back(std::move(knots));
  }
  Eigen::Index size = 0;
  const auto take = [&](Eigen::Index count) {
    rows_.emplace_back(size, count);
    size += count;
  };
  for (const data::Points& positions : layout_->positions) take(positions.size());
  take(static_cast<Eigen::Index>(3 * layout_->forces.size()));
  const auto points = std::make_shared<Eigen::MatrixXd>(size, static_cast<Eigen::Index>(motions.size()));
  data::for_each_in_parallel(motions.size(), threads, [&](std::size_t c) {
    double* to = points->col(static_cast<Eigen::Index>(c)).data();
    for_each_block(motions[c],
                   [&](const double* from, Eigen::Index count) { to = std::copy(from, from + count, to); });
  });
  points_ = points;
}

Eigen::MatrixXd MotionInterpolant::weights(const std::vector<std::vector<double>>& points) const {
  Eigen::MatrixXd weights(points_->cols(), static_cast<Eigen::Index>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i) {
    Eigen::VectorXd all = Eigen::VectorXd::Ones(1);
    for (std::size_t k = 0; k < splines_.size(); ++k) {
      const double value = points[i][k];
      const Eigen::RowVectorXd of_axis = splines_[k].weights(logarithmic_[k] ? std::log(value) : value);
      const Eigen::MatrixXd product = of_axis.transpose() * all.transpose();  // the last axis fastest
      all = product.reshaped();
    }
    weights.col(static_cast<Eigen::Index>(i)) = all;
  }
  return weights;
}

Eigen::MatrixXd MotionInterpolant::numbers(std::size_t step, const Eigen::MatrixXd& weights) const {
  const auto [first, count] = rows_[step];
  // At a point of the grid a single column counts.
  if (weights.cols() == 1 && (weights.array() != 0).count() == 1) {
    Eigen::Index only;
    weights.col(0).cwiseAbs().maxCoeff(&only);
    return weights(only, 0) * points_->col(only).segment(first, count);
  }
  return points_->middleRows(first, count) * weights;
}

Motion MotionInterpolant::without_numbers() const {
  return {layout_->start, layout_->step,
          std::vector<data::Points>(layout_->positions.size(), data::Points(0, 3)),
          std::vector<Eigen::Vector3d>(layout_->forces.size())};
}

void set_step(Motion& motion, std::size_t step, const Eigen::Ref<const Eigen::VectorXd>& numbers) {
  if (step < motion.positions.size())
    motion.positions[step] = Eigen::Map<const data::Points>(numbers.data(), numbers.size() / 3, 3);
  else
    for (std::size_t i = 0; i < motion.forces.size(); ++i)
      motion.forces[i] = numbers.segment<3>(static_cast<Eigen::Index>(3 * i));
}

std::vector<Motion> MotionInterpolant::at_points(const std::vector<std::vector<double>>& points,
                                                 int threads) const {
  const Eigen::MatrixXd weights = this->weights(points);
  std::vector<Motion> motions(points.size(), without_numbers());
  data::for_each_in_parallel(rows_.size(), threads, [&](std::size_t step) {
    const Eigen::MatrixXd numbers = this->numbers(step, weights);
    for (std::size_t i = 0; i < points.size(); ++i)
      set_step(motions[i], step, numbers.col(static_cast<Eigen::Index>(i)));
  });
  return motions;
}

Motion MotionInterpolant::at(const std::vector<double>& values) const {
  return std::move(at_points({values}).front());
}

}  // namespace flash::sysid
