#include "sim/scene/slopes.h"

#include <gtest/gtest.h>

#include <cmath>

#include "data/mesh/procedural_mesh.h"
#include "sim/plan/hinge_bending.h"
#include "sim/plan/isometric_bending.h"

namespace flash::sim {
namespace {

/// Three columns of cells of 0.1 m, of which the first two columns of vertices are held.
struct Strip {
  Sheet sheet = make_sheet(data::rectangle({.width = 0.3, .height = 0.1, .cells_x = 3, .cells_y = 1}));
  std::vector<int> held;

  Strip() {
    for (int i = 0; i < int(sheet.rest.vertices.rows()); ++i)
      if (sheet.rest.vertices(i, 0) < 0.11) held.push_back(i);
  }
};

TEST(Slopes, TrianglesOfWhichAllVerticesAreHeldAreStiff) {
  Strip strip;
  EXPECT_TRUE(slope_gives_way(strip.sheet, strip.held));
  EXPECT_EQ(keep_slopes(strip.held, strip.sheet), 2);
  for (const RestTriangle& triangle : strip.sheet.triangles) {
    double farthest = 0;
    for (const int vertex : triangle.vertices)
      farthest = std::max(farthest, strip.sheet.rest.vertices(vertex, 0));
    EXPECT_EQ(triangle.stiff, farthest < 0.11);
  }
  EXPECT_FALSE(slope_gives_way(strip.sheet, strip.held));
}

TEST(Slopes, ARowOfVerticesHasNone) {
  Strip strip;
  std::vector<int> row;
  for (const int vertex : strip.held)
    if (strip.sheet.rest.vertices(vertex, 0) < 0.01) row.push_back(vertex);
  EXPECT_FALSE(slope_gives_way(strip.sheet, row));
  EXPECT_EQ(keep_slopes(row, strip.sheet), 0);
}

TEST(Slopes, AWholeSheetThatIsHeldGivesNoWay) {
  Strip strip;
  std::vector<int> all;
  for (int i = 0; i < int(strip.sheet.rest.vertices.rows()); ++i) all.push_back(i);
  EXPECT_FALSE(slope_gives_way(strip.sheet, all));
}

TEST(Slopes, ABendWithinAPatchIsFound) {
  Strip strip;
  std::vector<int> all;
  for (int i = 0; i < int(strip.sheet.rest.vertices.rows()); ++i) all.push_back(i);
  keep_slopes(all, strip.sheet);
  data::Points places = strip.sheet.rest.vertices;
  EXPECT_EQ(bend_between_stiff(strip.sheet, places), 0);
  for (int i = 0; i < int(places.rows()); ++i)
    if (places(i, 0) > 0.11) places(i, 2) = 0.1 * (places(i, 0) - 0.1);
  EXPECT_NEAR(bend_between_stiff(strip.sheet, places), std::atan(0.1), 1e-12);
}

// A cell that leaves a clamp with curvature k takes k^2 / 2 per half of its area: half of what two cells over
// an edge take is that of the free one alone.
TEST(Slopes, BesideAStiffTriangleAllBendingIsThatOfTheOther) {
  Strip strip;
  const std::vector<Hinge> before = sheet_hinges(strip.sheet);
  keep_slopes(strip.held, strip.sheet);
  const std::vector<Hinge> after = sheet_hinges(strip.sheet);
  ASSERT_EQ(before.size(), after.size());
  int doubled = 0;
  for (std::size_t e = 0; e < before.size(); ++e) {
    const auto x = [&](int k) { return strip.sheet.rest.vertices(before[e].vertices[std::size_t(k)], 0); };
    const bool at_border = std::abs(x(0) - 0.1) < 1e-9 && std::abs(x(1) - 0.1) < 1e-9;
    EXPECT_NEAR(after[e].weight, (at_border ? 2 : 1) * before[e].weight, 1e-12 * before[e].weight);
    // A curvature bends a triangle by as much however much its neighbour does.
    EXPECT_NEAR(yield_angle(after[e], 3), (at_border ? 0.5 : 1) * yield_angle(before[e], 3), 1e-12);
    doubled += at_border;
  }
  EXPECT_EQ(doubled, 1);

  Strip free;
  const Eigen::VectorXd z =
      (free.sheet.rest.vertices.col(0).array() - 0.1).max(0).matrix();  // bent at the border alone
  const double soft = z.dot(isometric_bending_stiffness(free.sheet) * z),
               firm = z.dot(isometric_bending_stiffness(strip.sheet) * z);
  EXPECT_NEAR(firm, 2 * soft, 1e-12 * soft);
}

}  // namespace
}  // namespace flash::sim
