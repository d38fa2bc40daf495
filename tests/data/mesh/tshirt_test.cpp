#include "data/mesh/tshirt.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>

#include "data/files/error.h"
#include "data/mesh/procedural_mesh.h"
#include "tests/data/mesh/openings.h"

namespace flash::data {
namespace {

TEST(Tshirt, IsASurfaceWithFourOpenings) {
  for (const double cell : {0.014, 0.03, 0.0425}) {
    const TriangleMesh mesh = tshirt({.cell = cell});
    SCOPED_TRACE(cell);
    expect_surface_with_openings(mesh, 4);
  }
}

TEST(Tshirt, OpensAtTheHemTheCuffsAndTheNeck) {
  const TshirtMesh settings;
  const std::vector<Eigen::Vector3d> middles = openings(tshirt(settings));
  const double cuff = 0.5 * settings.width + settings.sleeve;
  const auto has = [&](double x, double low, double high) {
    return std::any_of(middles.begin(), middles.end(), [&](const Eigen::Vector3d& middle) {
      return std::abs(middle.x() - x) < 1e-9 && low < middle.y() && middle.y() < high;
    });
  };
  EXPECT_TRUE(has(0, -1e-9, 1e-9));
  EXPECT_TRUE(has(0, settings.length - settings.neck_depth, settings.length));
  for (const double x : {-cuff, cuff}) EXPECT_TRUE(has(x, 0.3, settings.length));
}

TEST(Tshirt, LayersFaceOutwardsAndMeetAtSeams) {
  const TshirtMesh settings;
  const TriangleMesh mesh = tshirt(settings);
  EXPECT_NEAR(mesh.vertices.rows(), 4000, 250);
  double up = 0, down = 0;
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t) {
    const Eigen::Vector3d a = mesh.vertices.row(mesh.triangles(t, 0)),
                          b = mesh.vertices.row(mesh.triangles(t, 1)),
                          c = mesh.vertices.row(mesh.triangles(t, 2)), normal = (b - a).cross(c - a);
    const double height = (a + b + c).z() / 3;
    EXPECT_EQ(normal.z() > 0, height > 0.5 * settings.apart) << t;
    (normal.z() > 0 ? up : down) += std::abs(normal.z()) / 2;
  }
  // The neck of the front is lower by two thirds of its depth: two thirds of a parabola's box, to cells of
  // its width.
  const double neck = 2.0 / 3 * settings.neck * 2 / 3 * settings.neck_depth;
  EXPECT_NEAR(down - up, neck, 0.1 * neck);
}

TEST(Tshirt, IsMadeFromItsName) {
  EXPECT_EQ(parse_mesh_spec("tshirt:0.02").vertices, tshirt({.cell = 0.02}).vertices);
  for (const char* spec : {"tshirt:0.1", "tshirt:", "tshirt:0.02:1", "tshirt:1e-6"})
    EXPECT_THROW(parse_mesh_spec(spec), InputError) << spec;
  EXPECT_THROW(tshirt({.cell = 0.2}), InputError);
}

}  // namespace
}  // namespace flash::data
