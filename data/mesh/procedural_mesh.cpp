#include "data/mesh/procedural_mesh.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <vector>

#include "data/files/error.h"
#include "data/files/text.h"
#include "data/mesh/delaunay.h"
#include "data/mesh/shorts.h"
#include "data/mesh/tshirt.h"

namespace flash::data {
namespace {

/// The same on every platform, which std::uniform_real_distribution does not promise.
double uniform(std::mt19937& generator, double low, double high) {
  return low + (high - low) * (static_cast<double>(generator()) / 4294967296.0);
}

bool turns(DiagonalPattern pattern, int i, int j, std::mt19937& generator) {
  switch (pattern) {
    case DiagonalPattern::one_way:
      return false;
    case DiagonalPattern::alternating:
      return (i + j) % 2 == 1;
    case DiagonalPattern::alternating_by_row:
      return j % 2 == 1;
    case DiagonalPattern::jittered:
      return generator() % 2 == 1;
  }
  return false;
}

void expect_positive(bool positive, const char* what) {
  if (!positive) throw InputError(std::string("mesh: ") + what);
}

double smallest_angle(const std::vector<Eigen::Vector2d>& points, const Triangles& triangles) {
  double smallest = std::numbers::pi;
  for (Eigen::Index t = 0; t < triangles.rows(); ++t)
    for (int k = 0; k < 3; ++k) {
      const auto corner = [&](int i) { return points[static_cast<std::size_t>(triangles(t, (k + i) % 3))]; };
      const Eigen::Vector2d a = corner(1) - corner(0), b = corner(2) - corner(0);
      smallest = std::min(smallest, std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b)));
    }
  return smallest;
}

/// Moves every point from `first` on to the mean of those it shares a triangle with.
void even_out(const Triangles& triangles, std::size_t first, std::vector<Eigen::Vector2d>& points) {
  std::vector<Eigen::Vector2d> sum(points.size(), Eigen::Vector2d::Zero());
  std::vector<int> count(points.size(), 0);
  for (Eigen::Index t = 0; t < triangles.rows(); ++t)
    for (int k = 0; k < 3; ++k) {
      const auto vertex = static_cast<std::size_t>(triangles(t, k));
      for (const int other : {triangles(t, (k + 1) % 3), triangles(t, (k + 2) % 3)})
        sum[vertex] += points[static_cast<std::size_t>(other)];
      count[vertex] += 2;
    }
  for (std::size_t i = first; i < points.size(); ++i) points[i] = sum[i] / count[i];
}

InputError refused(const std::string& spec, const std::string& source, const std::string& field,
                   const std::string& expected) {
  const std::string what = "found \"" + spec + "\", expected " + expected;
  return field.empty() ? InputError(source + ": " + what) : input_error(source, field, what);
}

}  // namespace

TriangleMesh rectangle(const RectangleMesh& s) {
  expect_positive(s.width > 0 && s.height > 0 && s.cells_x > 0 && s.cells_y > 0,
                  "a rectangle needs sizes and cells above zero");
  std::mt19937 generator(s.seed);
  const int columns = s.cells_x + 1, rows = s.cells_y + 1;
  TriangleMesh mesh;
  mesh.vertices.resize(static_cast<Eigen::Index>(columns) * rows, 3);
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < columns; ++i) {
      Eigen::Vector2d cell(i, j);
      const bool inner = i > 0 && j > 0 && i < s.cells_x && j < s.cells_y;
      if (s.pattern == DiagonalPattern::jittered && inner) {
        cell.x() += uniform(generator, -s.jitter, s.jitter);
        cell.y() += uniform(generator, -s.jitter, s.jitter);
      }
      mesh.vertices.row(static_cast<Eigen::Index>(j) * columns + i) << s.width * cell.x() / s.cells_x,
          s.height * cell.y() / s.cells_y, 0;
    }
  mesh.triangles.resize(2 * static_cast<Eigen::Index>(s.cells_x) * s.cells_y, 3);
  Eigen::Index t = 0;
  for (int j = 0; j < s.cells_y; ++j)
    for (int i = 0; i < s.cells_x; ++i) {
      const int a = j * columns + i, b = a + 1, c = a + columns, d = c + 1;
      if (turns(s.pattern, i, j, generator)) {
        mesh.triangles.row(t++) << a, b, c;
        mesh.triangles.row(t++) << b, d, c;
      } else {
        mesh.triangles.row(t++) << a, b, d;
        mesh.triangles.row(t++) << a, d, c;
      }
    }
  return mesh;
}

