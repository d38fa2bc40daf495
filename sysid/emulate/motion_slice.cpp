#include "sysid/emulate/motion_slice.h"

#include <cmath>

namespace flash::sysid {

void MotionSlice::take(const MotionInterpolant& whole) {
  whole_ = &whole;
  parent_ = nullptr;
  held_ = 0;
}

void MotionSlice::hold(const MotionSlice& parent, double value) {
  whole_ = parent.whole_;
  parent_ = &parent;
  held_ = parent.held_ + 1;
  weights_ =
      whole_->splines_[parent.held_].weights(whole_->logarithmic_[parent.held_] ? std::log(value) : value);
  const std::size_t count = layout().positions.size() + 1;
  if (steps_.size() != count) steps_ = std::vector<Step>(count);
  for (Step& step : steps_) step.done = false;
}

MotionSlice::Block MotionSlice::step(std::size_t i) const {
  if (parent_ == nullptr) return whole_->points_->middleRows(whole_->rows_[i].first, whole_->rows_[i].second);
  Step& step = steps_[i];
  if (step.done.load(std::memory_order_acquire)) return step.numbers;
  const std::scoped_lock lock(step.being_done);
  if (step.done.load(std::memory_order_relaxed)) return step.numbers;
  const Block from = parent_->step(i);
  const Eigen::Index columns = from.cols() / weights_.size();
  step.numbers.resize(from.rows(), columns);
  for (Eigen::Index j = 0; j < columns; ++j) {
    // Columns of the points that differ in the axis held.
    const Eigen::Map<const Eigen::MatrixXd, 0, Eigen::OuterStride<>> along(
        from.data() + j * from.outerStride(), from.rows(), weights_.size(),
        Eigen::OuterStride<>(columns * from.outerStride()));
    auto to = step.numbers.col(j);
    if (weights_.size() == 3)  // as many values an axis as most searches have: in one pass
      to = weights_[0] * along.col(0) + weights_[1] * along.col(1) + weights_[2] * along.col(2);
    else
      to.noalias() = along * weights_.transpose();
  }
  step.done.store(true, std::memory_order_release);
  return step.numbers;
}

void TwoMeshSlice::take(const TwoMeshMotions& whole) {
  whole_ = &whole;
  coarse_.take(whole.coarse_);
  if (whole.difference_) difference_.take(*whole.difference_);
}

void TwoMeshSlice::hold(const TwoMeshSlice& parent, double value) {
  whole_ = parent.whole_;
  coarse_.hold(parent.coarse_, value);
  if (whole_->difference_) difference_.hold(parent.difference_, value);
}

Motion TwoMeshSlice::empty() const {
  const Motion& layout = coarse_.layout();
  return {layout.start, layout.step, std::vector<data::Points>(layout.positions.size(), data::Points(0, 3))};
}

void TwoMeshSlice::positions(std::size_t step, double share, data::Points& positions) const {
  const auto as_points = [](const MotionSlice::Block& numbers) {
    return Eigen::Map<const data::Points>(numbers.data(), numbers.rows() / 3, 3);
  };
  const auto coarse = as_points(coarse_.step(step));
  if (!whole_->difference_ || coarse.rows() == 0) {
    positions = coarse;
    return;
  }
  positions.noalias() = *whole_->prolongation_ * coarse;
  if (share != 0) positions += share * as_points(difference_.step(step));
}

void TwoMeshSlice::forces(double share, std::vector<Eigen::Vector3d>& forces) const {
  const std::size_t last = coarse_.layout().positions.size();
  forces.resize(coarse_.layout().forces.size());
  if (forces.empty()) return;
  Eigen::Map<Eigen::VectorXd> all(forces.front().data(), static_cast<Eigen::Index>(3 * forces.size()));
  all = coarse_.step(last).col(0);
  if (whole_->difference_ && share != 0) all += share * difference_.step(last).col(0);
}

}  // namespace flash::sysid
