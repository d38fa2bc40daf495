#pragma once
#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "calib/dataset/observation.h"
#include "calib/dataset/target.h"
#include "calib/dataset/target_shape.h"
#include "calib/geometry/closed_form.h"
#include "calib/solve/pose_space.h"
#include "data/camera/camera.h"

namespace flash::calib {

/// Where the chain through robot and calibration puts the target of one view, against where it is seen.
struct ViewProjection {
  std::string image;
  std::vector<int> points;     ///< the points seen, as numbered by what fits best
  Eigen::Matrix2Xd projected;  ///< the same, through forward kinematics and extrinsics [px]
  double corner_rms = 0;       ///< 2-D rms per corner [px]
  double centre = 0;  ///< distance of the target's projected middle from that of the view's own pose [px]
  double mm = 0, deg = 0;  ///< of the middle, and of the orientation, against the view's own pose
};

struct ProjectionCheck {
  std::vector<ViewProjection> views;
  double corner_rms = 0, centre_rms = 0;  ///< over all corners and over all views [px]
  double mm_rms = 0, deg_rms = 0;
};

/// Projects corners and middle of the target through the chain. Nothing is fitted; where a target can be
/// numbered in several ways, the numbering that fits a view best counts. Views without pixels (pose pairs)
/// have px 0. shape: of the target; the views' own poses are for it, and for this camera. edge_offset: of its
/// pictures [px].
ProjectionCheck check_projection(Setup setup, const HandEyePoses& poses, const data::CameraIntrinsics& camera,
                                 const Target& target, const std::vector<Observation>& observations,
                                 const TargetShape& shape = {}, double edge_offset = 0);

/// The views with their own poses fitted anew, of a target of that shape through that lens.
std::vector<Observation> with_poses_for(const data::CameraIntrinsics& camera, const Target& target,
                                        const TargetShape& shape, std::vector<Observation> observations,
                                        double edge_offset = 0);

/// Pairs of poses as they are seen with these scales.
std::vector<Observation> with_scales(std::vector<Observation> pairs, const SeenScales& scales);

/// T_base_target (eye-in-hand) or T_gripper_target as the mean over the views, for a target that was moved
/// since.
Eigen::Isometry3d target_pose_from(Setup setup, const Eigen::Isometry3d& X,
                                   const std::vector<Observation>& observations);

}  // namespace flash::calib
