#include "data/mesh/connected_parts.h"

#include <gtest/gtest.h>

#include "data/mesh/procedural_mesh.h"

namespace flash::data {
namespace {

TEST(ConnectedParts, AreTheMeshesThatWerePutTogether) {
  const TriangleMesh sheet = parse_mesh_spec("sheet:0.2x0.1:0.05"), disc = parse_mesh_spec("disc:0.1:0.05");
  TriangleMesh both;
  const Eigen::Index first = sheet.vertices.rows();
  both.vertices.resize(first + disc.vertices.rows() + 1, 3);  // and a vertex of no triangle
  both.vertices << sheet.vertices, disc.vertices, Eigen::RowVector3d::Zero();
  both.triangles.resize(sheet.triangles.rows() + disc.triangles.rows(), 3);
  both.triangles << disc.triangles.array() + int(first), sheet.triangles;
  const std::vector<TriangleMesh> parts = connected_parts(both);
  ASSERT_EQ(parts.size(), 2u);
  EXPECT_EQ(parts[0].vertices, sheet.vertices);
  EXPECT_EQ(parts[0].triangles, sheet.triangles);
  EXPECT_EQ(parts[1].vertices, disc.vertices);
  EXPECT_EQ(parts[1].triangles, disc.triangles);
  EXPECT_TRUE(connected_parts({}).empty());
}

}  // namespace
}  // namespace flash::data
