#pragma once
#include <Eigen/Core>
#include <vector>

#include "calib/solve/bundle_adjustment.h"
#include "calib/solve/reml.h"

namespace flash::calib {

/// Where the shared unknowns stand in the linearised problem; -1: not an unknown.
struct SharedColumns {
  std::vector<int> cameras, bases, targets;  ///< first of six, a right perturbation (dt, dtheta) each
  std::vector<int> intrinsics;               ///< first of Unknowns::intrinsics
  std::vector<int> scales, time_offsets, depth_scales;
  std::vector<int> warps;         ///< first of kWarp
  std::vector<int> edge_offsets;  ///< of cameras that see edges
  std::vector<int> joint_errors;  ///< first of as many as Bundle::joint_errors has
  int intrinsics_count = 0;       ///< of each camera
  int count = 0;
};
SharedColumns shared_columns(const Bundle& bundle, const Unknowns& unknowns);

/// Moves the shared unknowns by a step in those columns.
void move_shared(Bundle& bundle, const SharedColumns& columns, const Eigen::VectorXd& step);

/// Components of variance in this order: corners and depths of each camera, rotation and translation of each
/// arm.
std::vector<double> to_components(const NoiseLevels& noise);
NoiseLevels to_noise(const std::vector<double>& components, const NoiseLevels& like);

/// The bundle's residuals linearised at its present state, with the corners' robust weights at `noise`.
/// Groups are poses, whose own unknowns are their corrections (none where they are not unknowns).
LinearModel linearize(const Bundle& bundle, const NoiseLevels& noise, const BundleSettings& settings);

/// The part of one view alone: Gram matrix of [d_correction d_shared residual].
Eigen::MatrixXd corner_gram(const Bundle& bundle, const BundleView& view, const Unknowns& unknowns,
                            const SharedColumns& columns, double corner, double huber, double& count);

}  // namespace flash::calib
