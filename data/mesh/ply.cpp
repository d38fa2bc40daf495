#include "data/mesh/ply.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <optional>
#include <vector>

#include "data/files/error.h"
#include "data/files/text.h"

static_assert(std::endian::native == std::endian::little, "binary PLY is copied as it stands");

namespace flash::data {
namespace {

enum class Number { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

std::optional<Number> parse_number_type(std::string_view name) {
  if (name == "char" || name == "int8") return Number::int8;
  if (name == "uchar" || name == "uint8") return Number::uint8;
  if (name == "short" || name == "int16") return Number::int16;
  if (name == "ushort" || name == "uint16") return Number::uint16;
  if (name == "int" || name == "int32") return Number::int32;
  if (name == "uint" || name == "uint32") return Number::uint32;
  if (name == "float" || name == "float32") return Number::float32;
  if (name == "double" || name == "float64") return Number::float64;
  return std::nullopt;
}

struct Property {
  std::string name;
  Number type = Number::float32;
  std::optional<Number> count_type;  ///< set for lists
};

struct Element {
  std::string name;
  long count = 0;
  std::vector<Property> properties;
};

enum class Encoding { ascii, little_endian, big_endian };

struct Header {
  Encoding encoding = Encoding::little_endian;
  std::vector<Element> elements;
  std::size_t size = 0;  ///< bytes up to the body
};

Header parse_header(std::string_view bytes, const std::string& source) {
  Header header;
  LineReader lines(bytes);
  std::string_view line;
  if (!lines.next(line) || line != "ply")
    throw InputError(source + ": not a PLY file, expected \"ply\" on its first line");
  while (lines.next(line)) {
    const std::vector<std::string_view> words = split(line);
    const auto fail = [&](const char* expected) {
      return input_error(source, "header line " + std::to_string(lines.number()),
                         "found \"" + std::string(line) + "\", expected " + expected);
    };
    if (words.empty() || words[0] == "comment" || words[0] == "obj_info") continue;
    if (words[0] == "end_header") {
      header.size = lines.offset();
      return header;
    }
    if (words[0] == "format") {
      const std::string_view name = words.size() < 2 ? "" : words[1];
      if (name == "ascii")
        header.encoding = Encoding::ascii;
      else if (name == "binary_little_endian")
        header.encoding = Encoding::little_endian;
      else if (name == "binary_big_endian")
        header.encoding = Encoding::big_endian;
      else
        throw fail("format ascii, binary_little_endian or binary_big_endian");
    } else if (words[0] == "element") {
      const std::optional<long> count = words.size() == 3 ? parse_integer(words[2]) : std::nullopt;
      if (!count || *count < 0) throw fail("element NAME COUNT");
      header.elements.push_back({std::string(words[1]), *count, {}});
    } else if (words[0] == "property" && !header.elements.empty()) {
      const bool is_list = words.size() == 5 && words[1] == "list";
      if (!is_list && words.size() != 3) throw fail("property TYPE NAME or property list TYPE TYPE NAME");
      const std::optional<Number> type = parse_number_type(words[words.size() - 2]);
      const std::optional<Number> count_type = is_list ? parse_number_type(words[2]) : std::nullopt;
      if (!type || (is_list && !count_type)) throw fail("a known number type");
      header.elements.back().properties.push_back({std::string(words.back()), *type, count_type});
    } else {
      throw fail("format, element, property, comment or end_header");
    }
  }
  throw InputError(source + ": ends within its PLY header, expected end_header");
}

/// Numbers of the body one after another.
class Body {
 public:
  Body(std::string_view bytes, Encoding encoding, const std::string& source)
      : rest_(bytes), encoding_(encoding), source_(source) {}

  double next(Number type) { return encoding_ == Encoding::ascii ? next_word() : next_binary(type); }

 private:
  double next_word() {
    const std::size_t begin = rest_.find_first_not_of(" \t\r\n");
    if (begin == std::string_view::npos) throw too_short();
    rest_.remove_prefix(begin);
    const std::string_view word = rest_.substr(0, rest_.find_first_of(" \t\r\n"));
    const std::optional<double> value = parse_number(word);
    if (!value)
      throw InputError(source_ + ": found \"" + std::string(word) + "\" in the body, expected a number");
    rest_.remove_prefix(word.size());
    return *value;
  }

  template <class T>
  double take() {
    if (rest_.size() < sizeof(T)) throw too_short();
    std::array<char, sizeof(T)> bytes;
    std::copy_n(rest_.begin(), sizeof(T), bytes.begin());
    if (encoding_ == Encoding::big_endian) std::reverse(bytes.begin(), bytes.end());
    const T value = std::bit_cast<T>(bytes);
    rest_.remove_prefix(sizeof(T));
    return static_cast<double>(value);
  }

