#include "sim/scene/solid.h"

#include <gtest/gtest.h>

#include <vector>

#include "data/files/error.h"
#include "data/mesh/procedural_mesh.h"
#include "tests/sim/sheet_scene.h"

namespace flash::sim {
namespace {

const Eigen::Vector3d size(0.3, 0.2, 0.1);

/// Volume within the outer faces, which look outward (divergence theorem).
double enclosed_volume(const Sheet& solid) {
  double volume = 0;
  for (Eigen::Index f = 0; f < solid.solid_surface.rows(); ++f) {
    Eigen::Matrix3d corners;
    for (int k = 0; k < 3; ++k) corners.col(k) = solid.rest.vertices.row(solid.solid_surface(f, k));
    volume += corners.determinant() / 6;
  }
  return volume;
}

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
  EXPECT_NEAR(enclosed_volume(box), size.prod(), 1e-15);
}

TEST(SolidMesh, QuadraticElementsHaveVerticesInTheMiddleOfTheirEdges) {
  const data::TetMesh mesh = data::tet_box(size, {3, 2, 1});
  const Sheet box = make_solid(mesh, {}, data::ElementOrder::quadratic);
  // Euler: edges of a ball of tetrahedra, from its vertices, faces and tetrahedra.
  const Eigen::Index vertices = mesh.vertices.rows(), tetrahedra = mesh.tetrahedra.rows(),
                     outer = box.solid_surface.rows() / 4, faces = (4 * tetrahedra + outer) / 2;
  EXPECT_EQ(static_cast<Eigen::Index>(box.midsides.size()), vertices + faces - tetrahedra - 1);
  EXPECT_EQ(mesh_vertices(box), vertices);
  EXPECT_TRUE(is_quadratic(box, box.bodies[0]));
  for (const auto& [vertex, ends] : box.midsides)
    EXPECT_LT(
        (box.rest.vertices.row(vertex) - 0.5 * (mesh.vertices.row(ends[0]) + mesh.vertices.row(ends[1])))
            .norm(),
        1e-16);
  EXPECT_NEAR(box.vertex_volume.sum(), size.prod(), 1e-15);
  EXPECT_GT(box.vertex_volume.minCoeff(), 0);
  EXPECT_LT((box.rest.vertices.transpose() * box.vertex_volume - 0.5 * size.prod() * size).norm(), 1e-15);
  EXPECT_NEAR(box.vertex_area.sum(), 2 * (0.3 * 0.2 + 0.2 * 0.1 + 0.1 * 0.3), 1e-14);
  EXPECT_NEAR(enclosed_volume(box), size.prod(), 1e-15);
}

TEST(SolidMesh, WhatHoldsBothEndsOfAnEdgeHoldsItsMiddle) {
  const Sheet box = make_solid(data::tet_box(size, {2, 2, 2}), {}, data::ElementOrder::quadratic);
  std::vector<int> corners, face;
  for (int i = 0; i < static_cast<int>(box.rest.vertices.rows()); ++i) {
    if (box.rest.vertices(i, 0) > 1e-12) continue;
    face.push_back(i);
    if (i < mesh_vertices(box)) corners.push_back(i);
  }
  EXPECT_EQ(with_midsides(box, corners), face);
  EXPECT_EQ(with_midsides(box, std::vector<int>{corners[0]}), std::vector<int>{corners[0]});
  const data::Points moved = 2 * box.rest.vertices;
  EXPECT_EQ(with_midsides(box, moved.topRows(mesh_vertices(box))), moved);
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

  const Sheet quadratic = make_solid(data::tet_box(size, {1, 2, 1}), "box", data::ElementOrder::quadratic);
  const std::vector<Sheet> mixed = {sheet, quadratic};
  const Sheet joint = joined(mixed);
  EXPECT_TRUE(is_quadratic(joint, joint.bodies[1]));
  EXPECT_FALSE(is_quadratic(joint, joint.bodies[0]));
  ASSERT_EQ(joint.midsides.size(), quadratic.midsides.size());
  EXPECT_EQ(joint.midsides[0].vertex, quadratic.midsides[0].vertex + int(own));
  EXPECT_EQ(joint.tetrahedra[0].midsides[5], quadratic.tetrahedra[0].midsides[5] + int(own));
}

}  // namespace
}  // namespace flash::sim
