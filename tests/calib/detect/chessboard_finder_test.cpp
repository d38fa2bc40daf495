#include <gtest/gtest.h>

#include <cmath>

#include "calib/detect/finder.h"
#include "tests/calib/rendered_view.h"

namespace flash::calib {
namespace {

// A spot of light on one crossing, before a lens that bends the board so that the classic search tries all it
// can.
TEST(ChessboardFinder, CrossingUnderASpotIsLeftOutAndTheOthersAreExact) {
  data::CameraIntrinsics camera = small_camera();
  camera.fx = camera.fy = 300;
  camera.cx = 320;
  camera.cy = 240;
  camera.model = data::DistortionModel::plumb_bob;
  camera.distortion = {-0.28, 0.07, 0, 0, -0.007};
  const Target target = parse_target("chessboard:9x6:0.025");
  const Eigen::Matrix3Xd points = target_points(target);
  const Renderer renderer(target, camera);
  const Rectifier rectifier(camera);
  const Finder finder = chessboard_finder(target, rectifier);
  constexpr int kCovered = 13;
  std::mt19937 random(7);
  for (int view = 0; view < 8; ++view) {
    const Eigen::Isometry3d pose = random_view(target, camera, 0.12, 0.35, 0.9, random);
    GreyImage image = renderer.draw(pose, random);
    const auto place = [&](int point) -> Eigen::Vector2d {
      return *data::project(camera, pose * points.col(point));
    };
    const Eigen::Vector2d spot = place(kCovered);
    for (int y = 0; y < image.height; ++y)
      for (int x = 0; x < image.width; ++x)
        if (std::hypot(x - spot.x(), y - spot.y()) < 5)
          image.pixels[static_cast<std::size_t>(y * image.width + x)] = 250;
    const Found found = finder(image);
    ASSERT_FALSE(found.sightings.empty()) << view << ": " << found.reason;
    const Sighting& fitted = found.sightings.back();
    ASSERT_STREQ(fitted.refiner.c_str(), kImageModel);
    EXPECT_GE(fitted.points.size(), 53U) << view;
    double squares = 0;
    for (std::size_t i = 0; i < fitted.points.size(); ++i)
      if (fitted.points[i] != kCovered) squares += (fitted.pixels[i] - place(fitted.points[i])).squaredNorm();
    // Noise of 2 grey levels leaves 0.01 px; a board numbered otherwise would be off by squares.
    EXPECT_LT(std::sqrt(squares / 53), 0.05) << view;
  }
}

}  // namespace
}  // namespace flash::calib
