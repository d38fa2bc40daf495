#include "calib/detect/rectifier.h"

#include <algorithm>
#include <opencv2/imgcodecs.hpp>

#include "data/atomic_file.h"
#include "data/depth_image.h"
#include "data/error.h"

namespace flash::calib {

namespace {

/// The decoder tells the terminal of a PNG that was cut off; here it is told to the user.
bool cut_off(const std::string& file) {
  return file.starts_with("\x89PNG") &&
         file.find("IEND", file.size() - std::min<std::size_t>(file.size(), 64)) == std::string::npos;
}

}  // namespace

GreyImage load_grey_image(const std::string& path) {
  const std::string file = data::read_file(path);
  data::check_png_size(file, path);
  if (cut_off(file)) throw data::InputError(path + ": cannot be read as a picture: it ends within its data");
  cv::Mat picture;
  try {
    picture = cv::imread(path, cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION);
  } catch (const cv::Exception&) {
    picture.release();
  }
  if (picture.empty()) throw data::InputError(path + ": cannot be read as a picture");
  GreyImage image;
  image.width = picture.cols;
  image.height = picture.rows;
  image.pixels.reserve(picture.total());
  for (int y = 0; y < picture.rows; ++y)
    image.pixels.insert(image.pixels.end(), picture.ptr(y), picture.ptr(y) + picture.cols);
  return image;
}

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
