#include "calib/report/extrinsics_export.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <opencv2/core.hpp>

#include "tests/calib/hand_eye_scene.h"
#include "tests/data/temporary_folder.h"

namespace flash::calib {
namespace {

TEST(ExtrinsicsExport, RosUrdfAndEasyHandeyeSayTheSameTransform) {
  for (const Eigen::Vector3d& rotation : {Eigen::Vector3d(0.3, -0.8, 2), Eigen::Vector3d(0, M_PI / 2, 0)}) {
    const data::NamedTransform transform{"tool0", "camera", make_pose({0.1, -0.2, 0.3}, rotation)};
    double x, y, z, r, p, w;
    const std::string urdf = urdf_joint(transform);
    ASSERT_EQ(std::sscanf(urdf.substr(urdf.find("xyz=")).c_str(), "xyz=\"%lf %lf %lf\" rpy=\"%lf %lf %lf\"",
                          &x, &y, &z, &r, &p, &w),
              6);
    const Eigen::Matrix3d from_rpy =
        (Eigen::AngleAxisd(w, Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(p, Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(r, Eigen::Vector3d::UnitX()))
            .toRotationMatrix();
    EXPECT_LT((from_rpy - transform.T.linear()).norm(), 1e-7);  // nine digits
    EXPECT_LT((Eigen::Vector3d(x, y, z) - transform.T.translation()).norm(), 1e-8);

    const std::string ros = ros_static_transform(transform);
    double qx, qy, qz, qw;
    ASSERT_EQ(std::sscanf(ros.substr(ros.find("--qx")).c_str(), "--qx %lf --qy %lf --qz %lf --qw %lf", &qx,
                          &qy, &qz, &qw),
              4);
    EXPECT_LT((Eigen::Quaterniond(qw, qx, qy, qz).toRotationMatrix() - transform.T.linear()).norm(), 1e-7);
    EXPECT_NE(ros.find("--frame-id tool0 --child-frame-id camera"), std::string::npos);
    const std::string calib = easy_handeye2(transform, Setup::eye_in_hand);
    EXPECT_NE(calib.find("calibration_type: eye_in_hand"), std::string::npos);
    EXPECT_NE(calib.find("robot_effector_frame: tool0"), std::string::npos);
  }
}

TEST(ExtrinsicsExport, EachCarriesTheLensThatItsTransformHoldsWith) {
  const data::NamedTransform transform{"base", "camera", make_pose({0.1, -0.2, 0.3}, {0.3, -0.8, 2})};
  data::CameraIntrinsics lens = make_scene(protocol_settings(Setup::eye_to_hand), board_points(), 1).camera;
  lens.cx += 1.0 / 3;
  for (const std::string& text : {ros_static_transform(transform, lens), urdf_joint(transform, lens),
                                  easy_handeye2(transform, Setup::eye_to_hand, lens)}) {
    const auto read = data::find_lens_remark(text, "export");
    ASSERT_TRUE(read) << text;
    EXPECT_EQ(read->cx, lens.cx);
    EXPECT_EQ(read->width, lens.width);
  }
  const data::TemporaryFolder folder;
  const data::CameraPose pose = data::load_camera_pose(
      folder.write("a.calib", easy_handeye2(transform, Setup::eye_to_hand, lens)), false);
  EXPECT_LT((pose.transform.T.matrix() - transform.T.matrix()).norm(), 1e-7);  // nine digits
  ASSERT_TRUE(pose.lens);
  EXPECT_EQ(pose.lens->cx, lens.cx);
}

TEST(ExtrinsicsExport, OpenCvReadsItsFile) {
  const data::NamedTransform transform{"base", "camera", make_pose({0.1, -0.2, 0.3}, {0.3, -0.8, 2})};
  data::CameraIntrinsics lens = make_scene(protocol_settings(Setup::eye_to_hand), board_points(), 1).camera;
  lens.cx += 1.0 / 3;
  const data::TemporaryFolder folder;
  const std::string path = folder.write("camera.yaml", opencv_yaml(transform, lens));
  cv::FileStorage file(path, cv::FileStorage::READ);
  cv::Mat K, distortion, T;
  file["camera_matrix"] >> K;
  file["distortion_coefficients"] >> distortion;
  file["T_parent_camera"] >> T;
  ASSERT_EQ(T.rows * T.cols, 16);
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) EXPECT_EQ(T.at<double>(i, j), transform.T.matrix()(i, j));
  EXPECT_EQ(K.at<double>(0, 2), lens.cx);
  EXPECT_EQ(static_cast<int>(file["image_width"]), lens.width);
  const data::CameraIntrinsics read = data::load_camera_intrinsics(path);  // and so does flash
  EXPECT_EQ(read.fx, lens.fx);
  EXPECT_EQ(read.height, lens.height);
  ASSERT_GE(distortion.cols, static_cast<int>(lens.distortion.size()));
  for (std::size_t k = 0; k < lens.distortion.size(); ++k)
    EXPECT_EQ(distortion.at<double>(0, static_cast<int>(k)), lens.distortion[k]);
}

}  // namespace
}  // namespace flash::calib
