#pragma once
#include <algorithm>
#include <cmath>
#include <memory>

#include "sim/cuda/batch_replay.h"

namespace flash::sim::cuda {

/// The vertices within 2 cm of a corner rise 0.25 m in 1.5 s, by minimum jerk, and stay there.
inline std::shared_ptr<const HoldMotion> corner_lift(const data::Points& rest, int steps, double time_step) {
  auto motion = std::make_shared<HoldMotion>(static_cast<std::size_t>(steps));
  const Eigen::RowVector3d corner = rest.colwise().minCoeff();
  for (int k = 0; k < steps; ++k) {
    const double s = std::min(1.0, (k + 1) * time_step / 1.5);
    const Eigen::Vector3d way(0, 0, 0.25 * s * s * s * (10 + s * (6 * s - 15)));
    for (int i = 0; i < rest.rows(); ++i)
      if ((rest.row(i) - corner).norm() <= 0.02)
        (*motion)[static_cast<std::size_t>(k)].push_back(
            {i, {true, true, true}, rest.row(i).transpose() + way});
  }
  return motion;
}

}  // namespace flash::sim::cuda
