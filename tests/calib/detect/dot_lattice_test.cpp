#include "calib/detect/dot_lattice.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/calib/rendered_view.h"

namespace flash::calib {
namespace {

using Dots = std::vector<Eigen::Vector2d>;

struct Scene {
  Dots grid;  ///< as it was printed
  Dots seen;  ///< of these some, with others, in no order
};

/// Seen at up to 60 deg, through a lens that bends; `others` lie anywhere in the picture, but not on the
/// grid.
Scene scene_of(const Target& target, std::size_t missing, std::size_t others, unsigned seed) {
  data::CameraIntrinsics camera = small_camera();
  camera.model = data::DistortionModel::plumb_bob;
  camera.distortion = {-0.25, 0.08, 0, 0, 0};
  std::mt19937 random(seed);
  const Eigen::Matrix3Xd points = target_points(target);
  const Eigen::Isometry3d pose = random_view(target, camera, 0.4, 0.6, 1.05, random);
  std::normal_distribution<double> noise(0, 0.1);
  Scene scene;
  for (const auto& point : points.colwise())
    scene.grid.push_back(*data::project(camera, pose * Eigen::Vector3d(point)) +
                         Eigen::Vector2d(noise(random), noise(random)));
  scene.seen = scene.grid;
  std::shuffle(scene.seen.begin(), scene.seen.end(), random);
  scene.seen.resize(scene.seen.size() - missing);
  Eigen::AlignedBox2d board;
  for (const Eigen::Vector2d& dot : scene.grid) board.extend(dot);
  std::uniform_real_distribution<double> x(0, camera.width), y(0, camera.height);
  for (std::size_t tries = 0;
       tries < 100 * others && scene.seen.size() + missing < scene.grid.size() + others; ++tries) {
    const Eigen::Vector2d other(x(random), y(random));
    if (board.exteriorDistance(other) > 5) scene.seen.push_back(other);
  }
  std::shuffle(scene.seen.begin(), scene.seen.end(), random);
  return scene;
}

/// Whether `found` are the places of the grid, in an order that is one of a grid read from another corner.
bool is_the_grid(const Dots& found, const Dots& grid, int columns, int rows, double tolerance) {
  for (int code = 0; code < 8; ++code) {
    const bool exchanged = code & 4;
    if (exchanged && columns != rows) continue;
    bool same = found.size() == grid.size();
    for (int r = 0; same && r < rows; ++r)
      for (int c = 0; same && c < columns; ++c) {
        int x = code & 1 ? columns - 1 - c : c, y = code & 2 ? rows - 1 - r : r;
        if (exchanged) std::swap(x, y);
        same = (found[static_cast<std::size_t>(r * columns + c)] -
                grid[static_cast<std::size_t>(y * columns + x)])
                   .norm() < tolerance;
      }
    if (same) return true;
  }
  return false;
}

TEST(DotLattice, IsFoundAmongOtherDotsFromAnySide) {
  for (const char* words : {"circles:7x5:0.03", "circles:8x8:0.025"}) {
    const Target target = parse_target(words);
    for (unsigned seed = 0; seed < 100; ++seed) {
      const Scene scene = scene_of(target, 0, 12, seed);
      const auto found = find_dot_lattice(scene.seen, target.columns, target.rows);
      ASSERT_TRUE(found) << words << " " << seed;
      EXPECT_TRUE(is_the_grid(*found, scene.grid, target.columns, target.rows, 1e-9)) << words << " " << seed;
    }
  }
}

// Dots that touch something dark are no blobs.
TEST(DotLattice, MayLackSomeDots) {
  const Target target = parse_target("circles:10x7:0.02");
  int found_in = 0;
  for (unsigned seed = 0; seed < 50; ++seed) {
    const Scene scene = scene_of(target, 3, 8, seed);
    const auto found = find_dot_lattice(scene.seen, target.columns, target.rows);
    if (!found) continue;
    ++found_in;
    // The lens bends what is put in by a plane's projection.
    EXPECT_TRUE(is_the_grid(*found, scene.grid, target.columns, target.rows, 6)) << seed;
  }
  EXPECT_GE(found_in, 48);
}

TEST(DotLattice, OfOtherCountsIsNone) {
  const Scene scene = scene_of(parse_target("circles:7x5:0.03"), 0, 0, 1);
  for (const auto& [columns, rows] : {std::pair{8, 5}, std::pair{7, 6}, std::pair{9, 4}, std::pair{6, 6}})
    EXPECT_FALSE(find_dot_lattice(scene.seen, columns, rows)) << columns << " x " << rows;
}

TEST(DotLattice, InAWrongOrderIsNone) {
  const Target target = parse_target("circles:7x5:0.03");
  Scene scene = scene_of(target, 0, 0, 2);
  EXPECT_TRUE(is_lattice(scene.grid, 7, 5));
  std::swap(scene.grid[8], scene.grid[9]);
  EXPECT_FALSE(is_lattice(scene.grid, 7, 5));
}

}  // namespace
}  // namespace flash::calib
