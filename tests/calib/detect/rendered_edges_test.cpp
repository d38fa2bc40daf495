// Pictures keep a power of the light: where that puts edges and crossings.
#include <gtest/gtest.h>

#include <algorithm>

#include "calib/dataset/edge_offset.h"
#include "calib/detect/finder.h"
#include "tests/calib/rendered_view.h"

namespace flash::calib {
namespace {

struct Edges {
  double offset = 0;  ///< that explains the errors best [px]
  double rms = 0;     ///< of the errors that are left, an axis [px]
};

Edges edges_of(const char* words, double least_distance, double most_distance, double gamma) {
  const Target target = parse_target(words);
  const data::CameraIntrinsics camera = small_camera();
  const Renderer renderer(target, camera, {.gamma = gamma});
  const Rectifier rectifier(camera);
  const Finder finder = make_finder(target, rectifier);
  const Eigen::Matrix3Xd points = target_points(target);
  std::mt19937 random(17);
  double errors = 0, motions = 0, both = 0, count = 0;
  for (int view = 0; view < 4; ++view) {
    const Eigen::Isometry3d pose = random_view(target, camera, least_distance, most_distance, 0.7, random);
    const Found found = finder(renderer.draw(pose, random));
    const auto fitted = std::find_if(found.sightings.begin(), found.sightings.end(),
                                     [](const Sighting& one) { return one.refiner == kImageModel; });
    EXPECT_NE(fitted, found.sightings.end()) << words << ": " << found.reason;
    if (fitted == found.sightings.end()) continue;
    const Sighting& sighting = *fitted;
    Eigen::Matrix2Xd pixels(2, sighting.points.size()), error = pixels;
    for (Eigen::Index i = 0; i < pixels.cols(); ++i) {
      const auto k = static_cast<std::size_t>(i);
      pixels.col(i) = sighting.pixels[k];
      error.col(i) = pixels.col(i) - *data::project(camera, pose * points.col(sighting.points[k]));
    }
    Eigen::Matrix2Xd motion = outward_motion(target.kind, pixels);
    if (motion.cols() == 0) motion.setZero(2, pixels.cols());
    errors += error.squaredNorm();
    motions += motion.squaredNorm();
    both += error.cwiseProduct(motion).sum();
    count += 2 * static_cast<double>(pixels.cols());
  }
  Edges edges;
  if (motions > 0) edges.offset = both / motions;
  edges.rms = std::sqrt((errors - both * edges.offset) / count);
  return edges;
}

// Light of 35 and 215 of 255 and a blur of 0.7 px, pixels of 1 px: halfway between both after the power lies
// at 0.38 of the step, 0.3 of 0.76 px inwards. The fit of a whole profile is not quite its middle.
TEST(RenderedEdges, StandInwardsByTheSameAtAnyDistanceUnderGamma) {
  for (const char* words : {"aruco:DICT_4X4_50:0:0.09", "apriltag:36h11:3:0.09"}) {
    const Edges near = edges_of(words, 0.5, 0.6, 2.2), far = edges_of(words, 1.0, 1.2, 2.2);
    EXPECT_NEAR(near.offset, -0.23, 0.08) << words;
    EXPECT_NEAR(near.offset, far.offset, 0.03) << words;
    EXPECT_LT(near.rms, 0.04) << words;
    EXPECT_LT(far.rms, 0.04) << words;
    EXPECT_NEAR(edges_of(words, 0.5, 0.6, 1).offset, 0, 0.01) << words;
  }
}

// Dark meets dark there, and bright meets bright.
TEST(RenderedEdges, OfCrossingsStayUnderGamma) {
  for (const char* words : {"chessboard:9x6:0.025", "charuco:5x7:0.036:0.018:DICT_6X6_250"})
    EXPECT_LT(edges_of(words, 0.45, 0.7, 2.2).rms, 0.03) << words;
}

}  // namespace
}  // namespace flash::calib
