#include "data/mesh/shorts.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <vector>

#include "data/files/error.h"
#include "data/mesh/procedural_mesh.h"
#include "tests/data/mesh/openings.h"

namespace flash::data {
namespace {

TEST(Shorts, AreASurfaceWithThreeOpenings) {
  for (const double cell : {0.014, 0.02, 0.05}) {
    SCOPED_TRACE(cell);
    expect_surface_with_openings(shorts({.cell = cell}), 3);
  }
}

TEST(Shorts, OpenAtTheWaistAndBothHems) {
  const ShortsMesh settings;
  std::vector<Eigen::Vector3d> middles = openings(shorts(settings));
  ASSERT_EQ(middles.size(), 3u);
  std::sort(middles.begin(), middles.end(), [](const auto& a, const auto& b) { return a.x() < b.x(); });
  EXPECT_NEAR(middles[1].x(), 0, 1e-9);
  EXPECT_GT(middles[1].y(), settings.length - settings.waist_dip);
  // Legs go outwards by their splay over their length.
  const double outwards = settings.splay * (settings.length - settings.rise);
  for (const int k : {0, 2}) {
    EXPECT_NEAR(middles[static_cast<std::size_t>(k)].y(), 0, 1e-9);
    EXPECT_NEAR(std::abs(middles[static_cast<std::size_t>(k)].x()),
                0.5 * settings.leg + settings.cell + outwards, 1e-3);
  }
}

TEST(Shorts, LayersFaceOutwardsAndLegsStandApart) {
  const ShortsMesh settings;
  const TriangleMesh mesh = shorts(settings);
  double up = 0;
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t) {
    const Eigen::Vector3d a = mesh.vertices.row(mesh.triangles(t, 0)),
                          b = mesh.vertices.row(mesh.triangles(t, 1)),
                          c = mesh.vertices.row(mesh.triangles(t, 2)), normal = (b - a).cross(c - a);
    const double height = (a + b + c).z() / 3;
    EXPECT_EQ(normal.z() > 0, height > 0.5 * settings.apart) << t;
    if (normal.z() > 0) up += normal.z() / 2;
    // Nothing is between the legs.
    const double low = std::min({a.y(), b.y(), c.y()});
    if (low < settings.length - settings.rise - 2 * settings.cell) {
      EXPECT_GT(a.x() * b.x(), 0) << t;
      EXPECT_GT(a.x() * c.x(), 0) << t;
    }
  }
  // Two legs and what is between them above the crotch, less the dip: two thirds of a parabola's box.
  const double width = 2 * settings.leg + 2 * settings.cell;
  const double area = width * settings.length - 2 * settings.cell * (settings.length - settings.rise) -
                      2.0 / 3 * settings.waist_dip * width;
  EXPECT_NEAR(up, area, 0.02 * area);
}

TEST(Shorts, AreMadeFromTheirName) {
  EXPECT_EQ(parse_mesh_spec("shorts:0.02").vertices, shorts({.cell = 0.02}).vertices);
  for (const char* spec : {"shorts:0.1", "shorts:", "shorts:0.02:1", "shorts:1e-6"})
    EXPECT_THROW(parse_mesh_spec(spec), InputError) << spec;
  EXPECT_THROW(shorts({.cell = 0.2}), InputError);
}

}  // namespace
}  // namespace flash::data