TriangleMesh delaunay_rectangle(double width, double height, double cell, unsigned seed) {
  expect_positive(width > 0 && height > 0 && cell > 0, "a rectangle needs sizes and a cell above zero");
  const int nx = std::max(1, static_cast<int>(std::lround(width / cell)));
  const int ny = std::max(1, static_cast<int>(std::lround(height / cell)));
  std::vector<Eigen::Vector2d> points;
  for (int i = 0; i < nx; ++i) points.emplace_back(width * i / nx, 0);
  for (int j = 0; j < ny; ++j) points.emplace_back(width, height * j / ny);
  for (int i = nx; i > 0; --i) points.emplace_back(width * i / nx, height);
  for (int j = ny; j > 0; --j) points.emplace_back(0, height * j / ny);
  const std::size_t border = points.size();

  // As many inner points as a grid would have, thrown like darts; each keeps its distance, which shrinks
  // while none fits.
  std::mt19937 generator(seed);
  const std::size_t wanted = border + static_cast<std::size_t>(nx - 1) * static_cast<std::size_t>(ny - 1);
  for (double distance = 0.9 * cell; points.size() < wanted; distance *= 0.95)
    for (int attempt = 0; attempt < 200 && points.size() < wanted; ++attempt) {
      // One after the other: compilers differ in the order of two draws that are arguments of one call.
      const double y = uniform(generator, 0.4 * cell, height - 0.4 * cell);
      const double x = uniform(generator, 0.4 * cell, width - 0.4 * cell);
      const Eigen::Vector2d p(x, y);
      const bool fits = std::none_of(points.begin(), points.end(), [&](const Eigen::Vector2d& q) {
        return (p - q).squaredNorm() < distance * distance;
      });
      if (fits) points.push_back(p);
    }

  // Where darts left a thin triangle, the inner points go to the middle of their neighbours.
  constexpr double thin = 15 * std::numbers::pi / 180;
  constexpr int most_rounds = 50;
  TriangleMesh mesh;
  mesh.triangles = delaunay(points);
  for (int round = 0; round < most_rounds && smallest_angle(points, mesh.triangles) < thin; ++round) {
    even_out(mesh.triangles, border, points);
    mesh.triangles = delaunay(points);
  }
  mesh.vertices.setZero(static_cast<Eigen::Index>(points.size()), 3);
  for (std::size_t i = 0; i < points.size(); ++i)
    mesh.vertices.row(static_cast<Eigen::Index>(i)).head<2>() = points[i].transpose();
  return mesh;
}

TriangleMesh disc(double radius, double cell) {
  expect_positive(radius > 0 && cell > 0, "a disc needs a radius and a cell above zero");
  const int rings = std::max(1, static_cast<int>(std::lround(radius / cell)));
  TriangleMesh mesh;
  mesh.vertices.setZero(1 + 3 * static_cast<Eigen::Index>(rings) * (rings + 1), 3);
  mesh.triangles.resize(6 * static_cast<Eigen::Index>(rings) * rings, 3);
  // Ring r has 6 r vertices; between two rings each of six sectors is a strip of 2 r - 1 triangles.
  const auto first = [](int ring) { return ring == 0 ? 0 : 1 + 3 * (ring - 1) * ring; };
  const auto vertex = [&](int ring, int i) { return ring == 0 ? 0 : first(ring) + i % (6 * ring); };
  Eigen::Index t = 0;
  for (int r = 1; r <= rings; ++r) {
    for (int i = 0; i < 6 * r; ++i) {
      const double angle = 2 * std::numbers::pi * i / (6.0 * r);
      mesh.vertices.row(first(r) + i) << radius * r / rings * std::cos(angle),
          radius * r / rings * std::sin(angle), 0;
    }
    for (int sector = 0; sector < 6; ++sector)
      for (int i = 0; i < r; ++i) {
        const int outer = sector * r + i, inner = sector * (r - 1) + i;
        mesh.triangles.row(t++) << vertex(r - 1, inner), vertex(r, outer), vertex(r, outer + 1);
        if (i + 1 < r)
          mesh.triangles.row(t++) << vertex(r - 1, inner), vertex(r, outer + 1), vertex(r - 1, inner + 1);
      }
  }
  return mesh;
}

