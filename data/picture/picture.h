#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace flash::data {

using Colour = std::array<std::uint8_t, 3>;  ///< red, green, blue

/// An RGB picture, row by row from the top.
struct Picture {
  int width = 0, height = 0;  ///< [px]
  std::vector<Colour> pixels;

  Picture(int width_px, int height_px, Colour background)
      : width(width_px),
        height(height_px),
        pixels(static_cast<std::size_t>(width_px) * height_px, background) {}
  Colour& at(int column, int row) { return pixels[static_cast<std::size_t>(row) * width + column]; }
  const Colour& at(int column, int row) const {
    return pixels[static_cast<std::size_t>(row) * width + column];
  }
};

/// The bytes of a PNG file.
std::string encode_png(const Picture& picture);

/// Written atomically. Throws std::runtime_error naming the path.
void save_png(const Picture& picture, const std::string& path);

}  // namespace flash::data
