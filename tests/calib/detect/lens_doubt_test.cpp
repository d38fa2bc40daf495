#include "calib/detect/lens_doubt.h"

#include <gtest/gtest.h>

#include "tests/calib/arm_scene.h"

namespace flash::calib {
namespace {

/// A board of nine by six seen through the scene's lens, with poses fitted through `lens`.
std::string doubt_of(const data::CameraIntrinsics& lens, const HandEyeScene& scene) {
  const Target target = parse_target("chessboard:9x6:0.025");
  const Eigen::Matrix3Xd points = target_points(target);
  Dataset dataset;
  dataset.camera = lens;
  dataset.camera_path = "camera_info.yaml";
  std::vector<Detection> detections;
  std::mt19937 random(5);
  std::normal_distribution<double> normal(0, 0.1);  // [px]
  for (const Observation& seen : scene.observations) {
    Observation view = seen;
    view.points.clear();
    view.pixels.resize(2, points.cols());
    for (Eigen::Index k = 0; k < points.cols(); ++k) {
      view.points.push_back(static_cast<int>(k));
      view.pixels.col(k) = project(to_vector(scene.camera), seen.T_camera_target.front() * points.col(k)) +
                           Eigen::Vector2d(normal(random), normal(random));
    }
    const Eigen::Isometry3d pose = fitted_pose(lens, points, view.pixels, seen.T_camera_target.front());
    double squares = 0;
    for (Eigen::Index k = 0; k < points.cols(); ++k)
      squares += (project(to_vector(lens), pose * points.col(k)) - view.pixels.col(k)).squaredNorm();
    view.pose_rms = std::sqrt(squares / static_cast<double>(points.cols()));
    detections.push_back({seen.image, "", {{"image_model", view}}});
  }
  return lens_doubt(dataset, target, detections);
}

TEST(LensDoubt, ALensWithPixelsTwiceAsHighAsWideIsNamedAndTheRightOneIsNot) {
  const HandEyeScene scene = make_scene(protocol_settings(Setup::eye_in_hand), board_points(), 3);
  EXPECT_EQ(doubt_of(scene.camera, scene), "");
  data::CameraIntrinsics near = scene.camera;
  near.fx *= 1.01;
  EXPECT_EQ(doubt_of(near, scene), "");
  data::CameraIntrinsics wrong = scene.camera;
  wrong.fy *= 2;
  const std::string said = doubt_of(wrong, scene);
  EXPECT_TRUE(said.starts_with("camera_info.yaml: the lens fx ")) << said;
  EXPECT_NE(said.find("does not fit the pictures: the corners of the usual view lie "), std::string::npos)
      << said;
}

}  // namespace
}  // namespace flash::calib
