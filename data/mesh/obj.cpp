#include "data/mesh/obj.h"

#include <limits>
#include <vector>

#include "data/files/error.h"
#include "data/files/text.h"

namespace flash::data {
namespace {

InputError line_error(const std::string& source, const LineReader& lines, std::string_view found,
                      const char* expected) {
  return input_error(source, "line " + std::to_string(lines.number()),
                     "found \"" + std::string(found) + "\", expected " + expected);
}

void append_vertex(const std::vector<std::string_view>& words, const std::string& source,
                   const LineReader& lines, std::vector<double>& coordinates) {
  if (words.size() < 4) throw line_error(source, lines, words.back(), "v x y z");
  for (std::size_t k = 1; k <= 3; ++k) {
    const std::optional<double> value = parse_number(words[k]);
    if (!value) throw line_error(source, lines, words[k], "a coordinate");
    coordinates.push_back(*value);
  }
}

template <class Rows, class T>
Rows rows_of(std::vector<T>& values) {
  constexpr int columns = Rows::ColsAtCompileTime;
  return Eigen::Map<Rows>(values.data(), static_cast<Eigen::Index>(values.size()) / columns, columns);
}

void append_row(std::string& text, char key, const double* point) {
  text += key;
  for (int k = 0; k < 3; ++k) text += ' ' + format_number(point[k]);
  text += '\n';
}

}  // namespace

Geometry parse_obj(std::string_view text, const std::string& source) {
  std::vector<double> coordinates;
  std::vector<int> triangles, corners;
  LineReader lines(text);
  for (std::string_view line; lines.next(line);) {
    const std::vector<std::string_view> words = split(line);
    if (words.empty()) continue;
    if (words[0] == "v") append_vertex(words, source, lines, coordinates);
    if (words[0] != "f") continue;
    if (words.size() < 4) throw line_error(source, lines, line, "a face of three corners or more");
    corners.clear();
    for (std::size_t k = 1; k < words.size(); ++k) {
      const std::optional<long> index = parse_integer(words[k].substr(0, words[k].find('/')));
      const long vertices = static_cast<long>(coordinates.size() / 3);
      if (!index || *index == 0 || *index < -vertices || *index > std::numeric_limits<int>::max())
        throw line_error(source, lines, words[k], "a vertex index from 1");
      corners.push_back(to_index(static_cast<double>(*index > 0 ? *index - 1 : vertices + *index)));
    }
    for (std::size_t k = 2; k < corners.size(); ++k)
      triangles.insert(triangles.end(), {corners[0], corners[k - 1], corners[k]});
  }
  return {rows_of<Points>(coordinates), rows_of<Triangles>(triangles), {}};
}

std::string format_obj(const TriangleMesh& mesh) {
  std::string text;
  for (Eigen::Index i = 0; i < mesh.vertices.rows(); ++i) append_row(text, 'v', mesh.vertices.row(i).data());
  for (Eigen::Index i = 0; i < mesh.triangles.rows(); ++i) {
    text += 'f';
    for (int k = 0; k < 3; ++k) text += ' ' + std::to_string(mesh.triangles(i, k) + 1);
    text += '\n';
  }
  return text;
}

Geometry parse_tet(std::string_view text, const std::string& source) {
  std::vector<double> coordinates;
  std::vector<int> tetrahedra;
  LineReader lines(text);
  for (std::string_view line; lines.next(line);) {
    const std::vector<std::string_view> words = split(line);
    if (words.empty() || words[0].front() == '#') continue;
    if (words[0] == "v") {
      append_vertex(words, source, lines, coordinates);
    } else if (words[0] == "t" && words.size() == 5) {
      for (std::size_t k = 1; k <= 4; ++k) {
        const std::optional<long> index = parse_integer(words[k]);
        if (!index || *index < 1) throw line_error(source, lines, words[k], "a vertex index from 1");
        tetrahedra.push_back(to_index(static_cast<double>(*index - 1)));
      }
    } else {
      throw line_error(source, lines, line, "v x y z or t a b c d");
    }
  }
  return {rows_of<Points>(coordinates), {}, rows_of<Tetrahedra>(tetrahedra)};
}

std::string format_tet(const TetMesh& mesh) {
  std::string text;
  for (Eigen::Index i = 0; i < mesh.vertices.rows(); ++i) append_row(text, 'v', mesh.vertices.row(i).data());
  for (Eigen::Index i = 0; i < mesh.tetrahedra.rows(); ++i) {
    text += 't';
    for (int k = 0; k < 4; ++k) text += ' ' + std::to_string(mesh.tetrahedra(i, k) + 1);
    text += '\n';
  }
  return text;
}

}  // namespace flash::data
