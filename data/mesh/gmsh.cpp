#include "data/mesh/gmsh.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "data/files/error.h"
#include "data/files/text.h"

namespace flash::data {
namespace {

/// What an element of a type is: its dimension, its nodes, its order and a name.
struct ElementKind {
  long type;
  int dimension, nodes, order;
  const char* name;
};

constexpr ElementKind kinds[] = {
    {15, 0, 1, 1, "points"},      {1, 1, 2, 1, "lines"},      {8, 1, 3, 2, "lines"},
    {26, 1, 4, 3, "lines"},       {2, 2, 3, 1, "triangles"},  {3, 2, 4, 1, "quads"},
    {9, 2, 6, 2, "triangles"},    {10, 2, 9, 2, "quads"},     {16, 2, 8, 2, "quads"},
    {21, 2, 10, 3, "triangles"},  {4, 3, 4, 1, "tetrahedra"}, {5, 3, 8, 1, "hexahedra"},
    {6, 3, 6, 1, "prisms"},       {7, 3, 5, 1, "pyramids"},   {11, 3, 10, 2, "tetrahedra"},
    {12, 3, 27, 2, "hexahedra"},  {13, 3, 18, 2, "prisms"},   {14, 3, 14, 2, "pyramids"},
    {17, 3, 20, 2, "hexahedra"},  {18, 3, 15, 2, "prisms"},   {19, 3, 13, 2, "pyramids"},
    {29, 3, 20, 3, "tetrahedra"},
};

struct Contents {
  bool has_nodes = false, has_elements = false;
  std::vector<double> places;
  std::unordered_map<long, int> index_of;  ///< of a node by its tag
  std::vector<int> triangles, tetrahedra;
  const ElementKind* other_solid = nullptr;    ///< that is not read, the first of them
  const ElementKind* other_surface = nullptr;  ///< likewise
};

class Reader {
 public:
  Reader(std::string_view bytes, const std::string& source) : rest_(bytes), source_(source) {}

  Contents read() {
    if (word() != "$MeshFormat") fail("found no $MeshFormat at its beginning, expected a Gmsh mesh");
    section_ = "MeshFormat";
    const std::string_view version = word();
    const long binary = integer(), size = integer();
    is_new_ = version == "4.1";
    binary_ = is_new_ && binary == 1;
    if (!(is_new_ || (version == "2.2" && binary == 0)) || binary < 0 || binary > 1)
      fail("found version " + std::string(version) + (binary == 1 ? ", binary" : "") +
           ", expected 2.2 in ascii, or 4.1 (gmsh -format msh41)");
    if (size != 8) fail("found a data size of " + std::to_string(size) + ", expected 8");
    if (binary_) {
      take_line();
      if (number<std::int32_t>() != 1)
        fail("found big-endian numbers, expected little-endian ones, or ascii");
    }
    end_section();
    Contents contents;
    for (std::string_view name = word(); !name.empty(); name = word()) {
      if (name.front() != '$' || name.size() < 2) fail("found \"" + shown(name) + "\", expected a $Section");
      section_ = std::string(name.substr(1));
      if (section_ == "Nodes" || section_ == "Elements") {
        bool& there = section_ == "Nodes" ? contents.has_nodes : contents.has_elements;
        if (std::exchange(there, true)) fail("stands there twice");
        if (section_ == "Elements" && !contents.has_nodes) fail("stands before $Nodes");
        if (binary_) take_line();
        section_ == "Nodes" ? read_nodes(contents) : read_elements(contents);
        end_section();
      } else {
        skip_section();
      }
    }
    section_.clear();
    if (!contents.has_nodes || !contents.has_elements)
      fail(std::string("found no $") + (contents.has_nodes ? "Elements" : "Nodes"));
    return contents;
  }

  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(source_ + ": " + (section_.empty() ? "" : "$" + section_ + ": ") + what);
  }

 private:
  static std::string shown(std::string_view text) { return std::string(text.substr(0, 40)); }

