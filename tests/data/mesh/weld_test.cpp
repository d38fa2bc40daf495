#include "data/mesh/weld.h"

#include <gtest/gtest.h>

#include "data/files/error.h"
#include "data/mesh/mesh_io.h"
#include "tests/data/temporary_folder.h"

namespace flash::data {
namespace {

TEST(Weld, VerticesInOnePlaceBecomeTheFirstAndKeepTheirOrder) {
  TriangleMesh mesh{Points(7, 3), Triangles(2, 3)};
  mesh.vertices << 9, 9, 9, 0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 0, 0, 1, 1, 0, -0.0, 1, 0;
  mesh.triangles << 1, 2, 3, 6, 4, 5;
  EXPECT_EQ(doubled_vertices(mesh.vertices), 2u);
  const TriangleMesh joined = welded(mesh);
  EXPECT_EQ(joined.vertices, (Points(4, 3) << 0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0).finished());
  EXPECT_EQ(joined.triangles, (Triangles(2, 3) << 0, 1, 2, 2, 1, 3).finished());
}

TEST(Weld, TetrahedraAreJoinedOnLoading) {
  const TemporaryFolder folder;
  const std::string path = folder.write("two.tet",
                                        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nt 1 2 3 4\n"
                                        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 -1\nt 5 7 6 8\n");
  try {
    load_tet_mesh(path);
    FAIL() << "two tetrahedra that are not joined were taken";
  } catch (const InputError& error) {
    EXPECT_NE(
        std::string(error.what()).find("3 of its 8 vertices stand where another does; flash-sim mesh --weld"),
        std::string::npos)
        << error.what();
  }
  const TetMesh joined = load_tet_mesh(path, true);
  EXPECT_EQ(joined.vertices.rows(), 5);
  EXPECT_EQ(joined.tetrahedra.rows(), 2);
}

}  // namespace
}  // namespace flash::data
