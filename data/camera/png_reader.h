#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace flash::data {

/// What a PNG holds, as it is asked for.
struct RawPng {
  int width = 0, height = 0, channels = 0, bit_depth = 0;
  std::vector<std::uint8_t> bytes;  ///< rows without padding; samples of sixteen bits are big endian
};

enum class PngSamples {
  as_stored,
  eight_bits,  ///< a byte for each of grey or red, green and blue, without alpha
  grey         ///< one byte a pixel: 0.299, 0.587 and 0.114 of red, green and blue
};

/// Throws InputError naming the path where it is no PNG, is cut off, or promises more pixels than
/// check_png_size allows. Nothing is said on the terminal.
RawPng read_png(const std::string& path, PngSamples samples);

}  // namespace flash::data
