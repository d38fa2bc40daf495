#include <gtest/gtest.h>

#include "calib/detect/finder.h"
#include "tests/calib/rendered_view.h"

namespace flash::calib {
namespace {

// Corners of squares stand 4 px or less from those of the markers, seen aslant. What pulls corners to the
// strongest edges nearby took the one for the other.
TEST(CharucoFinder, SmallBoardsAreFoundWhole) {
  const Target target = parse_target("charuco:7x5:0.03:0.022:DICT_5X5_100");
  data::CameraIntrinsics camera = small_camera();
  camera.fx = camera.fy = 520;
  camera.model = data::DistortionModel::plumb_bob;
  camera.distortion = {-0.2, 0.05, 0.001, 0, 0};
  const Eigen::Matrix3Xd points = target_points(target);
  const Renderer renderer(target, camera);
  const Rectifier rectifier(camera);
  const Finder finder = make_finder(target, rectifier);
  std::mt19937 random(23);
  for (int view = 0; view < 8; ++view) {
    const Eigen::Isometry3d pose = random_view(target, camera, 0.45, 0.6, 0.5, random);
    const Found found = finder(renderer.draw(pose, random));
    ASSERT_FALSE(found.sightings.empty()) << view << ": " << found.reason;
    const Sighting& sighting = found.sightings.front();
    EXPECT_EQ(sighting.points.size(), 24u) << view;
    double squares = 0;
    for (std::size_t i = 0; i < sighting.points.size(); ++i)
      squares +=
          (sighting.pixels[i] - *data::project(camera, pose * points.col(sighting.points[i]))).squaredNorm();
    // Discs of a few pixels, under noise of 2 grey levels of 180.
    EXPECT_LT(std::sqrt(squares / (2 * static_cast<double>(sighting.points.size()))), 0.05) << view;
  }
}

}  // namespace
}  // namespace flash::calib
