#include "sysid/capture/segment/cell_check.h"

#include <gtest/gtest.h>

namespace flash::sysid {
namespace {

/// A level grid of points 2 cm apart, 0.4 m wide.
data::Points patch_at(const Eigen::Vector3d& middle) {
  data::Points points(21 * 21, 3);
  for (int i = 0; i < 21; ++i)
    for (int j = 0; j < 21; ++j)
      points.row(21 * i + j) = middle.transpose() + Eigen::RowVector3d(0.02 * (i - 10), 0.02 * (j - 10), 0);
  return points;
}

/// The tool rises by 10 cm a frame, cloth below it; `off`: from where the cameras see the cloth to it.
std::vector<CellFrame> lift(const Eigen::Vector3d& off) {
  std::vector<CellFrame> frames;
  for (int k = 0; k < 6; ++k) {
    const Eigen::Vector3d cloth(0.5, 0.1, 0.07 + 0.1 * k);
    frames.push_back({patch_at(cloth), cloth + Eigen::Vector3d(0, 0, 0.02) + off});
  }
  return frames;
}

const TablePlane table{{0.5, 0.1, 0.07}, Eigen::Vector3d::UnitZ()};

TEST(CellCheck, WhatIsOfOneCellHasNoFault) {
  EXPECT_EQ(cell_fault(lift(Eigen::Vector3d::Zero()), table, {{0.5, -1, 1}}, {}), "");
  EXPECT_EQ(cell_fault(lift({0.05, -0.05, 0.03}), table, {}, {}), "");  // a poor registration
  EXPECT_EQ(cell_fault(lift({0, 0, -0.05}), table, {}, {}), "");
  EXPECT_EQ(cell_fault(lift({3, 0, 0}), std::nullopt, {}, {}).substr(0, 18), "the gripper is 2.8");
  std::vector<CellFrame> without = lift({3, 0, 0});
  for (CellFrame& frame : without) frame.tool.reset();
  EXPECT_EQ(cell_fault(without, table, {}, {}), "");
}

TEST(CellCheck, FaultsAreNamed) {
  EXPECT_EQ(cell_fault(lift({0, 0, 0}), table, {{0.5, -1, 1}, {0, 0, -0.43}}, {}),
            "a camera is 0.5 m below the table that it sees");
  EXPECT_EQ(cell_fault(lift({0, 0, -0.5}), table, {}, {}).substr(0, 39),
            "the gripper goes 0.48 m below the table");
  EXPECT_EQ(cell_fault(lift({0.4, 0.6, 0.5}), table, {}, {}).substr(0, 22), "the gripper is 0.686 m");
}

TEST(CellCheck, WhatStandsStillWhileTheGripperMovesIsBackground) {
  std::vector<CellFrame> frames = lift(Eigen::Vector3d::Zero());
  const data::Points shelf = patch_at({1.51, 0.11, 0.52});
  for (CellFrame& frame : frames) {
    const data::Points cloth = frame.points;
    frame.points.resize(cloth.rows() + shelf.rows(), 3);
    frame.points << cloth, shelf;
  }
  const std::set<StillCell> still = still_cells(frames, table, {});
  EXPECT_TRUE(still.contains(still_cell({1.51, 0.11, 0.52})));
  EXPECT_FALSE(still.contains(still_cell({0.5, 0.1, 0.27})));  // the cloth passed there
  // A gripper that stands still tells nothing, nor do three frames.
  std::vector<CellFrame> standing = frames;
  for (CellFrame& frame : standing) frame.tool = Eigen::Vector3d(0, 0, 1);
  EXPECT_TRUE(still_cells(standing, table, {}).empty());
  frames.resize(3);
  EXPECT_TRUE(still_cells(frames, table, {}).empty());
}

}  // namespace
}  // namespace flash::sysid
