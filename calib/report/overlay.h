#pragma once
#include <Eigen/Core>

#include "calib/detect/grey_image.h"
#include "data/picture/picture.h"

namespace flash::calib {

struct CornerPictureSettings {
  int width = 560;        ///< of the picture [px]
  double margin = 0.35;   ///< around the target, as a share of its size
  double magnified = 20;  ///< residuals are drawn that many times longer
};

/// The part of a photograph that shows the target: detected corners (green rings), where the calibration
/// projects them (red crosses), and the differences, magnified (yellow). Both 2 x N, distorted pixels.
data::Picture corner_picture(const GreyImage& image, const Eigen::Matrix2Xd& detected,
                             const Eigen::Matrix2Xd& projected, const CornerPictureSettings& settings = {});

}  // namespace flash::calib