  double next_binary(Number type) {
    switch (type) {
      case Number::int8:
        return take<std::int8_t>();
      case Number::uint8:
        return take<std::uint8_t>();
      case Number::int16:
        return take<std::int16_t>();
      case Number::uint16:
        return take<std::uint16_t>();
      case Number::int32:
        return take<std::int32_t>();
      case Number::uint32:
        return take<std::uint32_t>();
      case Number::float32:
        return take<float>();
      case Number::float64:
        return take<double>();
    }
    return 0;
  }

  InputError too_short() const {
    return InputError(source_ + ": ends before all elements of its header are read");
  }

  std::string_view rest_;
  Encoding encoding_;
  const std::string& source_;
};

void read_vertices(const Element& element, Body& body, const std::string& source, Points& points) {
  std::array<bool, 3> found{};
  for (const Property& property : element.properties)
    for (int axis = 0; axis < 3; ++axis)
      found[static_cast<std::size_t>(axis)] |= property.name == std::string(1, "xyz"[axis]);
  if (!(found[0] && found[1] && found[2]))
    throw InputError(source + ": element vertex has no properties x, y and z");

  std::vector<double> coordinates;  // grows with what is really there, whatever the header promises
  for (long i = 0; i < element.count; ++i) {
    Eigen::Vector3d point;
    for (const Property& property : element.properties) {
      if (property.count_type) {
        const double count = body.next(*property.count_type);
        for (double k = 0; k < count; ++k) body.next(property.type);
        continue;
      }
      const double value = body.next(property.type);
      if (property.name == "x") point.x() = value;
      if (property.name == "y") point.y() = value;
      if (property.name == "z") point.z() = value;
    }
    coordinates.insert(coordinates.end(), point.data(), point.data() + 3);
  }
  points = Eigen::Map<Points>(coordinates.data(), static_cast<Eigen::Index>(coordinates.size() / 3), 3);
}

void read_faces(const Element& element, Body& body, const std::string& source, Triangles& triangles) {
  if (element.properties.empty()) return;  // takes no bytes, however many it claims
  std::vector<int> corners, fans;
  for (long i = 0; i < element.count; ++i)
    for (const Property& property : element.properties) {
      if (!property.count_type) {
        body.next(property.type);
        continue;
      }
      const double count = body.next(*property.count_type);
      const bool is_face = property.name == "vertex_indices" || property.name == "vertex_index";
      if (is_face && count < 3)
        throw InputError(source + ": face " + std::to_string(i) + " has " + format_number(count) +
                         " corners, expected 3 or more");
      corners.clear();
      for (double k = 0; k < count; ++k) {
        const double corner = body.next(property.type);
        if (is_face) corners.push_back(to_index(corner));
      }
      for (std::size_t k = 2; k < corners.size(); ++k)
        fans.insert(fans.end(), {corners[0], corners[k - 1], corners[k]});
    }
  triangles = Eigen::Map<Triangles>(fans.data(), static_cast<Eigen::Index>(fans.size() / 3), 3);
}

template <class T>
void append_bytes(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

}  // namespace

Geometry parse_ply(std::string_view bytes, const std::string& source) {
  const Header header = parse_header(bytes, source);
  Body body(bytes.substr(header.size), header.encoding, source);
  Geometry geometry;
  bool has_vertices = false;
  for (const Element& element : header.elements) {
    if (element.name == "vertex") {
      read_vertices(element, body, source, geometry.points);
      has_vertices = true;
    } else {
      Triangles skipped;
      read_faces(element, body, source, element.name == "face" ? geometry.triangles : skipped);
    }
  }
  if (!has_vertices) throw InputError(source + ": found no element vertex");
  return geometry;
}

std::string format_ply(const Points& points, const Triangles& triangles, PlyNumbers numbers) {
  const std::string type = numbers == PlyNumbers::float32 ? "float" : "double";
  std::string bytes =
      "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(points.rows()) + '\n';
  for (const char axis : {'x', 'y', 'z'}) bytes += "property " + type + ' ' + axis + '\n';
  if (triangles.rows() > 0)
    bytes +=
        "element face " + std::to_string(triangles.rows()) + "\nproperty list uchar int vertex_indices\n";
  bytes += "end_header\n";
  for (Eigen::Index i = 0; i < points.size(); ++i) {
    if (numbers == PlyNumbers::float32)
      append_bytes(bytes, static_cast<float>(points.data()[i]));
    else
      append_bytes(bytes, points.data()[i]);
  }
  for (Eigen::Index i = 0; i < triangles.rows(); ++i) {
    append_bytes(bytes, std::uint8_t{3});
    for (int k = 0; k < 3; ++k) append_bytes(bytes, std::int32_t{triangles(i, k)});
  }
  return bytes;
}

}  // namespace flash::data
