// Targets that are stated otherwise than the pictures show them.
#include <gtest/gtest.h>

#include "calib/detect/detect.h"
#include "data/files/error.h"
#include "tests/calib/rendered_set.h"
#include "tests/data/temporary_folder.h"

namespace flash::calib {
namespace {

struct Case {
  const char *shown, *stated, *offered;
};
class ShownTargets : public testing::TestWithParam<Case> {};
INSTANTIATE_TEST_SUITE_P(
    Detect, ShownTargets,
    testing::Values(
        Case{"charuco:7x5:0.03:0.022:DICT_5X5_100", "charuco:5x7:0.03:0.022:DICT_5X5_100",
             "--target charuco:7x5:0.03:0.022:DICT_5X5_100"},
        Case{"charuco:7x5:0.03:0.022:DICT_5X5_100", "charuco:5x7:0.03:0.022:DICT_4X4_50",
             "--target charuco:7x5:0.03:0.022:DICT_5X5_50"},
        Case{"aruco_grid:5x4:0.03:0.01:DICT_4X4_50", "aruco_grid:4x5:0.03:0.01:DICT_4X4_50",
             "--target aruco_grid:5x4:0.03:0.01:DICT_4X4_50"},
        Case{"aruco_grid:4x3:0.04:0.01:DICT_5X5_100:6", "aruco_grid:6x2:0.04:0.01:DICT_5X5_100",
             "--target aruco_grid:4x3:0.04:0.01:DICT_5X5_100:6"},
        Case{"aruco:DICT_4X4_50:7:0.09", "aruco:DICT_4X4_50:0:0.09", "--target aruco:DICT_4X4_50:7:0.09"},
        Case{"aruco:DICT_6X6_250:3:0.09", "aruco:DICT_4X4_50:3:0.09", "--target aruco:DICT_6X6_50:3:0.09"},
        Case{"apriltag:36h11:4:0.09", "apriltag:36h11:0:0.09", "--target apriltag:36h11:4:0.09"},
        Case{"apriltag:36h11:0:0.09", "apriltag:25h9:0:0.09", "--target apriltag:36h11:0:0.09"}));

TEST_P(ShownTargets, AreOfferedAsTheyAre) {
  const data::TemporaryFolder folder;
  RenderedSetSettings settings;
  settings.target = GetParam().shown;
  settings.views = 4;
  settings.width = 640;
  settings.height = 480;
  write_rendered_set(settings, folder / "set");
  const Dataset dataset = load_dataset(folder / "set");
  EXPECT_NO_THROW(detect(dataset, parse_target(GetParam().shown)));
  const std::string said = data::input_error_of([&] { detect(dataset, parse_target(GetParam().stated)); });
  EXPECT_NE(said.find(GetParam().offered), std::string::npos) << said;
}

TEST(Targets, AreSaidInTheWordsThatStateThem) {
  for (const char* words :
       {"chessboard:9x6:0.025", "charuco:5x7:0.036:0.018:DICT_6X6_250", "aruco:DICT_4X4_50:any:0.09",
        "aruco_grid:5x7:0.04:0.01:DICT_4X4_50:3", "apriltag:36h11:0:0.048", "aprilgrid:6x6:0.088:0.3:36h11",
        "circles:10x10:0.0254:origin-dot"})
    EXPECT_EQ(to_words(parse_target(words)), words);
}

}  // namespace
}  // namespace flash::calib
