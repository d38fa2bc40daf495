#include "data/mesh/procedural_mesh.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <vector>

#include "data/files/error.h"
#include "data/mesh/mesh_io.h"

namespace flash::data {
namespace {

double area(const TriangleMesh& mesh) {
  double sum = 0;
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t) {
    const Eigen::Vector3d a = mesh.vertices.row(mesh.triangles(t, 0)),
                          b = mesh.vertices.row(mesh.triangles(t, 1)),
                          c = mesh.vertices.row(mesh.triangles(t, 2));
    sum += (b - a).cross(c - a).z() / 2;  // signed: every triangle has to face +z
  }
  return sum;
}

bool all_face_up(const TriangleMesh& mesh) {
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t) {
    TriangleMesh one{mesh.vertices, mesh.triangles.row(t)};
    if (area(one) <= 0) return false;
  }
  return true;
}

/// How many triangles use each undirected edge.
std::map<std::pair<int, int>, int> edge_use(const TriangleMesh& mesh) {
  std::map<std::pair<int, int>, int> use;
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t)
    for (int k = 0; k < 3; ++k) {
      const int a = mesh.triangles(t, k), b = mesh.triangles(t, (k + 1) % 3);
      ++use[std::minmax(a, b)];
    }
  return use;
}

void expect_disc_topology(const TriangleMesh& mesh) {
  const auto use = edge_use(mesh);
  for (const auto& [edge, count] : use) ASSERT_LE(count, 2);
  // Euler characteristic of a disc.
  EXPECT_EQ(mesh.vertices.rows() - static_cast<long>(use.size()) + mesh.triangles.rows(), 1);
}

TEST(ProceduralMesh, EveryPatternCoversTheRectangleOnce) {
  for (const char* pattern : {"one_way", "alternating", "alternating_by_row", "jittered", "delaunay"}) {
    SCOPED_TRACE(pattern);
    const TriangleMesh mesh = parse_mesh_spec(std::string("sheet:0.3x0.2:0.02:") + pattern);
    check_triangle_mesh(mesh, pattern);
    EXPECT_TRUE(all_face_up(mesh));
    EXPECT_NEAR(area(mesh), 0.06, 1e-14);
    EXPECT_EQ(mesh.vertices.rows(), 16 * 11);
    expect_disc_topology(mesh);
  }
}

TEST(ProceduralMesh, PatternsTurnDiagonalsAsNamed) {
  // A cell (i, j) is turned when its first triangle is (a, b, c) rather than (a, b, d).
  const auto turned = [](const TriangleMesh& mesh, int i, int j, int cells_x) {
    const Eigen::Index first = 2 * (static_cast<Eigen::Index>(j) * cells_x + i);
    return mesh.triangles(first, 2) == (j + 1) * (cells_x + 1) + i;
  };
  RectangleMesh settings{0.4, 0.3, 4, 3, DiagonalPattern::one_way};
  const TriangleMesh one_way = rectangle(settings);
  settings.pattern = DiagonalPattern::alternating;
  const TriangleMesh alternating = rectangle(settings);
  settings.pattern = DiagonalPattern::alternating_by_row;
  const TriangleMesh by_row = rectangle(settings);
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 4; ++i) {
      EXPECT_FALSE(turned(one_way, i, j, 4));
      EXPECT_EQ(turned(alternating, i, j, 4), (i + j) % 2 == 1);
      EXPECT_EQ(turned(by_row, i, j, 4), j % 2 == 1);
    }
}