  /// Empty at the end.
  std::string_view word() { return take_word(rest_); }

  void take_line() { rest_.remove_prefix(std::min(rest_.find('\n'), rest_.size() - 1) + 1); }

  /// A number of the binary format.
  template <class T>
  T number() {
    if (rest_.size() < sizeof(T)) fail("ends within its numbers");
    T value;
    std::memcpy(&value, rest_.data(), sizeof(T));
    rest_.remove_prefix(sizeof(T));
    return value;
  }

  std::string_view text_number() {
    const std::string_view text = word();
    if (text.empty() || text.front() == '$') fail("ends within its numbers");
    return text;
  }

  /// A tag or a kind: 4 bytes in the binary format.
  long integer() {
    if (binary_) return number<std::int32_t>();
    const std::string_view text = text_number();
    const std::optional<long> value = parse_integer(text);
    if (!value) fail("found \"" + shown(text) + "\", expected a whole number");
    return *value;
  }

  /// A count or a number of a node or an element: 8 bytes in the binary format.
  long large() { return binary_ ? static_cast<long>(number<std::uint64_t>()) : integer(); }

  double real() {
    if (binary_) return number<double>();
    const std::string_view text = text_number();
    const std::optional<double> value = parse_number(text);
    if (!value) fail("found \"" + shown(text) + "\", expected a number");
    return *value;
  }

  /// Of things of which each takes some bytes.
  long count(const char* what) {
    const long value = large();
    if (value < 0 || static_cast<std::size_t>(value) > rest_.size())
      fail("found a count of " + std::to_string(value) + " " + what +
           ", expected one no larger than the file");
    return value;
  }

  void end_section() {
    if (const std::string_view end = word(); end != "$End" + section_)
      fail("found \"" + shown(end) + "\", expected $End" + section_);
  }

  void skip_section() {
    const std::string end = "$End" + section_;
    const std::size_t at = rest_.find(end);
    if (at == std::string_view::npos) fail("ends without " + end);
    rest_.remove_prefix(at + end.size());
  }

  void add_node(Contents& contents, long tag) {
    if (!contents.index_of.emplace(tag, static_cast<int>(contents.index_of.size())).second)
      fail("found node " + std::to_string(tag) + " twice");
  }

  void read_nodes(Contents& contents) {
    if (!is_new_) {
      for (long left = count("nodes"); left > 0; --left) {
        add_node(contents, large());
        for (int k = 0; k < 3; ++k) contents.places.push_back(real());
      }
      return;
    }
    const long blocks = count("blocks"), nodes = count("nodes");
    large(), large();  // least and largest tag
    for (long block = 0; block < blocks; ++block) {
      const long dimension = integer();
      integer();  // entity
      const bool parametric = integer() != 0;
      if (dimension < 0 || dimension > 3)
        fail("found an entity of dimension " + std::to_string(dimension) + ", expected 0 to 3");
      const long own = count("nodes");
      for (long i = 0; i < own; ++i) add_node(contents, large());
      for (long i = 0; i < own; ++i) {
        for (int k = 0; k < 3; ++k) contents.places.push_back(real());
        for (long k = 0; parametric && k < dimension; ++k) real();
      }
    }
    if (nodes != std::ssize(contents.index_of))
      fail("found " + std::to_string(contents.index_of.size()) + " nodes in its blocks, expected the " +
           std::to_string(nodes) + " of its head");
  }

  const ElementKind& kind_of(long type) const {
    const auto* found =
        std::find_if(std::begin(kinds), std::end(kinds), [&](const auto& kind) { return kind.type == type; });
    if (found == std::end(kinds))
      fail("found elements of type " + std::to_string(type) + ", expected tetrahedra (4) or triangles (2)");
    return *found;
  }

