#pragma once
#include <Eigen/Geometry>
#include <vector>

#include "calib/dataset/observation.h"
#include "calib/dataset/target_shape.h"
#include "calib/geometry/projection.h"

namespace flash::calib {

/// A lens, the warp of the target it was seen through (target_bows), by how much the target's edges stand
/// outwards (EdgeOffset) and where the target stood in each view.
struct LensFit {
  IntrinsicsVector lens = IntrinsicsVector::Zero();
  Warp warp = Warp::Zero();  ///< [m]
  double edge_offset = 0;    ///< of views with corners of edges [px]
  std::vector<Eigen::Isometry3d> poses;
  double variance = 0;         ///< of a corner's coordinate, from the residuals [px^2]
  Eigen::MatrixXd covariance;  ///< of the unknowns in use, then of the warp and of the offset; poses
                               ///< marginalised, as far as views disagree (view_factor)
  double view_factor = 1;      ///< by how much it is larger than corners by themselves would make it
};

/// Least squares of the reprojection from a start that is near, by Gauss and Newton with the poses
/// eliminated. unknowns: places in `lens` that may change. Warp and offset are held by what is usual
/// (usual_warp_sd, kUsualEdgeOffset).
///
/// Corners of one view share errors that no corner shows: of the print, of light and blur, of the lens's
/// model. So the covariance is raised by how much views disagree beyond their corners
/// (data::jackknife_factor).
LensFit fit_lens(LensFit start, const std::vector<int>& unknowns, const Eigen::Matrix3Xd& points,
                 const std::vector<const Observation*>& views);

/// Seen minus projected of one view [px], 2 x N.
Eigen::Matrix2Xd residuals(const LensFit& fit, std::size_t view, const Eigen::Matrix3Xd& points,
                           const Observation& seen);

}  // namespace flash::calib
