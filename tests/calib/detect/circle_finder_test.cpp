#include <gtest/gtest.h>

#include "calib/detect/finder.h"
#include "tests/calib/rendered_view.h"

namespace flash::calib {
namespace {

// Joining dots to a grid takes time with their cube: a thousand specks beside the grid would take minutes.
TEST(CircleFinder, GridAmongAThousandSpecksIsFoundAsWithoutThem) {
  const Target target = parse_target("circles:7x5:0.03");
  const data::CameraIntrinsics camera = small_camera();
  const Eigen::Isometry3d pose(Eigen::Translation3d(-0.09, -0.06, 0.55));
  std::mt19937 random(3);
  GreyImage image = Renderer(target, camera).draw(pose, random);
  const Rectifier rectifier(camera);
  const Finder finder = make_finder(target, rectifier);
  const Found alone = finder(image);
  ASSERT_FALSE(alone.sightings.empty()) << alone.reason;

  Eigen::AlignedBox2d board;
  for (const Eigen::Vector2d& pixel : alone.sightings.front().pixels) board.extend(pixel);
  board.min().array() -= 60;
  board.max().array() += 60;
  int specks = 0;
  std::uniform_int_distribution<int> jitter(0, 3);
  for (int top = 4; top + 12 < image.height; top += 11)
    for (int left = 4; left + 12 < image.width; left += 11) {
      const int x = left + jitter(random), y = top + jitter(random);
      if (board.contains(Eigen::Vector2d(x, y))) continue;
      ++specks;
      for (int dy = 0; dy < 4; ++dy)
        for (int dx = 0; dx < 4; ++dx)
          image.pixels[static_cast<std::size_t>((y + dy) * image.width + x + dx)] = 30;
    }
  ASSERT_GT(specks, 1000);
  const Found among = finder(image);
  ASSERT_FALSE(among.sightings.empty()) << among.reason;
  EXPECT_EQ(among.sightings.front().pixels, alone.sightings.front().pixels);
}

// Turned by 45 deg, and towards the picture's edge, libraries order some of these otherwise, or give up.
TEST(CircleFinder, GridsAnywhereInThePictureAreFoundInTheirOrder) {
  data::CameraIntrinsics camera = small_camera();
  const Rectifier rectifier(camera);
  for (const char* words : {"circles:7x5:0.03", "circles:10x10:0.02:origin-dot"}) {
    const Target target = parse_target(words);
    const Eigen::Matrix3Xd points = target_points(target);
    const std::vector<std::vector<int>> symmetries = target_symmetries(target);
    const Renderer renderer(target, camera);
    const Finder finder = make_finder(target, rectifier);
    std::mt19937 random(29);
    for (int view = 0; view < 8; ++view) {
      const Eigen::Isometry3d pose = random_view(target, camera, 0.4, 0.55, 0.9, random);
      const Found found = finder(renderer.draw(pose, random));
      ASSERT_FALSE(found.sightings.empty()) << words << " " << view << ": " << found.reason;
      const Sighting& sighting = found.sightings.front();
      double least = 1e300;
      for (const std::vector<int>& symmetry : symmetries) {
        double squares = 0;
        for (std::size_t i = 0; i < sighting.points.size(); ++i)
          squares += (sighting.pixels[i] -
                      *data::project(
                          camera, pose * points.col(symmetry[static_cast<std::size_t>(sighting.points[i])])))
                         .squaredNorm();
        least = std::min(least, std::sqrt(squares / (2 * static_cast<double>(sighting.points.size()))));
      }
      EXPECT_LT(least, 0.05) << words << " " << view;
    }
  }
}

}  // namespace
}  // namespace flash::calib
