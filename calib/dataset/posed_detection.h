#pragma once
#include <vector>

#include "calib/dataset/detection.h"
#include "data/camera/camera.h"

namespace flash::calib {

/// Which corners are those of the target.
struct FitSettings {
  double largest_rms = 10;   ///< a view whose pose fits no better shows no target [px]
  double largest_ratio = 6;  ///< nor one worse than that many times the usual view of the set, above 2 px
};

/// The poses of each reading that fit it through this lens. Readings that no pose fits are dropped; a
/// detection without any says why.
void add_poses(const data::CameraIntrinsics& camera, const Eigen::Matrix3Xd& target_points,
               const FitSettings& settings, Detection& detection);

/// Empties the detections that fit far worse than the usual one of the set, and says why: they show wrong
/// corners.
void drop_misfits(const FitSettings& settings, std::vector<Detection>& detections);

}  // namespace flash::calib
