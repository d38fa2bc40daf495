#include "data/files/tiff_reader.h"

#include <tiffio.h>

#include <cstdint>
#include <cstring>
#include <memory>

#include "data/files/error.h"

namespace flash::data {
namespace {

/// What libtiff says is no line of ours.
int say_nothing(TIFF*, void*, const char*, const char*, va_list) { return 1; }

struct Closed {
  void operator()(TIFF* tiff) const { TIFFClose(tiff); }
};

std::unique_ptr<TIFF, Closed> opened(const std::string& path) {
  TIFFOpenOptions* const options = TIFFOpenOptionsAlloc();
  TIFFOpenOptionsSetErrorHandlerExtR(options, say_nothing, nullptr);
  TIFFOpenOptionsSetWarningHandlerExtR(options, say_nothing, nullptr);
  std::unique_ptr<TIFF, Closed> tiff(TIFFOpenExt(path.c_str(), "r", options));
  TIFFOpenOptionsFree(options);
  return tiff;
}

template <class Number>
void append(const std::vector<unsigned char>& row, std::size_t width, std::vector<double>& values) {
  for (std::size_t x = 0; x < width; ++x) {
    Number value;
    std::memcpy(&value, row.data() + x * sizeof value, sizeof value);
    values.push_back(static_cast<double>(value));
  }
}

}  // namespace

GreyTiff read_tiff(const std::string& path) {
  const std::unique_ptr<TIFF, Closed> tiff = opened(path);
  if (!tiff) throw InputError(path + ": is no TIFF, or cannot be opened");
  std::uint32_t width = 0, height = 0;
  std::uint16_t bits = 0, channels = 1, format = SAMPLEFORMAT_UINT;
  TIFFGetField(tiff.get(), TIFFTAG_IMAGEWIDTH, &width);
  TIFFGetField(tiff.get(), TIFFTAG_IMAGELENGTH, &height);
  TIFFGetFieldDefaulted(tiff.get(), TIFFTAG_BITSPERSAMPLE, &bits);
  TIFFGetFieldDefaulted(tiff.get(), TIFFTAG_SAMPLESPERPIXEL, &channels);
  TIFFGetFieldDefaulted(tiff.get(), TIFFTAG_SAMPLEFORMAT, &format);
  const bool real = format == SAMPLEFORMAT_IEEEFP && (bits == 32 || bits == 64);
  const bool whole = format == SAMPLEFORMAT_UINT && bits == 16;
  if (channels != 1 || !(real || whole) || TIFFIsTiled(tiff.get()))
    throw InputError(path + ": found " + std::to_string(bits) + " bits in " + std::to_string(channels) +
                     (channels == 1 ? " channel" : " channels") +
                     ", expected depth in strips, real numbers of 32 or 64 bits or whole ones of 16");
  constexpr std::uint64_t kMost = std::uint64_t(1) << 28;
  if (width == 0 || height == 0 || std::uint64_t(width) * height > kMost)
    throw InputError(path + ": found " + std::to_string(width) + " x " + std::to_string(height) +
                     " pixels, expected at most 256 megapixels");
  GreyTiff picture{static_cast<int>(width), static_cast<int>(height), whole, {}};
  std::vector<unsigned char> row(static_cast<std::size_t>(TIFFScanlineSize(tiff.get())));
  if (row.size() < std::size_t(width) * bits / 8) throw InputError(path + ": its rows are too short");
  for (std::uint32_t y = 0; y < height; ++y) {
    if (TIFFReadScanline(tiff.get(), row.data(), y) < 0)
      throw InputError(path + ": ends within its pixels, or cannot be unpacked, in row " + std::to_string(y));
    if (whole)
      append<std::uint16_t>(row, width, picture.values);
    else if (bits == 32)
      append<float>(row, width, picture.values);
    else
      append<double>(row, width, picture.values);
  }
  return picture;
}

}  // namespace flash::data
