#include "data/pcd.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <vector>

#include "data/error.h"
#include "data/text.h"

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
  if (header.data != "ascii" && header.data != "binary")
    throw input_error(source, "DATA", "found \"" + header.data + "\", expected ascii or binary");
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

}  // namespace

Points parse_pcd(std::string_view bytes, const std::string& source) {
  const Header header = parse_header(bytes, source);
  std::array<std::size_t, 3> field{}, byte_offset{}, column{};
  std::array<bool, 3> found{};
  std::size_t stride = 0, columns = 0;
  for (std::size_t f = 0; f < header.fields.size(); ++f) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (header.fields[f] == std::string(1, "xyz"[axis])) {
        field[axis] = f;
        byte_offset[axis] = stride;
        column[axis] = columns;
        found[axis] = true;
      }
    stride += static_cast<std::size_t>(header.sizes[f] * header.counts[f]);
    columns += static_cast<std::size_t>(header.counts[f]);
  }
  if (!(found[0] && found[1] && found[2])) throw input_error(source, "FIELDS", "x, y and z are expected");

  std::string_view body = bytes.substr(header.size);
  std::vector<double> coordinates;
  const auto append = [&](const std::array<double, 3>& point) {
    if (std::isfinite(point[0]) && std::isfinite(point[1]) && std::isfinite(point[2]))
      coordinates.insert(coordinates.end(), point.begin(), point.end());
  };
  if (header.data == "binary") {
    if (body.size() / std::max<std::size_t>(stride, 1) < static_cast<std::size_t>(header.points))
      throw InputError(source + ": ends before its " + format_count(static_cast<std::size_t>(header.points)) +
                       " points are read");
    for (long i = 0; i < header.points; ++i, body.remove_prefix(stride)) {
      std::array<double, 3> point;
      for (std::size_t axis = 0; axis < 3; ++axis)
        point[axis] = read_number(body.data() + byte_offset[axis], header.types[field[axis]],
                                  header.sizes[field[axis]], source);
      append(point);
    }
  } else {
    LineReader lines(body);
    std::string_view line;
    for (long i = 0; i < header.points; ++i) {
      if (!lines.next(line))
        throw InputError(source + ": ends before its " +
                         format_count(static_cast<std::size_t>(header.points)) + " points are read");
      const std::vector<std::string_view> words = split(line);
      std::array<double, 3> point;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::optional<double> value =
            words.size() == columns ? parse_number(words[column[axis]]) : std::nullopt;
        if (!value)
          throw input_error(
              source, "point " + std::to_string(i),
              "found \"" + std::string(line) + "\", expected " + std::to_string(columns) + " numbers");
        point[axis] = *value;
      }
      append(point);
    }
  }
  return Eigen::Map<Points>(coordinates.data(), static_cast<Eigen::Index>(coordinates.size() / 3), 3);
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
