#pragma once
#include <Eigen/Geometry>
#include <random>
#include <vector>

#include "calib/dataset/target.h"
#include "calib/detect/grey_image.h"
#include "calib/detect/rectifier.h"
#include "data/camera/camera.h"

namespace flash::calib {

struct RenderSettings {
  double black = 35, white = 215;  ///< of the print, of 255
  double background = 120;         ///< around it
  double blur = 0.7;               ///< of the lens, sigma [px]
  double gamma = 1;                ///< pixels are light to the power of 1 / gamma; noise is added to them
  double noise = 2;                ///< of a pixel, sigma
  int samples = 16;                ///< a side of a pixel that an edge crosses
  bool double_border = false;      ///< aprilgrid as Kalibr prints it
  double dots = 0;  ///< a projector's dots, fixed to the camera: light on the dot over other light
};

/// Draws a target as a camera sees it. The print is described by its own words here, not by target_points:
/// brightness of a place on the plane; a pixel is the mean over its square, blurred, with noise, rounded.
class Renderer {
 public:
  Renderer(const Target& target, const data::CameraIntrinsics& camera, const RenderSettings& settings = {});

  GreyImage draw(const Eigen::Isometry3d& T_camera_target, std::mt19937& random) const;

  /// What falls on the sensor while the target goes through poses that are evenly spaced in time.
  GreyImage draw(const std::vector<Eigen::Isometry3d>& T_camera_target, std::mt19937& random) const;

  /// Depth along the optical axis, of the plane of the target where the print is seen; zero beside it [m].
  std::vector<double> depth(const Eigen::Isometry3d& T_camera_target) const;

  /// 0 black, 1 white, -1 beside the print, at a place on the plane [m].
  double shade(double x, double y) const;

 private:
  std::vector<double> light(const Eigen::Isometry3d& T_camera_target) const;  ///< of each pixel, sharp
  double board_shade(double x, double y) const;
  double marker_shade(int index, double u, double v) const;
  Eigen::Vector2d ray(double x, double y) const;

  Target target_;
  data::CameraIntrinsics camera_;
  RenderSettings settings_;
  Eigen::AlignedBox2d print_;
  std::vector<std::vector<int>> markers_;  ///< modules of each, row by row, 1 white; border included
  int modules_ = 0;                        ///< a side of a marker
  std::vector<Eigen::Vector2d> rays_;      ///< at the corners of all pixels
};

/// A pose from which the whole target is seen: distance [m], tilt up to `tilt` [rad], any roll, the middle of
/// the target near the middle of the picture.
Eigen::Isometry3d random_view(const Target& target, const data::CameraIntrinsics& camera,
                              double least_distance, double most_distance, double tilt, std::mt19937& random);

/// 640 x 480, f = 615 px.
data::CameraIntrinsics small_camera();

}  // namespace flash::calib
