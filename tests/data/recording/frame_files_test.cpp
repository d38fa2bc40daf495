#include "data/recording/frame_files.h"

#include <gtest/gtest.h>

#include "tests/data/temporary_folder.h"

namespace flash::data {
namespace {

TEST(FrameFiles, NumbersCountInNames) {
  const TemporaryFolder folder;
  for (const char* name : {"10.png", "9.png", "a.txt", "1.PNG", "09b.png", "a2.png", "a10.png"})
    folder.write(name, "");
  std::vector<std::string> names;
  for (const std::string& path : files_in_order(folder / "", {".png"}))
    names.push_back(std::filesystem::path(path).filename());
  EXPECT_EQ(names, (std::vector<std::string>{"1.PNG", "9.png", "09b.png", "10.png", "a2.png", "a10.png"}));
  EXPECT_NE(input_error_of([&] { files_in_order(folder / "none", {".png"}); }).find("is no folder"),
            std::string::npos);
  std::filesystem::create_symlink("/dev/zero", folder / "5.png");
  EXPECT_NE(input_error_of([&] { files_in_order(folder / "", {".png"}); }).find("5.png: is no regular file"),
            std::string::npos);
}

TEST(FrameFiles, AGapIsAStepFarLongerThanTheOthers) {
  EXPECT_EQ(gap_in_names({"f/a1.png", "f/a2.png", "f/a4.png", "f/a5.png"}),
            "no frame between a2.png and a4.png");
  EXPECT_EQ(gap_in_names({"1.png", "2.png", "3.png"}), "");
  EXPECT_EQ(gap_in_names({"10.png", "20.png", "30.png"}), "");  // one in ten was kept
  EXPECT_EQ(gap_in_names({"1.png", "3.png"}), "");
  EXPECT_EQ(gap_in_names({"start.png", "middle.png", "end.png"}), "");
  EXPECT_EQ(gap_in_names({"frame.8.ply", "frame.9.ply", "frame.10.ply", "frame.11.ply"}), "");
  // Clocks, with and without a date and milliseconds.
  EXPECT_EQ(gap_in_names({"20261128_155958.png", "20261128_155959.png", "20261128_160000.png"}), "");
  EXPECT_EQ(gap_in_names({"155958.png", "155959.png", "160000.png"}), "");
  EXPECT_EQ(gap_in_names({"20261128155959800.png", "20261128155959900.png", "20261128160000000.png"}), "");
  EXPECT_EQ(gap_in_names({"20261128_155913.png", "20261128_155914.png", "20261128_155919.png"}),
            "no frame between 20261128_155914.png and 20261128_155919.png");
  EXPECT_EQ(gap_in_names({"20261128_000001.png", "20261128_000002.png", "20261128_000006.png"}),
            "no frame between 20261128_000002.png and 20261128_000006.png");
  // Time stamps jitter.
  EXPECT_EQ(gap_in_names({"1764000000.000.png", "1764000000.093.png", "1764000000.205.png"}), "");
  EXPECT_EQ(gap_in_names({"1764000000.000.png", "1764000000.093.png", "1764000000.305.png"}),
            "no frame between 1764000000.093.png and 1764000000.305.png");
  EXPECT_EQ(gap_in_names({"depth_0_15.png", "depth_0_16.png", "depth_0_17.png"}), "");
}

TEST(FrameFiles, TimesAreAColumnOfAFile) {
  const TemporaryFolder folder;
  const std::string path = folder.write("times.csv", "frame,t_s\n0,0.01\n1,0.11\n2,0.19\n");
  EXPECT_EQ(load_frame_times(path, 3), (std::vector<double>{0.01, 0.11, 0.19}));
  EXPECT_EQ(input_error_of([&] { load_frame_times(path, 2); }),
            path + ": found 3 times, expected 2, one a frame");
  folder.write("times.csv", "frame,t\n0,0.01\n1,0.01\n");
  EXPECT_EQ(input_error_of([&] { load_frame_times(path, 2); }),
            path + ": line 3: found \"1,0.01\", expected strictly increasing times");
  folder.write("times.csv", "frame,when\n0,0.01\n");
  EXPECT_EQ(input_error_of([&] { load_frame_times(path, 1); }),
            path + ": header: found \"frame,when\", expected a column t or t_s");
}

Trajectory between(double begin, double end) {
  Trajectory trajectory;
  for (int k = 0; k <= 10; ++k) {
    trajectory.times.push_back(begin + (end - begin) * k / 10);
    trajectory.poses.emplace_back(Eigen::Translation3d(0.01 * k, 0, 0));
  }
  return trajectory;
}

TEST(FrameFiles, JumpsOfATrajectoryAreFound) {
  Trajectory trajectory = between(0, 1);
  EXPECT_TRUE(find_jumps(trajectory, "g.tum").empty());
  trajectory.poses[4].translation().x() += 10;
  EXPECT_EQ(find_jumps(trajectory, "g.tum").at(0),
            "g.tum: 2 jumps of up to 10.01 m from one pose to the next, faster than 5 m/s; first after pose "
            "4: is the "
            "trajectory of one piece?");
  trajectory = between(0, 1);
  for (Eigen::Isometry3d& pose : trajectory.poses)
    pose.translation() = 1000 * (pose.translation().array() + 0.5);
  EXPECT_EQ(
      find_jumps(trajectory, "g.tum").at(0),
      "g.tum: 10 jumps of up to 10 m from one pose to the next, faster than 5 m/s; first after pose 1: are "
      "the poses in millimetres? Expected metres");
}

}  // namespace
}  // namespace flash::data
