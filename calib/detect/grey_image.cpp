#include "calib/detect/grey_image.h"

#include <algorithm>
#include <bit>
#include <opencv2/imgcodecs.hpp>

#include "calib/detect/cut_off_picture.h"
#include "data/camera/png_reader.h"
#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/text.h"

namespace flash::calib {

namespace {

/// Sixteen bits a pixel, of which cameras of ten or twelve bits fill the lower ones: the eight highest that
/// are in use.
std::vector<std::uint8_t> highest_bits(const std::vector<std::uint8_t>& big_endian) {
  const auto at = [&](std::size_t i) { return 256U * big_endian[2 * i] + big_endian[2 * i + 1]; };
  const std::size_t pixels = big_endian.size() / 2;
  unsigned most = 0;
  for (std::size_t i = 0; i < pixels; ++i) most = std::max(most, at(i));
  const int shift = std::max(0, static_cast<int>(std::bit_width(most)) - 8);
  std::vector<std::uint8_t> bytes(pixels);
  for (std::size_t i = 0; i < pixels; ++i) bytes[i] = static_cast<std::uint8_t>(at(i) >> shift);
  return bytes;
}

}  // namespace

GreyImage load_grey_image(const std::string& path) {
  const std::string file = data::read_file(path);
  if (file.starts_with("\x89PNG")) {  // whose decoder would tell the terminal what is wrong
    data::RawPng png;
    try {
      constexpr std::size_t kDepth = 24, kColour = 25;  // in the header: bits a sample; 0: grey
      if (file.size() > kColour && file[kDepth] == 16 && file[kColour] == 0) {
        png = data::read_png(path, data::PngSamples::as_stored);
        return {png.width, png.height, highest_bits(png.bytes)};
      }
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
