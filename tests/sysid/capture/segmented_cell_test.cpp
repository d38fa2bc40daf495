#include "sysid/capture/segmented_cell.h"

#include <gtest/gtest.h>

#include "tests/data/temporary_folder.h"

namespace flash::sysid {
namespace {

TEST(SegmentedCell, IsReadAsItWasWritten) {
  const data::TemporaryFolder folder;
  SegmentedCell cell;
  cell.table = {{0.5, 0.1, 0.07}, Eigen::Vector3d(0.03, 0, 1).normalized()};
  cell.times = {1764000000.25, 1764000000.5};
  cell.trajectory = folder.write("gripper.tum", "");
  cell.cameras = {{0.5, 0.1, 1.07}};
  const std::string path = folder / "segment.json";
  save_segmented_cell(cell, path);
  const SegmentedCell read = load_segmented_cell(path);
  ASSERT_TRUE(read.table);
  EXPECT_TRUE(read.table->point.isApprox(cell.table->point, 1e-15));
  EXPECT_TRUE(read.table->normal.isApprox(cell.table->normal, 1e-15));
  EXPECT_EQ(read.times, cell.times);
  EXPECT_TRUE(std::filesystem::equivalent(read.trajectory, cell.trajectory));
  EXPECT_EQ(read.cameras, cell.cameras);
  EXPECT_EQ(segmented_cell_of(folder / "frames"), std::filesystem::weakly_canonical(path).string());
  EXPECT_EQ(segmented_cell_of(folder / "some/frames"), "");

  for (const char* foreign : {R"({"annotations": []})", R"({"note": "flash-segment/1"})", "[", ""}) {
    folder.write("segment.json", foreign);
    EXPECT_EQ(segmented_cell_of(folder / "frames"), "") << foreign;
  }
  save_segmented_cell({}, path);
  EXPECT_FALSE(load_segmented_cell(path).table);
  EXPECT_EQ(load_segmented_cell(path).trajectory, "");
}

TEST(SegmentedCell, ATiltedTableHasAHeightUnderEachPoint) {
  const SegmentedCell::Table table{{1, 2, 0.5}, Eigen::Vector3d(-0.1, 0.2, 1).normalized()};
  for (const Eigen::Vector3d& point : {Eigen::Vector3d(1, 2, 9), Eigen::Vector3d(3, -1, 0)}) {
    const Eigen::Vector3d under(point.x(), point.y(), height_under(table, point));
    EXPECT_NEAR((under - table.point).dot(table.normal), 0, 1e-12);
  }
}

TEST(SegmentedCell, MistakesAreNamed) {
  const data::TemporaryFolder folder;
  const auto message_of = [&](const std::string& fields) {
    const std::string path = folder.write("segment.json", "{\"schema\": \"flash-segment/1\"" + fields + "}");
    return data::input_error_of([&] { load_segmented_cell(path); });
  };
  EXPECT_EQ(message_of(""), "");
  EXPECT_NE(message_of(R"(, "times": [0, 0])").find("segment.json: times: found"), std::string::npos);
  EXPECT_NE(message_of(R"(, "times": "rate:10")").find("segment.json: times: found"), std::string::npos);
  EXPECT_NE(message_of(R"(, "cameras": [[0, 1]])").find("cameras[0]"), std::string::npos);
  EXPECT_NE(message_of(R"(, "cameras": 3)").find("cameras"), std::string::npos);
  EXPECT_NE(message_of(R"(, "table": {"point": [0, 0, 0], "normal": [0, 0, -1]})").find("table.normal"),
            std::string::npos);
  EXPECT_NE(message_of(R"(, "tables": 1)").find("tables"), std::string::npos);
}

}  // namespace
}  // namespace flash::sysid
