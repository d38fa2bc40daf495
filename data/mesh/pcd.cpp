#include "data/mesh/pcd.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <vector>

#include "data/files/error.h"
#include "data/files/text.h"

namespace flash::data {
namespace {

struct Header {
  std::vector<std::string> fields;
  std::vector<char> types;
  std::vector<long> sizes, counts;
  long points = -1;
  std::string data;
  std::size_t size = 0;  ///< bytes up to the body
};

Header parse_header(std::string_view bytes, const std::string& source) {
  Header header;
  LineReader lines(bytes);
  for (std::string_view line; header.data.empty();) {
    if (!lines.next(line)) throw InputError(source + ": ends within its PCD header, expected DATA");
    const std::vector<std::string_view> words = split(line);
    if (words.size() < 2 || words[0].front() == '#') continue;
    const auto integers = [&] {
      std::vector<long> values;
      for (std::size_t i = 1; i < words.size(); ++i) {
        const std::optional<long> value = parse_integer(words[i]);
        if (!value || *value < 0)
          throw input_error(source, std::string(words[0]),
                            "found \"" + std::string(words[i]) + "\", expected a count");
        values.push_back(*value);
      }
      return values;
    };
    if (words[0] == "FIELDS") header.fields.assign(words.begin() + 1, words.end());
    if (words[0] == "SIZE") header.sizes = integers();
    if (words[0] == "COUNT") header.counts = integers();
    if (words[0] == "POINTS") header.points = integers()[0];
    if (words[0] == "TYPE")
      for (std::size_t i = 1; i < words.size(); ++i) header.types.push_back(words[i].front());
    if (words[0] == "DATA") header.data = words[1];
  }
  header.size = lines.offset();
  if (header.counts.empty()) header.counts.assign(header.fields.size(), 1);
  if (header.fields.empty() || header.sizes.size() != header.fields.size() ||
      header.types.size() != header.fields.size() || header.counts.size() != header.fields.size() ||
      header.points < 0)
    throw InputError(source + ": PCD header lacks FIELDS, SIZE, TYPE or POINTS, or they differ in length");
  const auto expect_at_most = [&](const char* name, const std::vector<long>& values, long most) {
    for (const long value : values)
      if (value < 1 || value > most)
        throw input_error(source, name,
                          "found " + std::to_string(value) + ", expected 1 to " + std::to_string(most));
  };
  expect_at_most("SIZE", header.sizes, 8);
  expect_at_most("COUNT", header.counts, 1'000'000);
  if (header.points > 0) expect_at_most("POINTS", {header.points}, 1'000'000'000);
  if (header.data != "ascii" && header.data != "binary" && header.data != "binary_compressed")
    throw input_error(source, "DATA",
                      "found \"" + header.data + "\", expected ascii, binary or binary_compressed");
  return header;
}

template <class T>
double read_as(const char* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof value);
  return static_cast<double>(value);
}

double read_number(const char* bytes, char type, long size, const std::string& source) {
  if (type == 'F' && size == 4) return read_as<float>(bytes);
  if (type == 'F' && size == 8) return read_as<double>(bytes);
  if (type == 'I' && size == 2) return read_as<std::int16_t>(bytes);
  if (type == 'I' && size == 4) return read_as<std::int32_t>(bytes);
  throw input_error(
      source, "TYPE",
      std::string("coordinates of type ") + type + std::to_string(size) + ", expected F4 or F8");
}

/// LZF: a byte c below 32 is followed by c + 1 bytes as they are; any other stands for bytes that came
/// before: their number less 2 in its upper three bits (7: add the next byte), how far back less 1 in the
/// lower five and the next byte. Empty unless exactly `size` bytes come out.
std::string decompress_lzf(std::string_view packed, std::size_t size) {
  std::string bytes;
  bytes.reserve(std::min(size, 300 * packed.size()));
  std::size_t at = 0;
  const auto next = [&]() -> std::size_t {
    return at < packed.size() ? static_cast<unsigned char>(packed[at++]) : size + 1;  // beyond every bound
  };
  while (at < packed.size()) {
    const std::size_t control = next();
    if (control < 32) {
      if (packed.size() - at < control + 1 || size - bytes.size() < control + 1) return {};
      bytes.append(packed.substr(at, control + 1));
      at += control + 1;
      continue;
    }
    const std::size_t length = 2 + (control >> 5) + (control >> 5 == 7 ? next() : 0);
    const std::size_t back = 1 + ((control & 31) << 8) + next();
    if (back > bytes.size() || length > size - bytes.size()) return {};
    for (std::size_t k = 0; k < length; ++k) bytes += bytes[bytes.size() - back];  // may overlap itself
  }
  return bytes.size() == size ? bytes : std::string();
}

/// Where a coordinate stands in the body.
struct Column {
  char type = 0;
  long size = 0;
  std::size_t index = 0;   ///< ascii: of its word in the line
  std::size_t offset = 0;  ///< binary: of its first value in the body [bytes]
  std::size_t stride = 0;  ///< binary: from point to point [bytes]
};

std::array<Column, 3> columns_of(const Header& header, const std::string& source) {
  const bool by_field = header.data == "binary_compressed";  // all x, then all y, ...
  const auto points = static_cast<std::size_t>(header.points);
  std::array<Column, 3> columns;
  std::size_t index = 0, offset = 0;
  for (std::size_t f = 0; f < header.fields.size(); ++f) {
    const auto size = static_cast<std::size_t>(header.sizes[f]),
               count = static_cast<std::size_t>(header.counts[f]);
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (header.fields[f] == std::string(1, "xyz"[axis]))
        columns[axis] = {header.types[f], header.sizes[f], index, offset, size * count};
    index += count;
    offset += size * count * (by_field ? points : 1);
  }
  for (Column& column : columns) {
    if (column.type == 0) throw input_error(source, "FIELDS", "x, y and z are expected");
    if (!by_field) column.stride = offset;
  }
  return columns;
}

/// The bytes of all points, unpacked.
std::string_view binary_body(const Header& header, std::string_view body, const std::string& source,
                             std::string& unpacked) {
  std::size_t stride = 0;
  for (std::size_t f = 0; f < header.fields.size(); ++f)
    stride += static_cast<std::size_t>(header.sizes[f] * header.counts[f]);
  const auto points = static_cast<std::size_t>(header.points);
  const InputError too_short(source + ": ends before its " + format_count(points) + " points are read");
  if (header.data == "binary_compressed") {
    std::array<std::uint32_t, 2> sizes{};  // packed, unpacked [bytes]
    if (body.size() < sizeof sizes) throw too_short;
    std::memcpy(sizes.data(), body.data(), sizeof sizes);
    body.remove_prefix(sizeof sizes);
    if (body.size() < sizes[0]) throw too_short;
    unpacked = decompress_lzf(body.substr(0, sizes[0]), sizes[1]);
    if (unpacked.size() != sizes[1]) throw InputError(source + ": its compressed points cannot be unpacked");
    body = unpacked;
  }
  if (body.size() / std::max<std::size_t>(stride, 1) < points) throw too_short;
  return body;
}

}  // namespace

Points parse_pcd(std::string_view bytes, const std::string& source) {
  const Header header = parse_header(bytes, source);
  const std::array<Column, 3> columns = columns_of(header, source);
  std::string_view body = bytes.substr(header.size);
  std::vector<double> coordinates;
  if (header.data != "ascii") {
    std::string unpacked;
    body = binary_body(header, body, source, unpacked);
    for (std::size_t i = 0; i < static_cast<std::size_t>(header.points); ++i)
      for (const Column& column : columns)
        coordinates.push_back(
            read_number(body.data() + column.offset + i * column.stride, column.type, column.size, source));
    return Eigen::Map<Points>(coordinates.data(), header.points, 3);
  }
  std::size_t words_expected = 0;
  for (const long count : header.counts) words_expected += static_cast<std::size_t>(count);
  LineReader lines(body);
  std::string_view line;
  for (long i = 0; i < header.points; ++i) {
    if (!lines.next(line))
      throw InputError(source + ": ends before its " + format_count(static_cast<std::size_t>(header.points)) +
                       " points are read");
    const std::vector<std::string_view> words = split(line);
    for (const Column& column : columns) {
      const std::optional<double> value =
          words.size() == words_expected ? parse_number(words[column.index]) : std::nullopt;
      if (!value)
        throw input_error(
            source, "point " + std::to_string(i),
            "found \"" + std::string(line) + "\", expected " + std::to_string(words_expected) + " numbers");
      coordinates.push_back(*value);
    }
  }
  return Eigen::Map<Points>(coordinates.data(), header.points, 3);
}

std::string format_pcd(const Points& points) {
  const std::string count = std::to_string(points.rows());
  std::string bytes = "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH " +
                      count + "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + count + "\nDATA binary\n";
  for (Eigen::Index i = 0; i < points.size(); ++i) {
    const float value = static_cast<float>(points.data()[i]);
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  return bytes;
}

}  // namespace flash::data
