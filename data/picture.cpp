#include "data/picture.h"

#include <png.h>

#include <stdexcept>

#include "data/atomic_file.h"

namespace flash::data {

void save_png(const Picture& picture, const std::string& path) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(picture.width);
  image.height = static_cast<png_uint_32>(picture.height);
  image.format = PNG_FORMAT_RGB;
  png_alloc_size_t size = 0;
  // The first call only asks for the size.
  if (!png_image_write_to_memory(&image, nullptr, &size, 0, picture.pixels.data(), 0, nullptr))
    throw std::runtime_error(path + ": " + image.message);
  std::string bytes(size, '\0');
  if (!png_image_write_to_memory(&image, bytes.data(), &size, 0, picture.pixels.data(), 0, nullptr))
    throw std::runtime_error(path + ": " + image.message);
  bytes.resize(size);
  write_atomically(path, bytes);
}

}  // namespace flash::data
