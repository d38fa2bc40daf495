#include "data/mesh/stl.h"

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <map>
#include <vector>

#include "data/files/error.h"
#include "data/files/text.h"

static_assert(std::endian::native == std::endian::little, "binary STL is copied as it stands");

namespace flash::data {
namespace {

constexpr std::size_t kHeaderSize = 84;  // 80 bytes of title, the number of facets
constexpr std::size_t kFacetSize = 50;   // normal, three corners, two bytes of attributes

/// Corners in groups of three, each vertex once. Corners that are not finite stay apart, for the loader to
/// count.
class Soup {
 public:
  void add(const std::array<double, 3>& corner) {
    const bool comparable = corner == corner;  // NaN has no place in an order
    const int next = static_cast<int>(coordinates_.size() / 3);
    const auto [place, is_new] =
        comparable ? vertices_.emplace(corner, next) : std::pair(vertices_.end(), true);
    indices_.push_back(is_new ? next : place->second);
    if (is_new) coordinates_.insert(coordinates_.end(), corner.begin(), corner.end());
  }
  std::size_t corners() const { return indices_.size(); }
  Geometry geometry() {
    Geometry result;
    result.points = Eigen::Map<Points>(coordinates_.data(), Eigen::Index(coordinates_.size() / 3), 3);
    result.triangles = Eigen::Map<Triangles>(indices_.data(), Eigen::Index(indices_.size() / 3), 3);
    return result;
  }

 private:
  std::map<std::array<double, 3>, int> vertices_;
  std::vector<double> coordinates_;
  std::vector<int> indices_;
};

Geometry parse_binary(std::string_view bytes, std::size_t facets) {
  Soup soup;
  for (std::size_t f = 0; f < facets; ++f) {
    std::array<float, 12> numbers;
    std::memcpy(numbers.data(), bytes.data() + kHeaderSize + f * kFacetSize, sizeof numbers);
    for (std::size_t k = 3; k < 12; k += 3) soup.add({numbers[k], numbers[k + 1], numbers[k + 2]});
  }
  return soup.geometry();
}

Geometry parse_ascii(std::string_view text, const std::string& source) {
  Soup soup;
  bool ended = false;
  LineReader lines(text);
  for (std::string_view line; lines.next(line);) {
    const std::vector<std::string_view> words = split(line);
    if (words.empty()) continue;
    const auto fail = [&](const char* expected) {
      return input_error(source, "line " + std::to_string(lines.number()),
                         "found \"" + std::string(line) + "\", expected " + expected);
    };
    if (words[0] == "endfacet" && soup.corners() % 3 != 0) throw fail("three corners in each facet");
    ended = ended || words[0] == "endsolid";
    if (words[0] != "vertex") continue;
    std::array<double, 3> corner;
    if (words.size() != 4) throw fail("vertex x y z");
    for (std::size_t k = 0; k < 3; ++k) {
      const std::optional<double> value = parse_number(words[k + 1]);
      if (!value) throw fail("vertex x y z");
      corner[k] = *value;
    }
    soup.add(corner);
  }
  if (!ended || soup.corners() % 3 != 0) throw InputError(source + ": ends before its endsolid");
  return soup.geometry();
}

}  // namespace

Geometry parse_stl(std::string_view bytes, const std::string& source) {
  // Binary files may begin with "solid" too: the size decides, then the zeros in them.
  std::uint32_t facets = 0;
  if (bytes.size() >= kHeaderSize) std::memcpy(&facets, bytes.data() + 80, sizeof facets);
  const std::size_t expected = kHeaderSize + kFacetSize * std::size_t{facets};
  if (bytes.size() >= kHeaderSize && bytes.size() == expected) return parse_binary(bytes, facets);
  if (bytes.starts_with("solid") && bytes.find('\0') == bytes.npos) return parse_ascii(bytes, source);
  if (bytes.size() < kHeaderSize)
    throw InputError(source + ": not an STL file, expected \"solid\" or a header of 84 bytes");
  throw InputError(source + ": found " + format_count(bytes.size()) + " bytes, expected " +
                   format_count(expected) + " for the " + format_count(facets) + " facets it announces");
}

}  // namespace flash::data
