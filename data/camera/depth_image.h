#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "data/camera/camera.h"
#include "data/mesh/mesh.h"

namespace flash::data {

/// Row by row from the upper left.
template <class Pixel>
struct Image {
  int width = 0, height = 0;
  std::vector<Pixel> pixels;

  Pixel& at(int x, int y) {
    return pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(x)];
  }
  const Pixel& at(int x, int y) const {
    return pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(x)];
  }
};

using DepthImage = Image<std::uint16_t>;  ///< counts along the optical axis; 0: nothing measured
using MaskImage = Image<std::uint8_t>;    ///< 0: not the object

/// Throws InputError where the header of a PNG promises more than 256 megapixels (2^28): a small file may
/// unpack to more than there is memory. `file` holds its bytes; any other format passes.
void check_png_size(std::string_view file, const std::string& path);

/// 16-bit grey PNG. Throws InputError where it is anything else: 8-bit depth has lost its precision.
DepthImage load_depth_image(const std::string& path);
void save_depth_image(const DepthImage& image, const std::string& path);

/// 1- or 8-bit PNG, grey, palette or colour; a pixel counts where any channel is above zero.
MaskImage load_mask(const std::string& path);
void save_mask(const MaskImage& image, const std::string& path);

}  // namespace flash::data
