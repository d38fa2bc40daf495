#include "sim/scene/solid.h"

#include <gtest/gtest.h>

#include <vector>

#include "data/error.h"
#include "data/procedural_mesh.h"
#include "tests/sim/sheet_scene.h"

namespace flash::sim {
namespace {

const Eigen::Vector3d size(0.3, 0.2, 0.1);

TEST(SolidMesh, VolumeAndSurfaceOfABoxGoToItsVertices) {
  const Sheet box = make_solid(data::tet_box(size, {6, 4, 2}));
  EXPECT_NEAR(box.vertex_volume.sum(), size.prod(), 1e-15);
  EXPECT_NEAR(box.vertex_area.sum(), 2 * (0.3 * 0.2 + 0.2 * 0.1 + 0.1 * 0.3), 1e-14);
  // A vertex within has no area.
  for (Eigen::Index i = 0; i < box.rest.vertices.rows(); ++i) {
    const Eigen::Array3d x = box.rest.vertices.row(i).transpose();
    const bool within = (x > 1e-9).all() && (x < size.array() - 1e-9).all();
    EXPECT_EQ(box.vertex_area[i] == 0, within);
  }
  // Outer faces look outward: their volume is that of the box (divergence theorem).
  double volume = 0;
  for (Eigen::Index f = 0; f < box.solid_surface.rows(); ++f) {
    Eigen::Matrix3d corners;
    for (int k = 0; k < 3; ++k) corners.col(k) = box.rest.vertices.row(box.solid_surface(f, k));
    volume += corners.determinant() / 6;
  }
  EXPECT_NEAR(volume, size.prod(), 1e-15);
}

TEST(SolidMesh, WhatIsBrokenIsNamed) {
  const auto message = [](const data::TetMesh& mesh) -> std::string {
    try {
      make_solid(mesh);
    } catch (const data::InputError& error) {
      return error.what();
    }
    return "";
  };
  data::TetMesh mesh = data::tet_box(size, {1, 1, 1});
  std::swap(mesh.tetrahedra(3, 0), mesh.tetrahedra(3, 1));
  EXPECT_NE(message(mesh).find("mesh: tetrahedron 3: is inverted"), std::string::npos);
  mesh = data::tet_box(size, {1, 1, 1});
  mesh.vertices.row(mesh.tetrahedra(2, 0)) = mesh.vertices.row(mesh.tetrahedra(2, 1));
  EXPECT_NE(message(mesh).find("is flat"), std::string::npos);
}

TEST(SolidMesh, PositionsThatTurnATetrahedronInsideOutAreFound) {
  const Sheet box = make_solid(data::tet_box(size, {2, 2, 2}));
  data::Points x = box.rest.vertices;
  EXPECT_EQ(first_inverted(box, x), -1);
  x.col(1) *= -1;
  EXPECT_EQ(first_inverted(box, x), 0);
}

TEST(SolidMesh, JoinsWithSheets) {
  const Sheet sheet = small_sheet(), box = make_solid(data::tet_box(size, {1, 2, 1}), "box");
  const std::vector<Sheet> both = {sheet, box};
  const Sheet whole = joined(both);
  const auto own = sheet.rest.vertices.rows();
  ASSERT_EQ(whole.bodies.size(), 2u);
  EXPECT_FALSE(whole.bodies[0].is_solid());
  EXPECT_TRUE(whole.bodies[1].is_solid());
  EXPECT_EQ(whole.tetrahedra.size(), box.tetrahedra.size());
  EXPECT_EQ(whole.tetrahedra[0].vertices, (box.tetrahedra[0].vertices.array() + int(own)).matrix());
  EXPECT_EQ(whole.vertex_volume.head(own).sum(), 0);
  EXPECT_EQ(Eigen::VectorXd(whole.vertex_volume.tail(box.vertex_volume.size())), box.vertex_volume);
  EXPECT_EQ(visible_triangles(whole).rows(), sheet.rest.triangles.rows() + box.solid_surface.rows());
}

}  // namespace
}  // namespace flash::sim
