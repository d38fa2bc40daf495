#include <apriltag.h>
#include <gtest/gtest.h>
#include <tagStandard41h12.h>
#include <tagStandard52h13.h>

#include <algorithm>
#include <string>

#include "calib/detect/finder.h"
#include "tests/calib/rendered_view.h"

namespace flash::calib {
namespace {

/// Families whose bits stand on both sides of their border. The library draws the tag, a module is 24 px
/// wide.
void expect_corners_of_the_border(const std::string& name, apriltag_family_t* family,
                                  void (*destroy)(apriltag_family_t*)) {
  constexpr int kId = 5, kModule = 24, kLeft = 210, kTop = 130;
  image_u8_t* tag = apriltag_to_image(family, kId);
  const int width = tag->width, border = family->width_at_border;

  GreyImage image{.width = 640, .height = 480, .pixels = std::vector<std::uint8_t>(640 * 480, 255)};
  for (int y = 0; y < kModule * width; ++y)
    for (int x = 0; x < kModule * width; ++x)
      image.pixels[static_cast<std::size_t>((kTop + y) * image.width + kLeft + x)] =
          tag->buf[y / kModule * tag->stride + x / kModule];
  image_u8_destroy(tag);
  destroy(family);

  const Rectifier rectifier(small_camera());
  const Finder finder = make_finder(parse_target("apriltag:" + name + ":5:0.05"), rectifier);
  const Found found = finder(image);
  ASSERT_FALSE(found.sightings.empty()) << found.reason;
  // Pixel centres are whole numbers: the first module begins at -0.5 of its first pixel.
  const double first = kModule * (width - border) / 2.0 - 0.5, last = first + kModule * border;
  const Eigen::Vector2d expected[] = {{first, first}, {last, first}, {last, last}, {first, last}};
  for (const Sighting& sighting : found.sightings) {
    ASSERT_EQ(sighting.points, (std::vector<int>{0, 1, 2, 3})) << sighting.refiner;
    for (std::size_t i = 0; i < 4; ++i)
      EXPECT_LT((sighting.pixels[i] - expected[i] - Eigen::Vector2d(kLeft, kTop)).norm(), 0.5)
          << sighting.refiner << " " << i;
  }
}

TEST(AprilTagFinder, CornersOfAStandardTagAreThoseOfItsBorder) {
  expect_corners_of_the_border("Standard41h12", tagStandard41h12_create(), tagStandard41h12_destroy);
}

// The largest family; with all codes that are two bits off a detector takes gigabytes and half a minute.
TEST(AprilTagFinder, CornersOfALargeStandardTagAreThoseOfItsBorder) {
  expect_corners_of_the_border("Standard52h13", tagStandard52h13_create(), tagStandard52h13_destroy);
}

}  // namespace
}  // namespace flash::calib
