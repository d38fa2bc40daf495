#include "data/camera/extrinsics.h"

#include <gtest/gtest.h>

#include "data/files/atomic_file.h"
#include "tests/data/temporary_folder.h"

namespace flash::data {
namespace {

class ExtrinsicsFile : public testing::Test {
 protected:
  /// The smallest file there is, and more fields.
  std::string write(const std::string& more) const {
    return folder_.write("camera.json", R"({"schema": "flash-extrinsics/1", "transform": {
      "translation": [0.5, 0.1, 1], "rotation_xyzw": [1, 0, 0, 0]})" +
                                            more + "}");
  }
  std::string refusal(const std::string& more) const {
    const std::string path = write(more);
    return input_error_of([&] { load_camera_pose(path, false); });
  }
  TemporaryFolder folder_;
};

TEST_F(ExtrinsicsFile, SchemaAndTransformAreEnough) {
  const CameraPose pose = load_camera_pose(write(""), false);
  EXPECT_TRUE(pose.usable);
  EXPECT_TRUE(pose.warnings.empty());
  EXPECT_EQ(pose.transform.T.translation(), Eigen::Vector3d(0.5, 0.1, 1));
}

TEST_F(ExtrinsicsFile, APlaceThatNoCameraHasIsRefused) {
  const std::string path = write("");
  std::string text = read_file(path);
  text.replace(text.find("[0.5"), 4, "[1e300");
  folder_.write("camera.json", text);
  EXPECT_EQ(input_error_of([&] { load_camera_pose(path, false); }),
            path + ": transform.translation: found [1e+300,0.1,1], expected metres, below 10,000");
}

TEST_F(ExtrinsicsFile, ACameraInMillimetresIsRefused) {
  const std::string text = R"({"schema": "flash-extrinsics/2", "transform": {"translation": [450, 30, 750],
                               "rotation_xyzw": [0, 0, 0, 1]}})";
  const TemporaryFolder folder;
  const std::string json = folder.write("camera.json", text),
                    tum = folder.write("camera.tum", "0 450 30 750 0 0 0 1\n");
  for (const std::string& path : {json, tum})
    EXPECT_EQ(input_error_of([&] { load_camera_pose(path, true); }),
              path +
                  ": translation: found a camera 875.2 m from the robot's frame, expected at most 20 m: are "
                  "these millimetres?");
}

TEST_F(ExtrinsicsFile, APartialAnswerIsRefusedWithWhatItLacks) {
  EXPECT_EQ(
      refusal(R"(, "one_axis": {"told": false, "camera_axis": [-0.001, 0, 1], "camera_m": 0.1})"),
      (folder_ / "camera.json") +
          ": one_axis.told: found false, expected true: where the camera is along (0.00, 0.00, 1.00) is not "
          "known, as the robot turns about that axis alone; measure it, and calibrate with --camera-height "
          "or "
          "--target-height");
  EXPECT_NO_THROW(load_camera_pose(
      write(R"(, "one_axis": {"told": true, "camera_axis": [0, 0, 1], "camera_m": 0.1})"), false));
  EXPECT_NO_THROW(load_camera_pose(write(R"(, "one_axis": null)"), false));
}

TEST_F(ExtrinsicsFile, AnAnswerThatCannotBeUsedIsRefusedUnlessAccepted) {
  const std::string bad = R"(, "exit_code": 3, "warnings": ["rotations turn about one axis only", "second"])";
  EXPECT_EQ(refusal(bad),
            (folder_ / "camera.json") +
                ": exit_code: found 3, expected 0: flash-calib handeye ended with an answer that "
                "cannot be used (rotations turn about one axis only); calibrate again, or take "
                "it as it is with --despite-doubts");
  const CameraPose pose = load_camera_pose(folder_ / "camera.json", true);
  EXPECT_FALSE(pose.usable);
  EXPECT_EQ(pose.warnings, (std::vector<std::string>{"rotations turn about one axis only", "second"}));
}

TEST_F(ExtrinsicsFile, WarningsOfAUsableAnswerAreCarried) {
  const CameraPose pose =
      load_camera_pose(write(R"(, "exit_code": 0, "warnings": ["two views left out"])"), false);
  EXPECT_TRUE(pose.usable);
  EXPECT_EQ(pose.warnings, std::vector<std::string>{"two views left out"});
}

TEST_F(ExtrinsicsFile, TheBaseInTheCameraIsRefusedByItsNames) {
  const auto said = [&](const std::string& parent, const std::string& child) {
    const std::string path = folder_.write(
        "camera.json", R"({"schema": "flash-extrinsics/2", "transform": {"parent": ")" + parent +
                           R"(", "child": ")" + child +
                           R"(", "translation": [0.5, 0.1, 1], "rotation_xyzw": [1, 0, 0, 0]}})");
    return input_error_of([&] { load_camera_pose(path, true); });
  };
  EXPECT_EQ(
      said("camera", "base"),
      (folder_ / "camera.json") +
          ": transform.child: found \"base\", expected the camera: the transform is that of the camera in "
          "base, not its inverse (parent base or gripper, child camera)");
  EXPECT_NE(said("camera_color_optical_frame", "base_link"), "");
  EXPECT_NE(said("CAM1", "panda_link0").find("transform.parent: found \"CAM1\", expected base or gripper"),
            std::string::npos);
  for (const char* parent : {"base", "base_link", "world", "gripper", "tool0", "camera_mount", ""})
    for (const char* child : {"camera", "camera_color_optical_frame", "Cam0", "hand_camera", "tool_rgb"})
      EXPECT_EQ(said(parent, child), "") << parent << ' ' << child;
  EXPECT_EQ(said("", ""), "");
  EXPECT_EQ(said("base", "realsense"), "");
}

TEST_F(ExtrinsicsFile, MistakesAreNamed) {
  EXPECT_NE(refusal(R"(, "exit_cod": 3)").find("exit_cod: unknown field (did you mean \"exit_code\"?)"),
            std::string::npos);
  EXPECT_NE(refusal(R"(, "setup": "eye-in-hand")").find("this camera moves with the gripper"),
            std::string::npos);
  EXPECT_NE(refusal(R"(, "warnings": "none")").find("warnings: found \"none\", expected a list of texts"),
            std::string::npos);
}

}  // namespace
}  // namespace flash::data