  void read_element(Contents& contents, const ElementKind& kind, long number) {
    std::array<int, 32> nodes{};
    for (int k = 0; k < kind.nodes; ++k) {
      const long tag = large();
      const auto found = contents.index_of.find(tag);
      if (found == contents.index_of.end())
        fail("element " + std::to_string(number) + ": found node " + std::to_string(tag) +
             ", which $Nodes does not have");
      nodes[static_cast<std::size_t>(k)] = found->second;
    }
    if (kind.type == 4)
      contents.tetrahedra.insert(contents.tetrahedra.end(), nodes.begin(), nodes.begin() + 4);
    if (kind.type == 2 || kind.type == 3)
      for (std::size_t k = 2; k < static_cast<std::size_t>(kind.nodes); ++k)
        contents.triangles.insert(contents.triangles.end(), {nodes[0], nodes[k - 1], nodes[k]});
    if (kind.dimension == 3 && kind.type != 4 && !contents.other_solid) contents.other_solid = &kind;
    if (kind.dimension == 2 && kind.order > 1 && !contents.other_surface) contents.other_surface = &kind;
  }

  void read_elements(Contents& contents) {
    if (!is_new_) {
      for (long left = count("elements"); left > 0; --left) {
        const long number = large();
        const ElementKind& kind = kind_of(integer());
        for (long tags = count("tags"); tags > 0; --tags) integer();
        read_element(contents, kind, number);
      }
      return;
    }
    const long blocks = count("blocks"), elements = count("elements");
    large(), large();  // least and largest tag
    long seen = 0;
    for (long block = 0; block < blocks; ++block) {
      integer(), integer();  // dimension and entity
      const ElementKind& kind = kind_of(integer());
      const long own = count("elements");
      seen += own;
      for (long i = 0; i < own; ++i) {
        const long number = large();
        read_element(contents, kind, number);
      }
    }
    if (seen != elements)
      fail("found " + std::to_string(seen) + " elements in its blocks, expected the " +
           std::to_string(elements) + " of its head");
  }

  std::string_view rest_;
  const std::string& source_;
  std::string section_;
  bool binary_ = false, is_new_ = false;
};

/// Leaves out what no element has.
void keep_used(std::vector<int>& corners, Points& points) {
  std::vector<int> becomes(static_cast<std::size_t>(points.rows()), -1), kept;
  for (const int corner : corners) becomes[static_cast<std::size_t>(corner)] = 0;
  for (int v = 0; v < std::ssize(becomes); ++v)
    if (becomes[static_cast<std::size_t>(v)] == 0) {
      becomes[static_cast<std::size_t>(v)] = static_cast<int>(kept.size());
      kept.push_back(v);
    }
  for (int& corner : corners) corner = becomes[static_cast<std::size_t>(corner)];
  points = points(kept, Eigen::all).eval();
}

}  // namespace

Geometry parse_msh(std::string_view bytes, const std::string& source) {
  Reader reader(bytes, source);
  Contents contents = reader.read();
  const bool is_solid = !contents.tetrahedra.empty();
  const ElementKind* other = contents.other_solid ? contents.other_solid
                             : is_solid           ? nullptr
                                                  : contents.other_surface;
  if (other)
    throw InputError(
        source + ": $Elements: found " + other->name +
        (other->order > 1 ? " of order " + std::to_string(other->order) : "") + " (type " +
        std::to_string(other->type) + "), expected tetrahedra or triangles" +
        (other->order > 1 ? " of order 1; \"element_order\": 2 in an asset makes quadratic ones" : " alone"));
  Geometry geometry;
  geometry.points = Eigen::Map<Points>(contents.places.data(), std::ssize(contents.places) / 3, 3);
  std::vector<int>& corners = is_solid ? contents.tetrahedra : contents.triangles;
  if (!corners.empty()) keep_used(corners, geometry.points);
  if (is_solid)
    geometry.tetrahedra = Eigen::Map<Tetrahedra>(corners.data(), std::ssize(corners) / 4, 4);
  else
    geometry.triangles = Eigen::Map<Triangles>(corners.data(), std::ssize(corners) / 3, 3);
  return geometry;
}

}  // namespace flash::data
