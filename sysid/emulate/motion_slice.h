#pragma once
#include <atomic>
#include <memory>
#include <mutex>
#include <vector>

#include "sysid/emulate/two_mesh_motions.h"

namespace flash::sysid {

/// A MotionInterpolant with its first axes held at values: cheap where many points share them. A step is
/// worked out when it is first asked for, so that steps that no keyframe reads take nothing. Several threads
/// may ask.
class MotionSlice {
 public:
  using Block = Eigen::Ref<const Eigen::MatrixXd, 0, Eigen::OuterStride<>>;

  MotionSlice() = default;

  /// No axis held; `whole` outlives it.
  void take(const MotionInterpolant& whole);

  /// The first axis that `parent` does not hold held at `value` too. `parent` outlives it; memory that it
  /// has is used again.
  void hold(const MotionSlice& parent, double value);

  const Motion& layout() const { return *whole_->layout_; }

  /// Positions at a step, column by column, where every axis is held; or with steps as `step` the forces.
  Block step(std::size_t step) const;

 private:
  struct Step {
    std::atomic<bool> done = false;
    std::mutex being_done;
    Eigen::MatrixXd numbers;  ///< one column a point of the axes that are not held
  };

  const MotionInterpolant* whole_ = nullptr;
  const MotionSlice* parent_ = nullptr;
  std::size_t held_ = 0;        // axes
  Eigen::RowVectorXd weights_;  // of the axis held last
  mutable std::vector<Step> steps_;
};

/// TwoMeshMotions with its first axes held at values.
class TwoMeshSlice {
 public:
  /// No axis held; `whole` outlives it.
  void take(const TwoMeshMotions& whole);

  /// See MotionSlice::hold.
  void hold(const TwoMeshSlice& parent, double value);

  /// A motion without positions.
  Motion empty() const;

  /// Positions at a step where every axis is held, `share` as in TwoMeshMotions; empty where no motion has
  /// them.
  void positions(std::size_t step, double share, data::Points& positions) const;

  /// Forces where every axis is held.
  void forces(double share, std::vector<Eigen::Vector3d>& forces) const;

 private:
  const TwoMeshMotions* whole_ = nullptr;
  MotionSlice coarse_, difference_;
};

}  // namespace flash::sysid
