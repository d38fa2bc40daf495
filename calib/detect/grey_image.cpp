#include "calib/detect/grey_image.h"

#include <algorithm>
#include <opencv2/imgcodecs.hpp>

#include "data/atomic_file.h"
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

}  // namespace flash::calib
