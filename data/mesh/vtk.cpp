#include "data/mesh/vtk.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <vector>

#include "data/files/error.h"
#include "data/files/text.h"

namespace flash::data {
namespace {

/// Words and number arrays of a legacy file, ascii or binary.
class Reader {
 public:
  Reader(std::string_view bytes, const std::string& source) : rest_(bytes), source_(source) {
    expect_line("# vtk DataFile");
    take_line();  // title
    const std::string_view encoding = take_line();
    ascii_ = encoding.starts_with("ASCII");
    if (!ascii_ && !encoding.starts_with("BINARY"))
      throw InputError(source_ + ": found \"" + std::string(encoding) +
                       "\" on line 3, expected ASCII or BINARY");
  }

  /// Empty at the end.
  std::string_view word() { return take_word(rest_); }

  long count() {
    const std::string_view text = word();
    const std::optional<long> value = parse_integer(text);
    if (!value || *value < 0 || static_cast<std::size_t>(*value) > rest_.size())
      throw InputError(source_ + ": found \"" + std::string(text) +
                       "\", expected a count no larger than the file");
    return *value;
  }

  std::vector<double> numbers(long amount, std::string_view type) {
    if (ascii_) return ascii_numbers(amount);
    take_line();
    if (type == "float") return binary_numbers<float, std::uint32_t>(amount);
    if (type == "double") return binary_numbers<double, std::uint64_t>(amount);
    if (type == "int" || type == "vtktypeint32") return binary_numbers<std::int32_t, std::uint32_t>(amount);
    if (type == "long" || type == "vtktypeint64") return binary_numbers<std::int64_t, std::uint64_t>(amount);
    throw InputError(source_ + ": numbers of type \"" + std::string(type) +
                     "\", expected float, double, int or vtktypeint64");
  }

  bool at_line_end() const { return rest_.empty() || rest_.front() == '\n' || rest_.front() == '\r'; }

 private:
  std::string_view take_line() {
    const std::size_t end = std::min(rest_.find('\n'), rest_.size());
    const std::string_view line = rest_.substr(0, end);
    rest_.remove_prefix(std::min(end + 1, rest_.size()));
    return line;
  }

  void expect_line(std::string_view start) {
    if (!take_line().starts_with(start))
      throw InputError(source_ + ": not a legacy VTK file, expected \"" + std::string(start) +
                       "\" on its first line");
  }

  std::vector<double> ascii_numbers(long amount) {
    std::vector<double> values(static_cast<std::size_t>(amount));
    for (double& value : values) {
      const std::string_view text = word();
      const std::optional<double> parsed = parse_number(text);
      if (!parsed) throw InputError(source_ + ": found \"" + std::string(text) + "\", expected a number");
      value = *parsed;
    }
    return values;
  }

  template <class T, class Bits>
  std::vector<double> binary_numbers(long amount) {
    if (rest_.size() < static_cast<std::size_t>(amount) * sizeof(T))
      throw InputError(source_ + ": ends within its data");
    std::vector<double> values(static_cast<std::size_t>(amount));
    for (double& value : values) {
      Bits bits = 0;
      for (std::size_t b = 0; b < sizeof(T); ++b)
        bits = static_cast<Bits>(bits << 8 | static_cast<unsigned char>(rest_[b]));
      T number;
      std::memcpy(&number, &bits, sizeof(T));
      rest_.remove_prefix(sizeof(T));
      value = static_cast<double>(number);
    }
    return values;
  }

  std::string_view rest_;
  bool ascii_ = true;
  const std::string& source_;
};

/// Corner lists one after another.
struct Cells {
  std::vector<double> offsets, corners;

