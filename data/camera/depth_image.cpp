#include "data/camera/depth_image.h"

#include <png.h>

#include <csetjmp>

#include "data/camera/png_reader.h"
#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/text.h"

namespace flash::data {
namespace {

struct WriteState {
  std::string message;
};

void keep_message(png_structp png, png_const_charp message) {
  static_cast<WriteState*>(png_get_error_ptr(png))->message = message;
  png_longjmp(png, 1);
}

void ignore_warning(png_structp, png_const_charp) {}

void append_bytes(png_structp png, png_bytep bytes, std::size_t size) {
  static_cast<std::string*>(png_get_io_ptr(png))->append(reinterpret_cast<const char*>(bytes), size);
}

void flush_nothing(png_structp) {}

bool encode(png_structp png, png_infop info, int width, int height, int bit_depth,
            std::vector<png_bytep>& rows) {
  if (setjmp(png_jmpbuf(png))) return false;
  png_set_IHDR(png, info, static_cast<png_uint_32>(width), static_cast<png_uint_32>(height), bit_depth,
               PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
               PNG_FILTER_TYPE_DEFAULT);
  png_write_info(png, info);
  png_write_image(png, rows.data());
  png_write_end(png, nullptr);
  return true;
}

void save_png(int width, int height, int bit_depth, std::vector<std::uint8_t> bytes,
              const std::string& path) {
  WriteState state;
  std::string file;
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &state, keep_message, ignore_warning);
  png_infop info = png_create_info_struct(png);
  png_set_write_fn(png, &file, append_bytes, flush_nothing);
  std::vector<png_bytep> rows(static_cast<std::size_t>(height));
  const std::size_t stride = static_cast<std::size_t>(width) * static_cast<std::size_t>(bit_depth / 8);
  for (std::size_t y = 0; y < rows.size(); ++y) rows[y] = bytes.data() + y * stride;
  const bool done = encode(png, info, width, height, bit_depth, rows);
  png_destroy_write_struct(&png, &info);
  if (!done) throw InputError(path + ": PNG cannot be encoded: " + state.message);
  write_atomically(path, file);
}

}  // namespace

DepthImage load_depth_image(const std::string& path) {
  const RawPng raw = read_png(path, PngSamples::as_stored);
  if (raw.bit_depth != 16 || raw.channels != 1)
    throw InputError(path + ": found " + std::to_string(raw.bit_depth) + " bits in " +
                     std::to_string(raw.channels) + " channels, expected 16-bit grey depth");
  DepthImage image{raw.width, raw.height, std::vector<std::uint16_t>(raw.bytes.size() / 2)};
  for (std::size_t i = 0; i < image.pixels.size(); ++i)
    image.pixels[i] = static_cast<std::uint16_t>(raw.bytes[2 * i] << 8 | raw.bytes[2 * i + 1]);
  return image;
}

void save_depth_image(const DepthImage& image, const std::string& path) {
  std::vector<std::uint8_t> bytes;
  bytes.reserve(2 * image.pixels.size());
  for (const std::uint16_t pixel : image.pixels) {
    bytes.push_back(static_cast<std::uint8_t>(pixel >> 8));
    bytes.push_back(static_cast<std::uint8_t>(pixel & 0xff));
  }
  save_png(image.width, image.height, 16, std::move(bytes), path);
}

MaskImage load_mask(const std::string& path) {
  const RawPng raw = read_png(path, PngSamples::eight_bits);
  const std::size_t channels = static_cast<std::size_t>(raw.channels);
  MaskImage image{raw.width, raw.height, std::vector<std::uint8_t>(raw.bytes.size() / channels)};
  for (std::size_t i = 0; i < raw.bytes.size(); ++i)
    if (raw.bytes[i] > 0) image.pixels[i / channels] = 255;
  return image;
}

void save_mask(const MaskImage& image, const std::string& path) {
  save_png(image.width, image.height, 8, image.pixels, path);
}

}  // namespace flash::data