TEST(ProceduralMesh, JitterKeepsTheBorderAndTheSeed) {
  RectangleMesh settings{0.4, 0.4, 10, 10, DiagonalPattern::jittered};
  const TriangleMesh a = rectangle(settings), b = rectangle(settings);
  EXPECT_EQ(a.vertices, b.vertices);
  settings.seed = 2;
  EXPECT_NE(rectangle(settings).vertices, a.vertices);
  settings.pattern = DiagonalPattern::one_way;
  const TriangleMesh regular = rectangle(settings);
  for (int j = 0; j <= 10; ++j)
    for (int i = 0; i <= 10; ++i) {
      const int v = j * 11 + i;
      const double moved = (a.vertices.row(v) - regular.vertices.row(v)).cwiseAbs().maxCoeff();
      const bool border = i == 0 || j == 0 || i == 10 || j == 10;
      EXPECT_LE(moved, border ? 0 : 0.25 * 0.04);
    }
}

TEST(ProceduralMesh, CircumcirclesOfTheDelaunayMeshAreEmpty) {
  for (const unsigned seed : {1u, 7u, 11u, 42u}) {
    const TriangleMesh mesh = delaunay_rectangle(0.2, 0.2, 0.02, seed);
    for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t) {
      const Eigen::Vector2d a = mesh.vertices.row(mesh.triangles(t, 0)).head<2>(),
                            b = mesh.vertices.row(mesh.triangles(t, 1)).head<2>(),
                            c = mesh.vertices.row(mesh.triangles(t, 2)).head<2>();
      Eigen::Matrix2d edges;
      edges << (b - a).transpose(), (c - a).transpose();
      const Eigen::Vector2d centre =
          a + edges.inverse() * Eigen::Vector2d((b - a).squaredNorm() / 2, (c - a).squaredNorm() / 2);
      const double radius = (a - centre).norm();
      for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v)
        // 1e-9 m: rounding of circumcentres; border points may lie exactly on a circle.
        ASSERT_GE((mesh.vertices.row(v).head<2>().transpose() - centre).norm(), radius - 1e-9);
    }
    expect_disc_topology(mesh);
    EXPECT_NEAR(area(mesh), 0.04, 1e-15);
  }
}

double smallest_angle(const TriangleMesh& mesh) {
  double smallest = std::numbers::pi;
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t)
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d corner = mesh.vertices.row(mesh.triangles(t, k));
      const Eigen::Vector3d a = mesh.vertices.row(mesh.triangles(t, (k + 1) % 3)).transpose() - corner;
      const Eigen::Vector3d b = mesh.vertices.row(mesh.triangles(t, (k + 2) % 3)).transpose() - corner;
      smallest = std::min(smallest, std::atan2(a.cross(b).norm(), a.dot(b)));
    }
  return smallest * 180 / std::numbers::pi;
}

// Even points on the border lie on many common circles: rounding once made triangles without an area of them.
// The first dart that lands and stays, by the generator that the standard defines: the mesh of a
// specification is the same whatever compiler built the program.
TEST(ProceduralMesh, DartsOfTheDelaunayMeshAreThrownByHeightThenByWidth) {
  const double width = 0.8, height = 0.4, cell = 0.1;
  std::mt19937 generator(3);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(generator()) / 0x1p32;
  };
  const double y = uniform(0.4 * cell, height - 0.4 * cell), x = uniform(0.4 * cell, width - 0.4 * cell);
  const TriangleMesh mesh = delaunay_rectangle(width, height, cell, 3);
  EXPECT_NEAR((mesh.vertices.rowwise() - Eigen::RowVector3d(x, y, 0)).rowwise().norm().minCoeff(), 0, 1e-15);
}

