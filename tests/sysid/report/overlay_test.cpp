#include "sysid/report/overlay.h"

#include <gtest/gtest.h>

#include "data/mesh/procedural_mesh.h"
#include "sysid/report/overlay_image.h"
#include "tests/data/temporary_folder.h"

namespace flash::sysid {
namespace {

TEST(Overlay, ComesBackFromItsFolder) {
  const data::TemporaryFolder folder;
  const data::TriangleMesh mesh = data::parse_mesh_spec("sheet:0.1x0.1:0.05:alternating");
  Overlay overlay{"lift", mesh.triangles, {}};
  overlay.frames = {{0.5, mesh.vertices, data::Points::Constant(4, 3, 0.25), 0.002},
                    {0.7, mesh.vertices, data::Points(0, 3), 0}};
  save_overlay(overlay, folder / "lift");
  EXPECT_EQ(load_overlay(folder / "lift").start_picture, "");
  overlay.start_picture = "<svg/>";
  save_overlay(overlay, folder / "lift");
  const Overlay loaded = load_overlay(folder / "lift");
  EXPECT_EQ(loaded.name, "lift");
  EXPECT_EQ(loaded.start_picture, "<svg/>");
  overlay.start_picture = "";
  save_overlay(overlay, folder / "lift");
  EXPECT_EQ(load_overlay(folder / "lift").start_picture, "");
  EXPECT_EQ(loaded.triangles, overlay.triangles);
  ASSERT_EQ(loaded.frames.size(), 2u);
  EXPECT_EQ(loaded.frames[0].t, 0.5);
  EXPECT_EQ(loaded.frames[0].score, 0.002);
  EXPECT_EQ(loaded.frames[0].vertices, mesh.vertices);
  EXPECT_EQ(loaded.frames[0].cloud.rows(), 4);
  EXPECT_EQ(loaded.frames[1].cloud.rows(), 0);
}

int count(const data::Picture& picture, int first_column, int columns, bool (*is)(const data::Colour&)) {
  int found = 0;
  for (int v = 0; v < picture.height; ++v)
    for (int u = first_column; u < first_column + columns; ++u) found += is(picture.at(u, v));
  return found;
}

bool is_red(const data::Colour& c) { return c[0] > 2 * c[1] && c[0] > 2 * c[2]; }
bool is_blue(const data::Colour& c) { return c[2] > 120 && c[0] < 100; }

// An upright square of 0.2 m facing the side view: a filled square there, a thin line from the front.
TEST(OverlayImage, DrawsSurfaceAndCloudToScale) {
  data::TriangleMesh square = data::parse_mesh_spec("sheet:0.2x0.2:0.1:alternating");
  square.vertices.col(2) = square.vertices.col(1).eval();
  square.vertices.col(1).setZero();
  data::Points cloud(1, 3);
  cloud << 0.1, -0.02, 0.1;  // between the eye and the square
  const Eigen::AlignedBox3d bounds(Eigen::Vector3d(0, -0.1, 0), Eigen::Vector3d(0.2, 0.1, 0.2));
  OverlayImageSettings settings;
  settings.panel_width = 200;
  settings.panel_height = 200;
  settings.elevation = 0;
  settings.point_radius = 4;
  const data::Picture picture = draw_overlay(square, cloud, bounds, settings);
  ASSERT_EQ(picture.width, 400);
  // The bounds fill five sixths of a panel at their near face, the square in the middle 1 % less: an area of
  // 165^2.
  EXPECT_NEAR(count(picture, 0, 200, is_red), 165 * 165, 0.03 * 165 * 165);
  EXPECT_NEAR(count(picture, 0, 200, is_blue), M_PI * 16, 15);  // a disc of radius 4, its border averaged
  EXPECT_LT(count(picture, 200, 200, is_red), 400);
}

// Along the fold of a sheet that lies on itself the normals of its two halves cancel.
TEST(OverlayImage, AFoldedSheetIsLitToo) {
  data::TriangleMesh folded = data::parse_mesh_spec("sheet:0.2x0.2:0.1:alternating");
  folded.vertices.col(2) = folded.vertices.col(1).eval();
  folded.vertices.col(1).setZero();
  folded.vertices.col(0) = (folded.vertices.col(0).array() - 0.1).abs().eval();
  const Eigen::AlignedBox3d bounds(Eigen::Vector3d(0, -0.1, 0), Eigen::Vector3d(0.1, 0.1, 0.2));
  OverlayImageSettings settings;
  settings.panel_width = settings.panel_height = 200;
  settings.elevation = 0;
  const data::Picture picture = draw_overlay(folded, data::Points(0, 3), bounds, settings);
  const auto is_black = [](const data::Colour& c) { return c[0] < 40 && c[1] < 40 && c[2] < 40; };
  EXPECT_NEAR(count(picture, 0, 200, is_red), 82 * 165, 0.05 * 82 * 165);
  EXPECT_EQ(count(picture, 0, 400, is_black), 0);
}

// Two frames, a square that faces the side view, then one that faces the front.
TEST(OverlayImage, ASequenceHasAColumnAFrameAndTheSideViewAbove) {
  data::TriangleMesh square = data::parse_mesh_spec("sheet:0.2x0.2:0.1:alternating");
  const data::Points flat = square.vertices;
  Overlay overlay{"lift", square.triangles, {}};
  for (const int across : {1, 0}) {
    OverlayFrame& frame = overlay.frames.emplace_back();
    frame.vertices = flat;
    frame.vertices.col(2) = flat.col(across);
    frame.vertices.col(across).setZero();
    frame.cloud = data::Points(0, 3);
  }
  overlay.frames.insert(overlay.frames.begin() + 1, overlay.frames[0]);  // which is not drawn
  overlay.frames[1].vertices *= 100;
  const Eigen::AlignedBox3d bounds = bounds_of(overlay, {0, 2});
  EXPECT_LT((bounds.max() - Eigen::Vector3d::Constant(0.2)).norm(), 1e-15);
  EXPECT_LT(bounds.min().norm(), 1e-15);
  const data::Picture picture = draw_sequence(overlay, {0, 2}, bounds);
  ASSERT_EQ(picture.width % 2, 0);
  const auto reds = [&](bool second, bool below) {
    int found = 0;
    for (int v = 0; v < picture.height / 2; ++v)
      for (int u = 0; u < picture.width / 2; ++u)
        found +=
            is_red(picture.at(u + (second ? picture.width / 2 : 0), v + (below ? picture.height / 2 : 0)));
    return found;
  };
  // From above the horizon by 0.2 rad an edge is seen as a line, a face as a face.
  EXPECT_GT(reds(false, false), 10 * reds(false, true));
  EXPECT_GT(reds(true, true), 10 * reds(true, false));
}

TEST(OverlayImage, PointsBehindTheSurfaceArePale) {
  data::TriangleMesh square = data::parse_mesh_spec("sheet:0.2x0.2:0.1:alternating");
  square.vertices.col(2) = square.vertices.col(1).eval();
  square.vertices.col(1).setZero();
  data::Points cloud(1, 3);
  cloud << 0.1, 0.05, 0.1;
  const Eigen::AlignedBox3d bounds(Eigen::Vector3d(0, -0.1, 0), Eigen::Vector3d(0.2, 0.1, 0.2));
  OverlayImageSettings settings;
  settings.elevation = 0;
  const data::Picture picture = draw_overlay(square, cloud, bounds, settings);
  EXPECT_EQ(count(picture, 0, settings.panel_width, is_blue), 0);
}

}  // namespace
}  // namespace flash::sysid
