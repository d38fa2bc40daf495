#pragma once
#include <Eigen/Core>
#include <vector>

#include "data/camera/camera.h"

namespace flash::calib {

/// Between pixels as the lens draws them and rectified pixels, those of the same camera without distortion,
/// in which straight things are straight. Tabulated for every pixel: shapes are fitted on the untouched pixel
/// values, at rectified places.
class Rectifier {
 public:
  /// Of a camera that is not known: pixels are taken as they are.
  Rectifier(int width, int height);
  explicit Rectifier(const data::CameraIntrinsics& camera);

  int width() const { return camera_.width; }
  int height() const { return camera_.height; }

  /// Of a whole pixel inside of the picture.
  Eigen::Vector2d at(int x, int y) const {
    if (table_.empty()) return {x, y};
    return table_[static_cast<std::size_t>(y) * static_cast<std::size_t>(camera_.width) +
                  static_cast<std::size_t>(x)]
        .cast<double>();
  }
  Eigen::Vector2d rectified(const Eigen::Vector2d& pixel) const;
  Eigen::Vector2d distorted(const Eigen::Vector2d& rectified) const;

 private:
  data::CameraIntrinsics camera_;
  std::vector<Eigen::Vector2f> table_;  ///< row by row; empty without distortion
};

}  // namespace flash::calib
