#pragma once
#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "calib/dataset/edge_offset.h"
#include "calib/dataset/observation.h"
#include "calib/dataset/target.h"
#include "calib/dataset/target_shape.h"
#include "calib/geometry/projection.h"
#include "data/camera/camera.h"

namespace flash::calib {

struct IntrinsicsSettings {
  data::DistortionModel model = data::DistortionModel::plumb_bob;
  double largest_ratio = 4;  ///< a view worse than that many times the usual one, and above 1 px, is left out
};

struct IntrinsicsView {
  std::string image;
  double rms = 0;      ///< reprojection, 2-D rms per corner [px]
  std::string reason;  ///< why it was left out; empty where it was not
};

/// A deviation of so much says that nothing is known: it is printed as "100 px or more".
inline constexpr double most_corner_sd = 100;  // [px]

/// A focal length that is known to no better than this share of it is no answer.
inline constexpr double most_focal_sd = 0.05;

struct IntrinsicsEstimate {
  data::CameraIntrinsics camera;
  IntrinsicsVector sd =
      IntrinsicsVector::Zero();  ///< standard deviations, from the residuals; poses marginalised
  LensCovariance covariance = LensCovariance::Zero();  ///< of which those are the diagonal
  WarpEstimate warp;                                   ///< of the target, solved for beside the lens
  std::optional<EdgeOffset> edges;                     ///< likewise, of a target with corners of edges
  double rms = 0;                                      ///< reprojection, 2-D rms per corner [px]
  double corner_sd = 0;  ///< of where the worst corner of the picture is projected, for a fixed ray; at most
                         ///< most_corner_sd [px]
  double view_factor = 1;  ///< by which views that disagree raised the covariance (LensFit)
  double coverage = 0;     ///< share of the picture within the outline of all corners
  double tilt = 0;         ///< largest angle between the target's normals of two views [rad]
  std::vector<IntrinsicsView> views;
  std::vector<std::string> warnings;  ///< what these pictures do not determine

  /// Whether the focal lengths are known to better than most_focal_sd.
  bool usable() const { return sd[0] <= most_focal_sd * camera.fx && sd[1] <= most_focal_sd * camera.fy; }
};

/// Camera from views of a flat target (Zhang 2000, by OpenCV), views that do not fit and copies left out;
/// then of one that is not quite flat (fit_lens). Points and pixels of the observations alone are used.
/// Throws data::InputError below three usable views.
IntrinsicsEstimate calibrate_intrinsics(const Target& target, const std::vector<Observation>& observations,
                                        int width, int height, const IntrinsicsSettings& settings = {});

}  // namespace flash::calib
