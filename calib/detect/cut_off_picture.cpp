#include "calib/detect/cut_off_picture.h"

#include <cstdint>
#include <cstdlib>

namespace flash::calib {
namespace {

std::uint8_t byte_at(std::string_view file, std::size_t at) { return static_cast<std::uint8_t>(file[at]); }

/// Little endian, as BMP has them.
std::uint32_t number_at(std::string_view file, std::size_t at, std::size_t size) {
  std::uint32_t value = 0;
  for (std::size_t i = size; i-- > 0;) value = value << 8 | byte_at(file, at + i);
  return value;
}

/// The next marker that does not stand for itself within compressed data: there 0xff is followed by zero, and
/// restarts are 0xd0 to 0xd7. The end of the file where there is none.
std::size_t next_marker(std::string_view file, std::size_t at) {
  for (; at + 1 < file.size(); ++at) {
    const std::uint8_t code = byte_at(file, at + 1);
    if (byte_at(file, at) == 0xff && code != 0 && code != 0xff && (code < 0xd0 || code > 0xd7)) return at;
  }
  return file.size();
}

}  // namespace

bool is_cut_off_jpeg(std::string_view file) {
  constexpr std::uint8_t kEnd = 0xd9;
  if (!file.starts_with("\xff\xd8\xff")) return false;
  for (std::size_t at = 2;;) {
    at = next_marker(file, at);  // after a segment it is the next byte, but for what pads it
    if (at >= file.size()) return true;
    if (byte_at(file, at + 1) == kEnd) return false;
    if (at + 4 > file.size()) return true;
    at += 2 + (static_cast<std::size_t>(byte_at(file, at + 2)) << 8 | byte_at(file, at + 3));
  }
}

bool is_cut_off_bmp(std::string_view file) {
  constexpr std::size_t kHeader = 34;  // up to how the picture is packed
  constexpr std::uint32_t kRows = 0, kRowsOfBitFields = 3;
  if (!file.starts_with("BM") || file.size() < kHeader || number_at(file, 14, 4) < 40) return false;
  const std::uint32_t packing = number_at(file, 30, 4);
  if (packing != kRows && packing != kRowsOfBitFields) return false;
  const std::uint64_t width = number_at(file, 18, 4);
  const auto height = static_cast<std::uint64_t>(
      std::abs(static_cast<std::int64_t>(static_cast<std::int32_t>(number_at(file, 22, 4)))));
  const std::uint64_t row = (width * number_at(file, 28, 2) + 31) / 32 * 4;
  return file.size() < number_at(file, 10, 4) + row * height;
}

}  // namespace flash::calib