  std::size_t size() const { return offsets.empty() ? 0 : offsets.size() - 1; }
};

/// Versions up to 4: `n i0 ... in-1` a cell; version 5: OFFSETS and CONNECTIVITY.
Cells read_cells(Reader& reader, bool version_5, const std::string& source) {
  const long first = reader.count(), second = reader.count();
  Cells cells;
  if (version_5) {
    for (int part = 0; part < 2; ++part) {
      const std::string_view name = reader.word(), type = reader.word();
      (name == "OFFSETS" ? cells.offsets : cells.corners) =
          reader.numbers(name == "OFFSETS" ? first : second, type);
    }
  } else {
    const std::vector<double> flat = reader.numbers(second, "int");
    cells.offsets.push_back(0);
    for (std::size_t i = 0; i < flat.size();) {
      const double wanted = std::max(0.0, flat[i]);
      if (!(wanted < static_cast<double>(flat.size() - i)))
        throw InputError(source + ": a cell runs past the end of its list");
      const std::size_t corners = static_cast<std::size_t>(wanted);
      cells.corners.insert(cells.corners.end(), flat.begin() + static_cast<long>(i) + 1,
                           flat.begin() + static_cast<long>(i + 1 + corners));
      cells.offsets.push_back(static_cast<double>(cells.corners.size()));
      i += 1 + corners;
    }
  }
  for (std::size_t i = 0; i < cells.size(); ++i)
    if (cells.offsets[i] < 0 || cells.offsets[i + 1] < cells.offsets[i] ||
        cells.offsets[i + 1] > static_cast<double>(cells.corners.size()))
      throw InputError(source + ": cell " + std::to_string(i) + " runs past the end of its list");
  return cells;
}

constexpr double kTriangle = 5, kPolygon = 7, kQuad = 9, kTetrahedron = 10;

void append_cells(const Cells& cells, const std::vector<double>& types, std::vector<int>& triangles,
                  std::vector<int>& tetrahedra) {
  for (std::size_t i = 0; i < cells.size(); ++i) {
    std::vector<int> corner;
    for (double k = cells.offsets[i]; k < cells.offsets[i + 1]; ++k)
      corner.push_back(to_index(cells.corners[static_cast<std::size_t>(k)]));
    const double type = types.empty() ? kPolygon : types[i];
    if (type == kTetrahedron && corner.size() == 4)
      tetrahedra.insert(tetrahedra.end(), corner.begin(), corner.end());
    if (type == kTriangle || type == kPolygon || type == kQuad)
      for (std::size_t k = 2; k < corner.size(); ++k)
        triangles.insert(triangles.end(), {corner[0], corner[k - 1], corner[k]});
  }
}

template <class Rows>
void append_cells(const Rows& rows, std::string& text) {
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    text += std::to_string(rows.cols());
    for (Eigen::Index k = 0; k < rows.cols(); ++k) text += ' ' + std::to_string(rows(i, k));
    text += '\n';
  }
}

std::string header_and_points(const char* dataset, const Points& points) {
  std::string text = "# vtk DataFile Version 3.0\nmetres\nASCII\nDATASET " + std::string(dataset) +
                     "\nPOINTS " + std::to_string(points.rows()) + " double\n";
  for (Eigen::Index i = 0; i < points.rows(); ++i)
    text += format_number(points(i, 0)) + ' ' + format_number(points(i, 1)) + ' ' +
            format_number(points(i, 2)) + '\n';
  return text;
}

}  // namespace

Geometry parse_vtk(std::string_view bytes, const std::string& source) {
  const bool version_5 = bytes.substr(0, 32).find("Version 5") != std::string_view::npos;
  Reader reader(bytes, source);
  std::vector<double> points, types;
  Cells cells;
  bool is_grid = false;
  for (std::string_view word = reader.word(); !word.empty(); word = reader.word()) {
    if (word == "DATASET") {
      const std::string_view kind = reader.word();
      is_grid = kind == "UNSTRUCTURED_GRID";
      if (!is_grid && kind != "POLYDATA")
        throw InputError(source + ": DATASET " + std::string(kind) +
                         ", expected POLYDATA or UNSTRUCTURED_GRID");
    } else if (word == "POINTS") {
      const long count = reader.count();
      points = reader.numbers(3 * count, reader.word());
    } else if ((word == "CELLS" && is_grid) || (word == "POLYGONS" && !is_grid)) {
      cells = read_cells(reader, version_5, source);
    } else if (word == "CELL_TYPES") {
      types = reader.numbers(reader.count(), "int");
    } else if (word == "POINT_DATA" || word == "CELL_DATA") {
      break;  // attributes stand last
    } else if (word == "VERTICES" || word == "LINES" || word == "TRIANGLE_STRIPS") {
      read_cells(reader, version_5, source);
    } else if (word == "METADATA") {
      while (!reader.word().empty() && !reader.at_line_end()) {
      }
    }
  }
  if (!is_grid) types.clear();  // polygons have none
  if (is_grid && types.size() != cells.size())
    throw InputError(source + ": found " + std::to_string(types.size()) + " cell types for " +
                     std::to_string(cells.size()) + " cells");
  std::vector<int> triangles, tetrahedra;
  append_cells(cells, types, triangles, tetrahedra);
  return {Eigen::Map<Points>(points.data(), static_cast<Eigen::Index>(points.size() / 3), 3),
          Eigen::Map<Triangles>(triangles.data(), static_cast<Eigen::Index>(triangles.size() / 3), 3),
          Eigen::Map<Tetrahedra>(tetrahedra.data(), static_cast<Eigen::Index>(tetrahedra.size() / 4), 4)};
}

std::string format_vtk(const TriangleMesh& mesh) {
  std::string text = header_and_points("POLYDATA", mesh.vertices);
  text += "POLYGONS " + std::to_string(mesh.triangles.rows()) + ' ' +
          std::to_string(4 * mesh.triangles.rows()) + '\n';
  append_cells(mesh.triangles, text);
  return text;
}

std::string format_vtk(const TetMesh& mesh) {
  std::string text = header_and_points("UNSTRUCTURED_GRID", mesh.vertices);
  text += "CELLS " + std::to_string(mesh.tetrahedra.rows()) + ' ' +
          std::to_string(5 * mesh.tetrahedra.rows()) + '\n';
  append_cells(mesh.tetrahedra, text);
  text += "CELL_TYPES " + std::to_string(mesh.tetrahedra.rows()) + '\n';
  for (Eigen::Index i = 0; i < mesh.tetrahedra.rows(); ++i) text += "10\n";
  return text;
}

}  // namespace flash::data
