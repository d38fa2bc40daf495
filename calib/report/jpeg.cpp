#include "calib/report/jpeg.h"

#include <opencv2/imgcodecs.hpp>

namespace flash::calib {

std::string encode_jpeg(const data::Picture& picture) {
  cv::Mat pixels(picture.height, picture.width, CV_8UC3);
  for (int y = 0; y < picture.height; ++y)
    for (int x = 0; x < picture.width; ++x) {
      const data::Colour& colour = picture.at(x, y);
      pixels.at<cv::Vec3b>(y, x) = {colour[2], colour[1], colour[0]};  // OpenCV's order
    }
  constexpr int kQuality = 72;
  std::vector<unsigned char> bytes;
  cv::imencode(".jpg", pixels, bytes, {cv::IMWRITE_JPEG_QUALITY, kQuality});
  return {bytes.begin(), bytes.end()};
}

}  // namespace flash::calib
