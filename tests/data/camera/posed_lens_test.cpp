#include "data/camera/posed_lens.h"

#include <gtest/gtest.h>

#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "tests/data/temporary_folder.h"

namespace flash::data {
namespace {

CameraIntrinsics lens_of(double focal, double cx) {
  CameraIntrinsics lens;
  lens.width = 640;
  lens.height = 480;
  lens.fx = lens.fy = focal;
  lens.cx = cx;
  lens.cy = 240;
  return lens;
}

CameraPose pose_with(const CameraIntrinsics& solved, const CameraIntrinsics& stated) {
  return {.transform = {}, .lens = solved, .stated = stated, .warnings = {}};
}

// A centre moves all pixels alike; a longer lens moves those at the edge, half a pixel beyond the last
// centre.
TEST(PosedLens, LensesLieApartByWhatTheirPicturesDo) {
  EXPECT_NEAR(pixels_apart(lens_of(600, 320), lens_of(600, 323)), 3, 1e-9);
  EXPECT_NEAR(pixels_apart(lens_of(600, 320), lens_of(606, 320)), 0.01 * std::hypot(320.5, 240.5), 1e-9);
  EXPECT_TRUE(same_lens(lens_of(600, 320), lens_of(600, 320.009)));
  EXPECT_FALSE(same_lens(lens_of(600, 320), lens_of(600, 320.011)));
}

TEST(PosedLens, TheAnswersLensIsTakenWhereTheOtherIsTheOneThatItBeganWith) {
  const CameraPose pose = pose_with(lens_of(611, 331), lens_of(600, 320));
  const PosedLens began = posed_lens(pose, "x.json", LensOfFile{lens_of(600, 320), "camera_info.yaml"});
  EXPECT_EQ(began.lens.cx, 331);
  EXPECT_EQ(
      began.notice,
      "camera_info.yaml: found fx 600.00, fy 600.00, cx 320.00, cy 240.00, with which the calibration "
      "began; x.json holds with fx 611.00, fy 611.00, cx 331.00, cy 240.00, up to 17.11 px from it, which "
      "was taken");
  const PosedLens own = posed_lens(pose, "x.json", LensOfFile{lens_of(611, 331), "camera_info.yaml"});
  EXPECT_TRUE(own.lens.cx == 331 && own.notice.empty());
  EXPECT_EQ(posed_lens(pose, "x.json", std::nullopt).lens.cx, 331);
}

TEST(PosedLens, AnotherLensIsRefusedByBothFilesAndTheirNumbersUnlessChosen) {
  const CameraPose pose = pose_with(lens_of(611, 331), lens_of(600, 320));
  const LensOfFile other{lens_of(580, 300), "other.yaml"};
  EXPECT_EQ(
      input_error_of([&] { posed_lens(pose, "x.json", other); }),
      "other.yaml: found fx 580.00, fy 580.00, cx 300.00, cy 240.00, but x.json holds with fx 611.00, fy "
      "611.00, cx 331.00, cy 240.00, up to 48.22 px from it: expected one lens; --lens solved takes that "
      "of x.json, --lens stated the other");
  EXPECT_EQ(posed_lens(pose, "x.json", other, LensChoice::solved).lens.cx, 331);
  const PosedLens stated = posed_lens(pose, "x.json", other, LensChoice::stated);
  EXPECT_EQ(stated.lens.cx, 300);
  EXPECT_NE(stated.notice.find("it was taken, although x.json holds with fx 611.00"), std::string::npos);
}

TEST(PosedLens, PicturesOfAnotherSizeAreRefused) {
  CameraIntrinsics large = lens_of(611, 331);
  large.width = 1280;
  for (const LensChoice choice : {LensChoice::agreeing, LensChoice::solved})
    EXPECT_EQ(input_error_of([&] {
                posed_lens(pose_with(lens_of(611, 331), lens_of(611, 331)), "x.json",
                           LensOfFile{large, "a.yaml"}, choice);
              }),
              "a.yaml: found 1280 x 480 pixels, expected 640 x 480 pixels, as x.json was calibrated with");
}

TEST(PosedLens, PosesWithoutALensTakeThatBesideThePictures) {
  EXPECT_EQ(posed_lens({}, "x.tum", LensOfFile{lens_of(600, 320), "a.yaml"}).lens.cx, 320);
  EXPECT_EQ(input_error_of([] { posed_lens({}, "x.tum", std::nullopt); }),
            "x.tum: has no lens, expected one beside the pictures, as camera_info.yaml");
  EXPECT_EQ(input_error_of([] {
              posed_lens({}, "x.tum", LensOfFile{lens_of(600, 320), "a.yaml"}, LensChoice::solved);
            }),
            "--lens: found solved, but x.tum has no lens, expected stated or a file");
}

TEST(PosedLens, WordsAndFilesAreTold) {
  std::string own;
  EXPECT_EQ(parse_lens_choice("", own), LensChoice::agreeing);
  EXPECT_EQ(parse_lens_choice("solved", own), LensChoice::solved);
  EXPECT_EQ(parse_lens_choice("stated", own), LensChoice::stated);
  EXPECT_EQ(own, "");
  EXPECT_EQ(parse_lens_choice("lens.yaml", own), LensChoice::stated);
  EXPECT_EQ(own, "lens.yaml");
}

TEST(PosedLens, ExtrinsicsCarryTheirLensAndTheOneTheyBeganWith) {
  const TemporaryFolder folder;
  const CameraPose pose = load_camera_pose(folder.write("camera.json", R"({"schema": "flash-extrinsics/2",
        "transform": {"translation": [0, 0, 1], "rotation_xyzw": [0, 0, 0, 1]},
        "lens": {"size_px": [640, 480], "focal_px": [611, 612], "centre_px": [331, 239],
                 "distortion": [0.1, 0, 0, 0, 0],
                 "stated": {"focal_px": [600, 600], "centre_px": [320, 240], "distortion": []}}})"),
                                           false);
  ASSERT_TRUE(pose.lens && pose.stated);
  EXPECT_EQ(pose.lens->fy, 612);
  EXPECT_EQ(pose.lens->model, DistortionModel::plumb_bob);
  EXPECT_EQ(pose.stated->cx, 320);
  EXPECT_EQ(pose.stated->width, 640);
  EXPECT_EQ(pose.stated->model, DistortionModel::none);
}

TEST(PosedLens, RemarksOfExportsAreReadBack) {
  CameraIntrinsics lens = lens_of(611.0123456789, 331.5);
  lens.model = DistortionModel::plumb_bob;
  lens.distortion = {0.1, -0.2, 0, 0, 0.3};
  const std::optional<CameraIntrinsics> read =
      find_lens_remark("<!-- " + lens_remark(lens) + " -->\n<joint/>", "a");
  ASSERT_TRUE(read);
  EXPECT_EQ(read->fx, lens.fx);
  EXPECT_EQ(read->cx, lens.cx);
  EXPECT_EQ(read->distortion, lens.distortion);
  EXPECT_FALSE(find_lens_remark("a lens of glass", "a"));
}

}  // namespace
}  // namespace flash::data
