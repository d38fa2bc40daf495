#include "data/files/npz.h"

#include <zlib.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string_view>
#include <utility>

#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/text.h"

namespace flash::data {
namespace {

/// A number of the ZIP format, little endian; throws beyond the end of the file.
template <class Number>
Number at(const std::string& file, std::size_t place, const std::string& path) {
  if (place + sizeof(Number) > file.size()) throw InputError(path + ": ends within its data");
  Number value;
  std::memcpy(&value, file.data() + place, sizeof value);
  return value;
}

/// The value of a key in the header of an array, a Python dictionary.
std::string_view value_of(std::string_view header, std::string_view key, std::string_view ends) {
  const std::size_t begin = header.find(key);
  if (begin == std::string_view::npos) return {};
  const std::string_view rest = header.substr(begin + key.size());
  return rest.substr(0, rest.find_first_of(ends));
}

template <class Number>
std::vector<double> converted(std::string_view bytes) {
  std::vector<Number> numbers(bytes.size() / sizeof(Number));
  std::memcpy(numbers.data(), bytes.data(), numbers.size() * sizeof(Number));
  return {numbers.begin(), numbers.end()};
}

/// The numbers that are read.
constexpr std::pair<std::string_view, std::vector<double> (*)(std::string_view)> kNumbers[] = {
    {"<f8", converted<double>},       {"<f4", converted<float>},         {"<i8", converted<std::int64_t>},
    {"<i4", converted<std::int32_t>}, {"<u4", converted<std::uint32_t>}, {"<u2", converted<std::uint16_t>},
    {"<i2", converted<std::int16_t>}, {"|u1", converted<std::uint8_t>},  {"|i1", converted<std::int8_t>}};

/// "(480, 640)"
std::vector<std::size_t> shape_of(std::string_view text) {
  std::vector<std::size_t> shape;
  for (const std::string_view word : split(text, " ,"))
    if (const std::optional<long> size = parse_integer(word); size && *size >= 0)
      shape.push_back(static_cast<std::size_t>(*size));
  return shape;
}

std::size_t count_of(const std::vector<std::size_t>& shape) {
  std::size_t count = 1;
  for (const std::size_t size : shape) count *= size;
  return count;
}

/// What an array without numbers holds.
std::string content_of(const NumpyArray& array) {
  if (array.type.empty()) return array.shape.empty() ? "no array of numpy" : "records";
  const std::string quoted = " (" + array.type + ")";
  switch (array.type.size() > 1 ? array.type[1] : ' ') {
    case 'O':
      return "objects" + quoted;
    case 'U':
    case 'S':
      return "text" + quoted;
    case 'c':
      return "complex numbers" + quoted;
    case 'b':
      return "truth values" + quoted;
    case 'M':
    case 'm':
      return "times" + quoted;
    default:
      break;
  }
  if (count_of(array.shape) == 0) return "no element";
  if (array.type[0] == '>') return "numbers with their bytes the other way round" + quoted;
  const bool is_read = std::any_of(std::begin(kNumbers), std::end(kNumbers),
                                   [&](const auto& known) { return known.first == array.type; });
  return (is_read ? "another number of elements than its shape says" : "numbers of a type that is not read") +
         quoted;
}

/// Of numbers whose first index runs fastest, those whose last one does.
std::vector<double> last_index_first(const std::vector<double>& stored,
                                     const std::vector<std::size_t>& shape) {
  std::vector<double> values(stored.size());
  for (std::size_t i = 0; i < stored.size(); ++i) {
    std::size_t rest = i, place = 0, stride = values.size();
    for (const std::size_t size : shape) {
      stride /= size;
      place += rest % size * stride;
      rest /= size;
    }
    values[place] = stored[i];
  }
  return values;
}

/// Empty of an array that is no list of real numbers.
NumpyArray array_of(std::string_view npy) {
  if (!npy.starts_with("\x93NUMPY") || npy.size() < 12) return {};
  const bool first_version = npy[6] == 1;
  const std::size_t begin = first_version ? 10 : 12;
  const auto byte = [&](std::size_t i) {
    return static_cast<std::size_t>(static_cast<unsigned char>(npy[i]));
  };
  std::size_t length = byte(8) + 256 * byte(9);
  if (!first_version) length += 65536 * byte(10);
  if (begin + length > npy.size()) return {};
  const std::string_view header = npy.substr(begin, length), bytes = npy.substr(begin + length);
  const std::string_view type = value_of(header, "'descr': '", "'");
  NumpyArray array{
      .shape = shape_of(value_of(header, "'shape': (", ")")), .values = {}, .type = std::string(type)};
  std::vector<double>& values = array.values;
  for (const auto& [name, convert] : kNumbers)
    if (type == name) values = convert(bytes);
  array.whole = !type.empty() && type.size() == 3 && type[1] != 'f';
  const bool columns_first = value_of(header, "'fortran_order': ", ",}") == "True";
  if (columns_first && values.size() == count_of(array.shape)) values = last_index_first(values, array.shape);
  return array;
}

/// What a file of `size` bytes was before it was compressed; empty where it is damaged.
std::string inflated(std::string_view bytes, std::size_t size) {
  constexpr std::size_t kMostPerByte = 1100, kLeast = 1 << 16;  // of what the format can hold
  if (size > kMostPerByte * bytes.size() + kLeast) return {};
  std::string text(size, '\0');
  z_stream stream{};
  if (inflateInit2(&stream, -MAX_WBITS) != Z_OK) return {};  // as ZIP has it, without a head
  std::string in(bytes);
  stream.next_in = reinterpret_cast<Bytef*>(in.data());
  stream.avail_in = static_cast<uInt>(in.size());
  stream.next_out = reinterpret_cast<Bytef*>(text.data());
  stream.avail_out = static_cast<uInt>(text.size());
  const int ended = inflate(&stream, Z_FINISH);
  inflateEnd(&stream);
  return ended == Z_STREAM_END && stream.total_out == size ? text : std::string();
}

}  // namespace

std::map<std::string, NumpyArray> load_npz(const std::string& path) {
  const std::string file = read_file(path);
  const std::size_t end = file.rfind("PK\x05\x06");
  if (end == std::string::npos) throw InputError(path + ": no .npz: found no table of contents");
  std::map<std::string, NumpyArray> arrays;
  std::size_t entry = at<std::uint32_t>(file, end + 16, path);
  const auto count = at<std::uint16_t>(file, end + 10, path);
  for (std::uint16_t i = 0; i < count; ++i) {
    const auto method = at<std::uint16_t>(file, entry + 10, path);
    const auto checksum = at<std::uint32_t>(file, entry + 16, path),
               size = at<std::uint32_t>(file, entry + 20, path),
               whole_size = at<std::uint32_t>(file, entry + 24, path);
    const auto name_length = at<std::uint16_t>(file, entry + 28, path);
    const auto extra = at<std::uint16_t>(file, entry + 30, path),
               comment = at<std::uint16_t>(file, entry + 32, path);
    const std::size_t local = at<std::uint32_t>(file, entry + 42, path);
    at<char>(file, entry + 46 + name_length, path);
    std::string name = file.substr(entry + 46, name_length);
    if (name.ends_with(".npy")) name.resize(name.size() - 4);
    constexpr std::uint16_t kStored = 0, kDeflated = 8;
    if (method != kStored && method != kDeflated)
      throw InputError(path + ": " + name +
                       ": is compressed in a way that numpy does not use; write it with numpy.savez");
    const std::size_t begin =
        local + 30 + at<std::uint16_t>(file, local + 26, path) + at<std::uint16_t>(file, local + 28, path);
    if (begin + size > file.size()) throw InputError(path + ": " + name + ": ends within its data");
    const std::string_view stored = std::string_view(file).substr(begin, size);
    const std::string text = method == kDeflated ? inflated(stored, whole_size) : std::string();
    const std::string_view bytes = method == kDeflated ? std::string_view(text) : stored;
    if (crc32(0, reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uInt>(bytes.size())) != checksum)
      throw InputError(path + ": " + name +
                       ": is damaged: found another checksum than that of its data, expected the same");
    arrays[name] = array_of(bytes);
    entry += 46U + name_length + extra + comment;
  }
  return arrays;
}

void expect_numbers(const NumpyArray& array, const std::string& path, const std::string& name) {
  if (!array.values.empty() && array.values.size() == count_of(array.shape)) return;
  const std::string where = name.empty() ? path : path + ": " + name;
  throw InputError(where + ": found " + content_of(array) + ", expected real numbers, as numpy.float64");
}

NumpyArray load_npy(const std::string& path) {
  NumpyArray array = array_of(read_file(path));
  expect_numbers(array, path, "");
  return array;
}

}  // namespace flash::data
