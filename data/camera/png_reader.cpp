#include "data/camera/png_reader.h"

#include <png.h>

#include <csetjmp>
#include <cstring>
#include <string_view>

#include "data/camera/depth_image.h"
#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/text.h"

namespace flash::data {
namespace {

struct ReadState {
  std::string_view rest;
  std::string message;
};

void read_bytes(png_structp png, png_bytep out, std::size_t size) {
  auto& state = *static_cast<ReadState*>(png_get_io_ptr(png));
  if (state.rest.size() < size) png_error(png, "ends within its data");
  std::memcpy(out, state.rest.data(), size);
  state.rest.remove_prefix(size);
}

void keep_message(png_structp png, png_const_charp message) {
  static_cast<ReadState*>(png_get_error_ptr(png))->message = message;
  png_longjmp(png, 1);
}

void ignore_warning(png_structp, png_const_charp) {}

/// Everything that libpng may jump out of; no object with a destructor is made after setjmp.
bool decode(png_structp png, png_infop info, PngSamples samples, RawPng& image,
            std::vector<png_bytep>& rows) {
  if (setjmp(png_jmpbuf(png))) return false;
  png_read_info(png, info);
  if (samples != PngSamples::as_stored) {
    png_set_expand(png);
    png_set_strip_16(png);
    png_set_strip_alpha(png);
  }
  if (samples == PngSamples::grey) png_set_rgb_to_gray(png, PNG_ERROR_ACTION_NONE, 0.299, 0.587);
  png_set_interlace_handling(png);
  png_read_update_info(png, info);
  image.width = static_cast<int>(png_get_image_width(png, info));
  image.height = static_cast<int>(png_get_image_height(png, info));
  image.channels = png_get_channels(png, info);
  image.bit_depth = png_get_bit_depth(png, info);
  const std::size_t stride = png_get_rowbytes(png, info);
  image.bytes.resize(stride * static_cast<std::size_t>(image.height));
  rows.resize(static_cast<std::size_t>(image.height));
  for (std::size_t y = 0; y < rows.size(); ++y) rows[y] = image.bytes.data() + y * stride;
  png_read_image(png, rows.data());
  return true;
}

}  // namespace

void check_png_size(std::string_view file, const std::string& path) {
  constexpr std::uint64_t most_pixels = 256u << 20;
  constexpr std::size_t at = 16;  // signature, length and name of the chunk IHDR
  if (!file.starts_with("\x89PNG") || file.size() < at + 8) return;
  const auto number = [&](std::size_t begin) {
    std::uint64_t value = 0;
    for (std::size_t i = begin; i < begin + 4; ++i) value = value << 8 | static_cast<std::uint8_t>(file[i]);
    return value;
  };
  const std::uint64_t width = number(at), height = number(at + 4);
  if (width * height > most_pixels)
    throw InputError(path + ": found " + format_count(width) + " x " + format_count(height) +
                     " pixels, expected at most " + format_count(most_pixels) + " in all");
}

RawPng read_png(const std::string& path, PngSamples samples) {
  const std::string file = read_file(path);
  if (file.size() < 8 || png_sig_cmp(reinterpret_cast<png_const_bytep>(file.data()), 0, 8) != 0)
    throw InputError(path + ": not a PNG file");
  check_png_size(file, path);
  ReadState state{file, ""};
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &state, keep_message, ignore_warning);
  png_infop info = png_create_info_struct(png);
  png_set_read_fn(png, &state, read_bytes);
  RawPng image;
  std::vector<png_bytep> rows;
  const bool done = decode(png, info, samples, image, rows);
  png_destroy_read_struct(&png, &info, nullptr);
  if (!done) throw InputError(path + ": PNG cannot be decoded: " + state.message);
  return image;
}

}  // namespace flash::data