TetMesh tet_box(const Eigen::Vector3d& size, const Eigen::Vector3i& cells) {
  expect_positive((size.array() > 0).all() && (cells.array() > 0).all(),
                  "a box needs sizes and cells above zero");
  const int nx = cells.x() + 1, ny = cells.y() + 1;
  const auto vertex = [&](int i, int j, int k) { return (k * ny + j) * nx + i; };
  TetMesh mesh;
  mesh.vertices.resize(static_cast<Eigen::Index>(nx) * ny * (cells.z() + 1), 3);
  for (int k = 0; k <= cells.z(); ++k)
    for (int j = 0; j <= cells.y(); ++j)
      for (int i = 0; i <= cells.x(); ++i)
        mesh.vertices.row(vertex(i, j, k)) =
            size.cwiseProduct(Eigen::Vector3d(i, j, k)).cwiseQuotient(cells.cast<double>()).transpose();

  // Corners of a cell by bits x, y, z; four corner tetrahedra around a middle one.
  constexpr int kCell[5][4] = {{0, 3, 5, 6}, {1, 0, 3, 5}, {2, 0, 6, 3}, {4, 0, 5, 6}, {7, 3, 6, 5}};
  mesh.tetrahedra.resize(5 * static_cast<Eigen::Index>(cells.prod()), 4);
  Eigen::Index t = 0;
  for (int k = 0; k < cells.z(); ++k)
    for (int j = 0; j < cells.y(); ++j)
      for (int i = 0; i < cells.x(); ++i) {
        const bool mirrored = (i + j + k) % 2 == 1;
        for (const auto& tetrahedron : kCell) {
          Eigen::Vector4i corners;
          for (int c = 0; c < 4; ++c) {
            const int bits = mirrored ? tetrahedron[c] ^ 1 : tetrahedron[c];
            corners[c] = vertex(i + (bits & 1), j + (bits >> 1 & 1), k + (bits >> 2 & 1));
          }
          const Eigen::Vector3d x0 = mesh.vertices.row(corners[0]);
          Eigen::Matrix3d edges;
          for (int c = 1; c < 4; ++c) edges.col(c - 1) = mesh.vertices.row(corners[c]).transpose() - x0;
          if (edges.determinant() < 0) std::swap(corners[2], corners[3]);
          mesh.tetrahedra.row(t++) = corners.transpose();
        }
      }
  return mesh;
}

const char* to_string(DiagonalPattern pattern) {
  switch (pattern) {
    case DiagonalPattern::one_way:
      return "one_way";
    case DiagonalPattern::alternating:
      return "alternating";
    case DiagonalPattern::alternating_by_row:
      return "alternating_by_row";
    case DiagonalPattern::jittered:
      return "jittered";
  }
  return "";
}

bool is_mesh_spec(const std::string& text) {
  return text.starts_with("sheet:") || text.starts_with("disc:") || text.starts_with("tshirt:") ||
         text.starts_with("shorts:");
}

