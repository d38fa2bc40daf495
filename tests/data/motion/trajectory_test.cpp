#include "data/motion/trajectory.h"

#include <gtest/gtest.h>

#include "data/files/atomic_file.h"
#include "tests/data/temporary_folder.h"

namespace flash::data {
namespace {

Trajectory screw() {
  Trajectory trajectory;
  for (int i = 0; i < 5; ++i) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translation() = Eigen::Vector3d(0.1 * i, -0.2, 1.0 / (1 + i));
    pose.linear() = Eigen::AngleAxisd(0.3 * i, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
    trajectory.times.push_back(0.1 * i * i + 0.1 * i);
    trajectory.poses.push_back(pose);
  }
  return trajectory;
}

TEST(Trajectory, TumRoundTripKeepsEveryDigit) {
  const TemporaryFolder folder;
  const Trajectory written = screw();
  save_tum(written, folder / "a.tum");
  const Trajectory read = load_trajectory(folder / "a.tum");
  ASSERT_EQ(read.times, written.times);
  for (std::size_t i = 0; i < read.poses.size(); ++i)
    // Rotation matrix to quaternion and back: a few roundings.
    EXPECT_TRUE(read.poses[i].isApprox(written.poses[i], 1e-14));
}

TEST(Trajectory, PoseIsInterpolatedWithinAndHeldOutside) {
  const Trajectory trajectory = screw();
  const double middle = (trajectory.times[1] + trajectory.times[2]) / 2;
  const Eigen::Isometry3d pose = pose_at(trajectory, middle);
  EXPECT_NEAR(pose.translation().x(), 0.15, 1e-15);
  const Eigen::Matrix3d expected =
      Eigen::AngleAxisd(0.45, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  EXPECT_TRUE(pose.linear().isApprox(expected, 1e-14));
  EXPECT_TRUE(pose_at(trajectory, -1).isApprox(trajectory.poses.front()));
  EXPECT_TRUE(pose_at(trajectory, 99).isApprox(trajectory.poses.back()));
  for (std::size_t i = 0; i < trajectory.times.size(); ++i)
    EXPECT_TRUE(pose_at(trajectory, trajectory.times[i]).isApprox(trajectory.poses[i], 1e-14));
}

TEST(Trajectory, CsvColumnsAreFoundByName) {
  const TemporaryFolder folder;
  const std::string path =
      folder.write("a.csv", "step;t; qw;qx;qy;qz;tx;ty;tz\r\n0;0.5;1;0;0;0;1;2;3\r\n1;1.5;0;1;0;0;4;5;6\r\n");
  const Trajectory trajectory = load_trajectory(path);
  ASSERT_EQ(trajectory.times, (std::vector<double>{0.5, 1.5}));
  EXPECT_EQ(trajectory.poses[1].translation(), Eigen::Vector3d(4, 5, 6));
  EXPECT_TRUE(trajectory.poses[1].linear().isApprox(Eigen::Vector3d(1, -1, -1).asDiagonal().toDenseMatrix()));
}

TEST(Trajectory, MalformedFilesAreNamedByLine) {
  const TemporaryFolder folder;
  const auto message = [&](const std::string& name, const std::string& contents) {
    const std::string path = folder.write(name, contents);
    std::string text = input_error_of([&] { load_trajectory(path); });
    return text.starts_with(path) ? text.substr(path.size()) : "no file in: " + text;
  };
  EXPECT_EQ(message("a.tum", ""), ": found no poses, expected lines t tx ty tz qx qy qz qw");
  EXPECT_EQ(message("a.tum", "# t\n0 0 0 0 0 0 1\n"),
            ": line 2: found 7 values, expected 8: t tx ty tz qx qy qz qw");
  EXPECT_EQ(message("a.tum", "0 0 0 0 0 0 0 1\n0 0 0 0 0 0 0 1\n"),
            ": line 2: time 0 s follows 0 s, expected strictly increasing times");
  EXPECT_EQ(message("a.tum", "0 0 0 0 0 0 0 2\n"),
            ": line 1: quaternion has length 2, expected 1 (order qx qy qz qw)");
  EXPECT_EQ(message("a.tum", "0 0 nan 0 0 0 0 1\n"), ": line 1, ty: found \"nan\", expected a finite number");
  EXPECT_EQ(message("a.csv", "t,tx,ty,tz,qx,qy,qz\n"),
            ": header: found t, tx, ty, tz, qx, qy, qz, and with them no rotation, expected qx,qy,qz,qw or "
            "rx,ry,rz or rotvec_x,rotvec_y,rotvec_z");
  EXPECT_EQ(message("a.csv", "t,tx,ty,tz,qx,qy,qz,qw\n1,2\n"), ": line 2: found 2 columns, expected 8");
  EXPECT_NE(input_error_of([&] { load_trajectory(folder / "none.tum"); }).find("No such file"),
            std::string::npos);
}

TEST(AtomicFile, ReplacesTheFileAndLeavesNothingBeside) {
  const TemporaryFolder folder;
  write_atomically(folder / "new/deep/a.txt", "one");
  write_atomically(folder / "new/deep/a.txt", "two");
  EXPECT_EQ(read_file(folder / "new/deep/a.txt"), "two");
  const std::filesystem::directory_iterator files(folder / "new/deep");
  EXPECT_EQ(std::distance(begin(files), end(files)), 1);
}

TEST(AtomicFile, KeepsTheOldFileWhenTheNewOneCannotBeWritten) {
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder / "taken/inside");
  EXPECT_THROW(write_atomically(folder / "taken", "x"),
               std::system_error);  // a folder cannot be renamed over
  EXPECT_TRUE(std::filesystem::is_directory(folder / "taken/inside"));
  const std::filesystem::directory_iterator files(folder / "");
  EXPECT_EQ(std::distance(begin(files), end(files)), 1);
}

}  // namespace
}  // namespace flash::data
