#include "data/mesh/halved_tets.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "data/mesh/procedural_mesh.h"
#include "data/mesh/tet_faces.h"

namespace flash::data {
namespace {

double volume_of(const TetMesh& mesh, Eigen::Index t) {
  const auto corner = [&](int k) -> Eigen::Vector3d {
    return mesh.vertices.row(mesh.tetrahedra(t, k)).transpose();
  };
  return (corner(1) - corner(0)).dot((corner(2) - corner(0)).cross(corner(3) - corner(0))) / 6;
}

TEST(HalvedTets, FillTheSameBodyWithoutGapsOrOverlaps) {
  TetMesh mesh = tet_box({0.1, 0.04, 0.03}, {3, 2, 1});
  // Bent, so that no two tetrahedra are alike.
  for (auto row : mesh.vertices.rowwise())
    row += 0.2 * Eigen::RowVector3d(row.y() * row.x(), row.z(), row.x() * row.x());
  for (int times = 0; times < 2; ++times) {
    const HalvedTets finer = halved(mesh);
    ASSERT_EQ(finer.mesh.tetrahedra.rows(), 8 * mesh.tetrahedra.rows());
    for (Eigen::Index t = 0; t < finer.mesh.tetrahedra.rows(); ++t)
      EXPECT_NEAR(volume_of(finer.mesh, t), volume_of(mesh, t / 8) / 8, 1e-12 * volume_of(mesh, t / 8)) << t;
    EXPECT_EQ(outer_faces(finer.mesh.tetrahedra).rows(), 4 * outer_faces(mesh.tetrahedra).rows());
    EXPECT_EQ(first_overlap(finer.mesh.tetrahedra).first, -1);
    EXPECT_EQ(finer.mesh.vertices.topRows(mesh.vertices.rows()), mesh.vertices);
    mesh = finer.mesh;
  }
}

}  // namespace
}  // namespace flash::data