TriangleMesh parse_mesh_spec(const std::string& spec, const std::string& source, const std::string& field) {
  const auto fail = [&](const std::string& expected) { return refused(spec, source, field, expected); };
  const std::string form =
      "sheet:WIDTHxHEIGHT:CELL[:PATTERN], disc:RADIUS:CELL, tshirt:CELL or shorts:CELL in metres, such as "
      "sheet:0.4x0.4:0.01";
  const auto length = [&](std::string_view word) {
    const std::optional<double> value = parse_number(word);
    if (!value || !std::isfinite(*value) || *value <= 0) throw fail(form);
    return *value;
  };
  const std::vector<std::string_view> parts = split(spec, ":");
  const auto garment_cell = [&](double largest) {
    constexpr double smallest = 1e-3;
    const double cell = parts.size() == 2 ? length(parts[1]) : length("");
    if (cell < smallest || cell > largest)
      throw fail("cells from " + format_short(smallest) + " to " + format_short(largest) + " m");
    return cell;
  };
  if (spec.starts_with("tshirt:")) {
    TshirtMesh settings;
    settings.cell = garment_cell(settings.sleeve / 4);
    return tshirt(settings);
  }
  if (spec.starts_with("shorts:")) {
    ShortsMesh settings;
    settings.cell = garment_cell(settings.leg / 4);
    return shorts(settings);
  }
  if (!is_mesh_spec(spec) || parts.size() < 3) throw fail(form);
  const double cell = length(parts[2]);
  const auto expect_cells = [&](double cells) {
    if (cells > 1e6) throw fail("at most 1,000,000 cells");
  };
  if (parts[0] == "disc") {
    if (parts.size() != 3) throw fail(form);
    const double radius = length(parts[1]);
    if (cell > radius) throw fail("cells of at most the radius, " + format_short(radius) + " m");
    expect_cells(3 * radius * radius / (cell * cell));
    return disc(radius, cell);
  }
  const std::vector<std::string_view> sizes = split(parts[1], "x");
  if (sizes.size() != 2 || parts.size() > 4) throw fail(form);
  const double width = length(sizes[0]), height = length(sizes[1]);
  if (const double shorter = std::min(width, height); cell > shorter)
    throw fail("cells of at most the shorter side of the sheet, " + format_short(shorter) + " m");
  const double cells = std::max(1.0, width / cell) * std::max(1.0, height / cell);
  expect_cells(cells);
  if (parts.size() == 4 && parts[3] == "delaunay") {
    if (cells > 2e4) throw fail("at most 20,000 cells of this pattern");
    return delaunay_rectangle(width, height, cell, 1);
  }
  RectangleMesh settings;
  settings.width = width;
  settings.height = height;
  settings.cells_x = std::max(1, static_cast<int>(std::lround(width / cell)));
  settings.cells_y = std::max(1, static_cast<int>(std::lround(height / cell)));
  if (parts.size() == 4) {
    bool known = false;
    for (const DiagonalPattern pattern : {DiagonalPattern::one_way, DiagonalPattern::alternating,
                                          DiagonalPattern::alternating_by_row, DiagonalPattern::jittered})
      if (parts[3] == to_string(pattern)) {
        settings.pattern = pattern;
        known = true;
      }
    if (!known) throw fail("pattern one_way, alternating, alternating_by_row, jittered or delaunay");
  }
  return rectangle(settings);
}

bool is_tet_mesh_spec(const std::string& text) { return text.starts_with("box:"); }

TetMesh parse_tet_mesh_spec(const std::string& spec, const std::string& source, const std::string& field) {
  constexpr double most_cells = 1e5;
  const auto fail = [&](const std::string& expected) { return refused(spec, source, field, expected); };
  const auto length = [&](std::string_view word) {
    const std::optional<double> value = parse_number(word);
    if (!value || !std::isfinite(*value) || *value <= 0)
      throw fail("box:WIDTHxDEPTHxHEIGHT:CELL in metres, such as box:0.1x0.03x0.03:0.01");
    return *value;
  };
  const std::vector<std::string_view> parts = split(spec, ":");
  const std::vector<std::string_view> sizes =
      parts.size() == 3 ? split(parts[1], "x") : std::vector<std::string_view>();
  if (sizes.size() != 3) length("");
  const double cell = length(parts[2]);
  Eigen::Vector3d size;
  for (int axis = 0; axis < 3; ++axis) size[axis] = length(sizes[static_cast<std::size_t>(axis)]);
  const Eigen::Array3d cells = (size.array() / cell).round().max(1.0);
  if (!(cells.prod() <= most_cells))
    throw fail("at most " + format_count(std::size_t(most_cells)) + " cells");
  return tet_box(size, cells.cast<int>());
}

}  // namespace flash::data
