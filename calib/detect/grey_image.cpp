#include "calib/detect/grey_image.h"

#include <opencv2/imgcodecs.hpp>

#include "calib/detect/cut_off_picture.h"
#include "data/atomic_file.h"
#include "data/error.h"
#include "data/png_reader.h"
#include "data/text.h"

namespace flash::calib {

GreyImage load_grey_image(const std::string& path) {
  const std::string file = data::read_file(path);
  if (file.starts_with("\x89PNG")) {  // whose decoder would tell the terminal what is wrong
    data::RawPng png;
    try {
      png = data::read_png(path, data::PngSamples::grey);
    } catch (const data::InputError& error) {
      throw data::InputError(std::string(error.what()) + ", so it cannot be read as a picture");
    }
    return {png.width, png.height, std::move(png.bytes)};
  }
  if (is_cut_off_jpeg(file) || is_cut_off_bmp(file))
    throw data::InputError(path + ": the picture is cut off: found " + data::format_count(file.size()) +
                           " bytes, expected more; copy it anew");
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

std::string size_text(int width, int height) {
  return std::to_string(width) + " x " + std::to_string(height);
}

}  // namespace flash::calib
