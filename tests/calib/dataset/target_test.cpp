#include "calib/dataset/target.h"

#include <gtest/gtest.h>

#include "data/files/error.h"
#include "tests/data/temporary_folder.h"

namespace flash::calib {
namespace {

std::string message_of(const std::string& text) {
  return data::input_error_of([&] { parse_target(text); });
}

TEST(Target, EveryFormIsUnderstood) {
  const Target board = parse_target("chessboard:9x6:0.025");
  EXPECT_EQ(board.kind, TargetKind::chessboard);
  EXPECT_EQ(board.columns, 9);
  EXPECT_EQ(board.rows, 6);
  EXPECT_EQ(board.spacing, 0.025);
  const Target charuco = parse_target("charuco:5x7:0.036195:0.018256:DICT_6X6_250");
  EXPECT_EQ(charuco.kind, TargetKind::charuco);
  EXPECT_EQ(charuco.marker_size, 0.018256);
  EXPECT_EQ(parse_target("aruco:DICT_4X4_50:7:0.09").first_id, 7);
  EXPECT_EQ(parse_target("aruco_grid:5x7:0.04:0.01:DICT_4X4_50:12").first_id, 12);
  EXPECT_EQ(parse_target("apriltag:36h11:any:0.048").first_id, -1);
  EXPECT_DOUBLE_EQ(parse_target("aprilgrid:6x6:0.088:0.3").marker_gap, 0.0264);
  EXPECT_TRUE(parse_target("circles:10x10:0.0254:origin-dot").has_origin);
  EXPECT_FALSE(parse_target("circles:10x10:0.0254").has_origin);
}

TEST(Target, ErrorsNameThePartThatIsWrong) {
  EXPECT_EQ(message_of("chessbord:9x6:0.025"),
            "target \"chessbord:9x6:0.025\": kind: expected one of chessboard, charuco, aruco, aruco_grid, "
            "apriltag, aprilgrid, circles");
  EXPECT_EQ(message_of("chessboard:9x:0.025"),
            "target \"chessboard:9x:0.025\": size: expected COLUMNSxROWS of 3 to 1000, found \"9x\"");
  EXPECT_EQ(message_of("chessboard:9x6:25"),
            "target \"chessboard:9x6:25\": square: expected metres, found 25 (millimetres?)");
  EXPECT_EQ(
      message_of("aruco:DICT_4x4_50:0:0.09"),
      "target \"aruco:DICT_4x4_50:0:0.09\": dictionary: expected \"DICT_4X4_50\", found \"DICT_4x4_50\"");
  EXPECT_NE(message_of("charuco:5x7:0.02:0.03:DICT_4X4_50").find("smaller than the square"),
            std::string::npos);
  EXPECT_NE(message_of("apriltag:36h11:-2:0.05").find("id: expected a number from 0 or any"),
            std::string::npos);
  EXPECT_NE(message_of("").find("kind"), std::string::npos);
}

TEST(Target, IsReadFromKalibrsFileAndFromJson) {
  const data::TemporaryFolder folder;
  folder.write("grid.yaml",
               "target_type: 'aprilgrid'\ntagCols: 6\ntagRows: 5\ntagSize: 0.088\ntagSpacing: 0.3\n");
  const Target grid = load_target(folder / "grid.yaml");
  EXPECT_EQ(grid.kind, TargetKind::aprilgrid);
  EXPECT_EQ(grid.rows, 5);
  folder.write("target.json", R"({"setup": "eye-in-hand", "target": "chessboard:6x9:0.02"})");
  EXPECT_EQ(load_target(folder / "target.json").rows, 9);
  folder.write("board.yaml", "target_type: 'circlegrid'\n");
  EXPECT_THROW(load_target(folder / "board.yaml"), data::InputError);
}

TEST(Target, PointsStandWhereTheHeaderSays) {
  const Eigen::Matrix3Xd board = target_points(parse_target("chessboard:9x6:0.025"));
  ASSERT_EQ(board.cols(), 54);
  EXPECT_TRUE(board.col(10).isApprox(Eigen::Vector3d(0.025, 0.025, 0)));
  const Eigen::Matrix3Xd charuco = target_points(parse_target("charuco:5x7:0.04:0.02:DICT_4X4_50"));
  ASSERT_EQ(charuco.cols(), 24);
  EXPECT_TRUE(charuco.col(4).isApprox(Eigen::Vector3d(0.04, 0.08, 0)));
  const Eigen::Matrix3Xd marker = target_points(parse_target("aruco:DICT_4X4_50:0:0.1"));
  EXPECT_TRUE(marker.col(1).isApprox(Eigen::Vector3d(0.05, -0.05, 0)));
  // Kalibr's first tag is the lowest: its lower left corner is the origin.
  const Eigen::Matrix3Xd grid = target_points(parse_target("aprilgrid:2x2:0.1:0.5"));
  EXPECT_TRUE(grid.col(3).isZero());
  EXPECT_TRUE(grid.col(8 + 3).isApprox(Eigen::Vector3d(0, -0.15, 0)));
}

// Whatever a symmetry says, distances between points stay: it is a turn of the target onto itself.
TEST(Target, SymmetriesAreTurnsOntoItself) {
  const std::vector<std::pair<std::string, std::size_t>> cases = {
      {"chessboard:9x6:0.025", 1},        {"chessboard:8x6:0.025", 2},   {"chessboard:7x7:0.025", 2},
      {"chessboard:6x6:0.025", 4},        {"circles:7x5:0.03", 2},       {"circles:5x5:0.03", 4},
      {"circles:5x5:0.03:origin-dot", 1}, {"aruco:DICT_4X4_50:0:0.1", 1}};
  for (const auto& [text, count] : cases) {
    const Target target = parse_target(text);
    const Eigen::Matrix3Xd points = target_points(target);
    const std::vector<std::vector<int>> symmetries = target_symmetries(target);
    EXPECT_EQ(symmetries.size(), count) << text;
    for (const std::vector<int>& permutation : symmetries)
      for (int i = 0; i < points.cols(); ++i)
        for (int j = 0; j < i; ++j)
          EXPECT_NEAR((points.col(permutation[i]) - points.col(permutation[j])).norm(),
                      (points.col(i) - points.col(j)).norm(), 1e-12);
  }
}

}  // namespace
}  // namespace flash::calib
