#include "data/mesh/stl.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <limits>

#include "data/files/text.h"
#include "data/mesh/procedural_mesh.h"
#include "tests/data/temporary_folder.h"

namespace flash::data {
namespace {

std::string ascii_stl(const TriangleMesh& mesh) {
  std::string text = "solid sheet\n";
  for (Eigen::Index i = 0; i < mesh.triangles.rows(); ++i) {
    text += "  facet normal 0 0 1\n    outer loop\n";
    for (int k = 0; k < 3; ++k) {
      text += "      vertex";
      for (const double x : mesh.vertices.row(mesh.triangles(i, k))) text += ' ' + format_number(x);
      text += '\n';
    }
    text += "    endloop\n  endfacet\n";
  }
  return text + "endsolid sheet\n";
}

std::string binary_stl(const TriangleMesh& mesh) {
  std::string bytes = "solid: a title that lies about the format";
  bytes.resize(80, '\0');
  const auto append = [&](auto value) { bytes.append(reinterpret_cast<const char*>(&value), sizeof value); };
  append(std::uint32_t(mesh.triangles.rows()));
  for (Eigen::Index i = 0; i < mesh.triangles.rows(); ++i) {
    for (const float n : {0.f, 0.f, 1.f}) append(n);
    for (int k = 0; k < 3; ++k)
      for (const double x : mesh.vertices.row(mesh.triangles(i, k))) append(float(x));
    append(std::uint16_t(0));
  }
  return bytes;
}

// The corners of every triangle, in order: what STL says.
Points corners(const Points& points, const Triangles& triangles) {
  Points result(3 * triangles.rows(), 3);
  for (Eigen::Index i = 0; i < triangles.rows(); ++i)
    for (int k = 0; k < 3; ++k) result.row(3 * i + k) = points.row(triangles(i, k));
  return result;
}

TEST(Stl, FacetsShareTheirVerticesAgain) {
  const TriangleMesh mesh = delaunay_rectangle(0.3, 0.2, 0.05, 3);
  const Geometry ascii = parse_stl(ascii_stl(mesh), "a.stl");
  EXPECT_EQ(ascii.points.rows(), mesh.vertices.rows());
  EXPECT_EQ(corners(ascii.points, ascii.triangles), corners(mesh.vertices, mesh.triangles));
  const Geometry binary = parse_stl(binary_stl(mesh), "a.stl");
  EXPECT_EQ(binary.points.rows(), mesh.vertices.rows());
  EXPECT_EQ(corners(binary.points, binary.triangles),
            corners(mesh.vertices.cast<float>().cast<double>(), mesh.triangles));
}

TEST(Stl, DamageIsNamed) {
  const TemporaryFolder folder;
  const TriangleMesh mesh = delaunay_rectangle(0.3, 0.2, 0.1, 3);
  const std::string ascii = ascii_stl(mesh), binary = binary_stl(mesh);
  const auto message = [&](const std::string& bytes) {
    const std::string path = folder.write("a.stl", bytes),
                      text = input_error_of([&] { load_triangle_mesh(path); });
    EXPECT_TRUE(text.starts_with(path)) << text;
    return text.substr(std::min(path.size(), text.size()));
  };
  EXPECT_EQ(message(ascii.substr(0, ascii.size() / 2 + 3)).substr(0, 2), ": ");
  EXPECT_EQ(message("solid a\nvertex 0 0\nendsolid\n"),
            ": line 2: found \"vertex 0 0\", expected vertex x y z");
  EXPECT_EQ(message("solid a\nendsolid\n"), ": found no triangles");
  EXPECT_NE(message(binary.substr(0, binary.size() - 5)).find("bytes, expected"), std::string::npos);
  EXPECT_NE(message("STL").find("not an STL file"), std::string::npos);
  std::string not_finite = binary;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  std::memcpy(not_finite.data() + 84 + 12, &nan, sizeof nan);
  EXPECT_NE(message(not_finite).find("points are not finite"), std::string::npos);
}

// A solid's surface by other hands: closed, every edge in two triangles, and the volume its makers name.
TEST(Stl, MeasuredBeamIsClosed) {
  const std::string path = std::string(FLASH_SHARED_DIR) + "/data/beam/beam.stl";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "no " << path;
  const TriangleMesh beam = load_triangle_mesh(path);
  EXPECT_EQ(beam.triangles.rows(), 1596);
  EXPECT_EQ(beam.vertices.rows() - beam.triangles.rows() / 2, 2);  // Euler: V - E + F = 2 with E = 3 F / 2
  double volume = 0;
  for (Eigen::Index i = 0; i < beam.triangles.rows(); ++i) {
    const Eigen::Vector3d a = beam.vertices.row(beam.triangles(i, 0)),
                          b = beam.vertices.row(beam.triangles(i, 1)),
                          c = beam.vertices.row(beam.triangles(i, 2));
    volume += a.cross(b).dot(c) / 6;
  }
  EXPECT_NEAR(volume, 30.0 * 30.0 * 100.0, 1e-3 * 9e4);  // 30 x 30 x 100 mm; the file is in millimetres
}

}  // namespace
}  // namespace flash::data
