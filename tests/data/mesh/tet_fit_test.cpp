#include "data/mesh/tet_fit.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <map>
#include <set>
#include <vector>

#include "data/mesh/mesh_io.h"
#include "data/mesh/procedural_mesh.h"
#include "data/mesh/weld.h"
#include "tests/data/temporary_folder.h"

namespace flash::data {
namespace {

/// Cubes on a grid, each of five tetrahedra; all split alike, or each as the mirror of its neighbours.
TetMesh cubes(int nx, int ny, int nz, bool mirrored) {
  TetMesh mesh;
  mesh.vertices.resize((nx + 1) * (ny + 1) * (nz + 1), 3);
  const auto vertex = [&](int i, int j, int k) { return i + (nx + 1) * (j + (ny + 1) * k); };
  for (int k = 0; k <= nz; ++k)
    for (int j = 0; j <= ny; ++j)
      for (int i = 0; i <= nx; ++i) mesh.vertices.row(vertex(i, j, k)) << i, j, k;
  std::vector<std::array<int, 4>> tets;
  for (int k = 0; k < nz; ++k)
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i) {
        const bool mirror = mirrored && (i + j + k) % 2 == 1;
        const auto corner = [&](int bits) {
          return vertex(i + ((bits & 1) != int(mirror)), j + (bits >> 1 & 1), k + (bits >> 2));
        };
        for (const std::array<int, 4>& t :
             {std::array{0, 3, 5, 6}, std::array{1, 0, 3, 5}, std::array{2, 0, 3, 6}, std::array{4, 0, 5, 6},
              std::array{7, 3, 5, 6}})
          tets.push_back({corner(t[0]), corner(t[1]), corner(t[2]), corner(t[3])});
      }
  mesh.tetrahedra.resize(Eigen::Index(tets.size()), 4);
  for (std::size_t t = 0; t < tets.size(); ++t) {
    Eigen::Vector4i row(tets[t].data());
    const auto x = [&](int n) { return Eigen::Vector3d(mesh.vertices.row(row[n])); };
    if ((x(1) - x(0)).cross(x(2) - x(0)).dot(x(3) - x(0)) < 0) std::swap(row[2], row[3]);
    mesh.tetrahedra.row(Eigen::Index(t)) = row;
  }
  return mesh;
}

std::string message_of(const TetMesh& mesh) {
  return input_error_of([&] { check_tet_mesh(mesh, "a.vtk"); });
}

/// Each tetrahedron a body of its own.
TetMesh apart(const TetMesh& mesh) {
  TetMesh result{Points(4 * mesh.tetrahedra.rows(), 3), mesh.tetrahedra};
  for (Eigen::Index t = 0; t < mesh.tetrahedra.rows(); ++t)
    for (int k = 0; k < 4; ++k) {
      result.vertices.row(4 * t + k) = mesh.vertices.row(mesh.tetrahedra(t, k));
      result.tetrahedra(t, k) = int(4 * t + k);
    }
  return result;
}

void add(const TetMesh& more, TetMesh& mesh) {
  const Eigen::Index n = mesh.vertices.rows(), m = mesh.tetrahedra.rows();
  mesh.vertices.conservativeResize(n + more.vertices.rows(), 3);
  mesh.tetrahedra.conservativeResize(m + more.tetrahedra.rows(), 4);
  mesh.vertices.bottomRows(more.vertices.rows()) = more.vertices;
  mesh.tetrahedra.bottomRows(more.tetrahedra.rows()) = more.tetrahedra.array() + int(n);
}

TEST(TetFit, CubesThatAreSplitAlikeAreRefusedWithBothFaces) {
  const TetMesh alike = cubes(4, 1, 1, false);
  ASSERT_EQ(alike.tetrahedra.rows(), 20);
  const std::string said = message_of(alike);
  EXPECT_NE(said.find("a.vtk: tetrahedron "), std::string::npos) << said;
  EXPECT_NE(said.find("lies against the face of vertices "), std::string::npos) << said;
  EXPECT_NE(said.find("expected neighbours that share whole faces"), std::string::npos) << said;
  const auto misfit = first_misfit(alike);
  ASSERT_TRUE(misfit);
  for (const int vertex : misfit->first)  // both stand in the plane between two cubes
    EXPECT_EQ(alike.vertices(vertex, 0), alike.vertices(misfit->second[0], 0));
  EXPECT_EQ(message_of(cubes(4, 1, 1, true)), "");
  EXPECT_EQ(message_of(cubes(3, 4, 2, true)), "");
}

// The square between two cubes need not be flat.
TEST(TetFit, ABentSquareThatIsCutBothWaysIsRefused) {
  for (const double bend : {0.2, 1e-3, -1e-3, -0.2}) {
    for (const int wide : {1, 3}) {
      TetMesh alike = cubes(2, wide, wide, false), mirrored = cubes(2, wide, wide, true);
      const int middle = 1 + 3 * (wide / 2) + 3 * (wide + 1) * (wide / 2);
      alike.vertices(middle, 0) += bend;
      mirrored.vertices(middle, 0) += bend;
      EXPECT_NE(message_of(alike), "") << bend << ' ' << wide;
      EXPECT_EQ(message_of(mirrored), "") << bend << ' ' << wide;
    }
  }
}

TEST(TetFit, AFaceAgainstTwoSmallerOnesIsRefused) {
  TetMesh mesh{Points(5, 3), Tetrahedra(1, 4)};
  mesh.vertices << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0.5, 0.5, 0;
  // Above the face 0 1 2 one tetrahedron, below two, over the middle of its edge 1 - 2.
  mesh.vertices.conservativeResize(6, 3);
  mesh.vertices.row(5) << 0.3, 0.3, -1;
  mesh.tetrahedra.resize(3, 4);
  mesh.tetrahedra << 0, 1, 2, 3, 0, 4, 1, 5, 0, 2, 4, 5;
  EXPECT_NE(message_of(mesh).find("lies against"), std::string::npos) << message_of(mesh);
}

TEST(TetFit, DoubledVerticesAreCountedAndOfferedForWelding) {
  const TetMesh whole = cubes(2, 1, 1, true);
  const std::string said = message_of(apart(whole));
  EXPECT_NE(said.find("stands in the place of the face of vertices"), std::string::npos) << said;
  EXPECT_NE(said.find("28 of its 40 vertices stand where another does; flash-sim mesh --weld joins them"),
            std::string::npos)
      << said;
  const TetMesh joined = welded(apart(whole));
  EXPECT_EQ(joined.vertices.rows(), whole.vertices.rows());
  EXPECT_EQ(message_of(joined), "");
}

TEST(TetFit, BodiesApartAreLeftAlone) {
  TetMesh two = cubes(1, 1, 1, true), other = two;
  other.vertices.col(0).array() += 1.001;
  add(other, two);
  EXPECT_EQ(message_of(two), "");
  TetMesh touching = cubes(1, 1, 1, true), corner = touching;
  corner.vertices.array() += 1;  // a corner on a corner
  add(corner, touching);
  EXPECT_EQ(message_of(touching), "");
}

TEST(TetFit, BodiesThatOverlapAreRefused) {
  TetMesh two = cubes(1, 1, 1, true), other = two;
  other.vertices.rowwise() += Eigen::RowVector3d(0.4, 0.3, 0.2);
  add(other, two);
  EXPECT_NE(message_of(two).find("passes through"), std::string::npos) << message_of(two);
  TetMesh twice = cubes(1, 1, 1, true);
  add(cubes(1, 1, 1, true), twice);
  EXPECT_NE(message_of(twice).find("stands in the place of"), std::string::npos) << message_of(twice);
}

// A tetrahedron that is cut at a point inside it has the outer faces of a whole one.
TEST(TetFit, ATetrahedronThatIsCutFromWithinFits) {
  TetMesh mesh{Points(5, 3), Tetrahedra(4, 4)};
  mesh.vertices << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0.2, 0.2, 0.2;
  mesh.tetrahedra << 4, 1, 2, 3, 0, 4, 2, 3, 0, 1, 4, 3, 0, 1, 2, 4;
  EXPECT_EQ(message_of(mesh), "");
}

TEST(TetFit, MeshesMadeOnTheSpotFit) {
  for (const char* spec : {"box:0.1x0.1x0.1:0.02", "box:0.1x0.03x0.02:0.005"})
    EXPECT_EQ(message_of(parse_tet_mesh_spec(spec, "mesh", "mesh")), "") << spec;
}

}  // namespace
}  // namespace flash::data
