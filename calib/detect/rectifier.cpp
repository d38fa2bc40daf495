#include "calib/detect/rectifier.h"

namespace flash::calib {

Rectifier::Rectifier(int width, int height) {
  camera_.width = width;
  camera_.height = height;
}

Rectifier::Rectifier(const data::CameraIntrinsics& camera) : camera_(camera) {
  if (camera.model == data::DistortionModel::none) return;
  table_.reserve(static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height));
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x)
      table_.emplace_back(rectified(Eigen::Vector2d(x, y)).cast<float>());
}

Eigen::Vector2d Rectifier::rectified(const Eigen::Vector2d& pixel) const {
  if (camera_.model == data::DistortionModel::none) return pixel;
  const Eigen::Vector3d ray = data::unproject(camera_, pixel, 1);
  return {camera_.fx * ray.x() + camera_.cx, camera_.fy * ray.y() + camera_.cy};
}

Eigen::Vector2d Rectifier::distorted(const Eigen::Vector2d& rectified) const {
  if (camera_.model == data::DistortionModel::none) return rectified;
  const Eigen::Vector3d ray((rectified.x() - camera_.cx) / camera_.fx,
                            (rectified.y() - camera_.cy) / camera_.fy, 1);
  return *data::project(camera_, ray);
}

}  // namespace flash::calib