TEST(ProceduralMesh, DelaunayMeshesOfAnySizeCoverItWithoutThinTriangles) {
  std::mt19937 generator(1);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(generator()) / 4294967296.0;
  };
  std::vector<std::array<double, 3>> sizes = {
      {0.3177, 0.2485, 0.02118}, {0.2223, 0.4269, 0.07}, {1, 1, 0.02}};
  for (int k = 0; k < 500; ++k) {
    const double width = uniform(0.05, 0.6), height = uniform(0.05, 0.6), side = std::min(width, height);
    sizes.push_back({width, height, std::max(side / uniform(1, 15), std::sqrt(width * height / 400))});
  }
  for (const auto& [width, height, cell] : sizes) {
    SCOPED_TRACE(std::to_string(width) + " x " + std::to_string(height) + ", cell " + std::to_string(cell));
    const TriangleMesh mesh = delaunay_rectangle(width, height, cell, 1);
    ASSERT_NO_THROW(check_triangle_mesh(mesh, "mesh"));
    ASSERT_NEAR(area(mesh) / (width * height), 1, 1e-13);  // rounding of some hundred sums
    if (cell <= std::min(width, height)) {
      ASSERT_GE(smallest_angle(mesh), 15);
    }
  }
}

TEST(ProceduralMesh, DiscIsRoundAndClosed) {
  const TriangleMesh mesh = disc(0.1, 0.01);
  EXPECT_EQ(mesh.vertices.rows(), 331);
  check_triangle_mesh(mesh, "disc");
  EXPECT_TRUE(all_face_up(mesh));
  expect_disc_topology(mesh);
  // Area of the regular polygon of 60 corners.
  EXPECT_NEAR(area(mesh), 30 * 0.01 * std::sin(2 * std::numbers::pi / 60), 1e-12);
}

TEST(ProceduralMesh, TetBoxFillsItsVolumeWithMatchingFaces) {
  const TetMesh mesh = tet_box({0.1, 0.03, 0.02}, {5, 3, 2});
  double volume = 0;
  std::map<std::array<int, 3>, int> faces;
  for (Eigen::Index t = 0; t < mesh.tetrahedra.rows(); ++t) {
    const Eigen::Vector4i v = mesh.tetrahedra.row(t);
    Eigen::Matrix3d edges;
    for (int k = 1; k < 4; ++k) edges.col(k - 1) = mesh.vertices.row(v[k]) - mesh.vertices.row(v[0]);
    EXPECT_GT(edges.determinant(), 0);
    volume += edges.determinant() / 6;
    for (int omitted = 0; omitted < 4; ++omitted) {
      std::array<int, 3> face{};
      for (int k = 0, f = 0; k < 4; ++k)
        if (k != omitted) face[static_cast<std::size_t>(f++)] = v[k];
      std::sort(face.begin(), face.end());
      ++faces[face];
    }
  }
  EXPECT_NEAR(volume, 0.1 * 0.03 * 0.02, 1e-16);
  const long border =
      std::count_if(faces.begin(), faces.end(), [](const auto& face) { return face.second == 1; });
  EXPECT_EQ(border, 2 * 2 * (5 * 3 + 5 * 2 + 3 * 2));
  for (const auto& [face, count] : faces) EXPECT_LE(count, 2);
}

TEST(ProceduralMesh, CellsAreRoundedToFit) {
  const TriangleMesh mesh = parse_mesh_spec("sheet:0.278x0.278:0.01");
  EXPECT_EQ(mesh.vertices.rows(), 29 * 29);
  EXPECT_DOUBLE_EQ(mesh.vertices.col(0).maxCoeff(), 0.278);
}

TEST(ProceduralMesh, WrongSpecsNameFileFieldFoundAndExpected) {
  for (const char* spec : {"sheet:0.4:0.01", "sheet:0.4x0.4", "sheet:0.4xa:0.01", "sheet:0.4x0.4:0",
                           "sheet:0.4x0.4:0.01:odd", "disc:0.1:0.01:x", "sheet:400x400:0.01",
                           "sheet:-1x1:0.1", "disc:", "sheet:0.4x0.2:0.21", "disc:0.1:0.11"}) {
    try {
      parse_mesh_spec(spec, "recording.json", "object.mesh");
      FAIL() << spec;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what())
                    .find("recording.json: object.mesh: found \"" + std::string(spec) + "\", expected"),
                std::string::npos)
          << error.what();
    }
  }
}

}  // namespace
}  // namespace flash::data
