// The ways in which people hand over pictures, poses and intrinsics.
#include <gtest/gtest.h>

#include <filesystem>

#include "calib/dataset/dataset.h"
#include "data/camera/extrinsics.h"
#include "data/camera/intrinsics_file.h"
#include "data/files/error.h"
#include "data/motion/pose_table.h"
#include "data/motion/trajectory.h"
#include "data/picture/picture.h"
#include "tests/data/npz_text.h"
#include "tests/data/temporary_folder.h"

namespace flash::calib {
namespace {

constexpr const char* kCamera =
    "image_width: 8\nimage_height: 6\ncamera_matrix: {rows: 3, cols: 3, data: [10, 0, 4, 0, 10, 3, 0, 0, "
    "1]}\n";

/// Two pictures in `images`, and intrinsics.
void write_pictures(const data::TemporaryFolder& folder, const std::string& images = "images",
                    const std::vector<std::string>& names = {"a_9.png", "a_10.png"}) {
  std::filesystem::create_directories(folder / images);
  for (const std::string& name : names)
    data::save_png(data::Picture(8, 6, {0, 0, 0}), folder / (images + "/" + name));
  folder.write("camera_info.yaml", kCamera);
}

/// A quarter turn about z at (0.1, 0.2, 0.3).
Eigen::Isometry3d quarter() {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  T.translation() << 0.1, 0.2, 0.3;
  return T;
}

void expect_read(const data::TemporaryFolder& folder, const std::string& guess) {
  const Dataset dataset = load_dataset(folder / "");
  ASSERT_EQ(dataset.frames.size(), 2U);
  // Numbers count, not letters: the ninth comes first.
  EXPECT_EQ(dataset.frames[0].name, "a_9.png");
  // Written to four digits, a rotation is right to 1e-4.
  EXPECT_TRUE(dataset.frames[0].T_base_gripper.isApprox(quarter(), 1e-3));
  EXPECT_LT((dataset.frames[1].T_base_gripper.translation() - Eigen::Vector3d(0.4, 0.5, 0.6)).norm(), 1e-9);
  const std::string said = dataset.guesses.empty() ? "" : dataset.guesses.front();
  EXPECT_NE(said.find(guess), std::string::npos) << said;
  EXPECT_EQ(said.empty(), guess.empty());
}

TEST(Layouts, FoldersOfPicturesHaveManyNames) {
  for (const char* name : {"img", "Images", "IMAGE", "rgb", "."}) {
    const data::TemporaryFolder folder;
    write_pictures(folder, name);
    folder.write("poses.tum", "9 0 0 0 0 0 0 1\n10 0 0 0 0 0 0 1\n");
    EXPECT_EQ(load_dataset(folder / "").frames.size(), 2U) << name;
  }
}

TEST(Layouts, BitmapsArePictures) {
  const data::TemporaryFolder folder;
  write_pictures(folder);
  for (const char* name : {"images/a_9", "images/a_10"})
    std::filesystem::rename(folder / (std::string(name) + ".png"), folder / (std::string(name) + ".bmp"));
  folder.write("poses.tum", "9 0 0 0 0 0 0 1\n10 0 0 0 0 0 0 1\n");
  EXPECT_EQ(load_dataset(folder / "").frames.size(), 2U);
}

TEST(Layouts, BarePosesAreReadAndTheReadingIsSaid) {
  struct Case {
    const char *file, *text, *guess;
  };
  const Case cases[] = {
      {"poses.csv", "0.1,0.2,0.3,0,0,1.5708\n0.4,0.5,0.6,0,0,0\n", "x y z [m], three angles [rad]"},
      {"poses.csv", "100,200,300,0,0,90\n400,500,600,0,0,0\n", "x y z [mm], three angles [deg]"},
      {"poses.txt", "0.1, 0.2, 0.3, 0, 0, 0.7071, 0.7071\n0.4, 0.5, 0.6, 0, 0, 0, 1\n", "quaternion x y z w"},
      {"poses.txt", "9 0.1 0.2 0.3 0 0 1.5708\n10 0.4 0.5 0.6 0 0 0\n", "the picture's number"},
      {"poses.txt", "0 -1 0 0.1 1 0 0 0.2 0 0 1 0.3 0 0 0 1\n1 0 0 0.4 0 1 0 0.5 0 0 1 0.6 0 0 0 1\n",
       "a matrix, row by row [m]; poses are in the order of the pictures"},
      {"poses.txt", "0 -1 0 0.1\n1 0 0 0.2\n0 0 1 0.3\n0 0 0 1\n\n1 0 0 0.4\n0 1 0 0.5\n0 0 1 0.6\n0 0 0 1\n",
       "a matrix, row by row"},
      {"poses.csv", "0,-1,0,0.1,1,0,0,0.4\n1,0,0,0.2,0,1,0,0.5\n0,0,1,0.3,0,0,1,0.6\n0,0,0,1,0,0,0,1\n",
       "matrices side by side"},
      {"robot_poses.csv", "0,-1,0,100,1,0,0,200,0,0,1,300\n1,0,0,400,0,1,0,500,0,0,1,600\n", "[mm]"},
  };
  for (const Case& c : cases) {
    const data::TemporaryFolder folder;
    write_pictures(folder);
    folder.write(c.file, c.text);
    expect_read(folder, c.guess);
  }
}

TEST(Layouts, HeadersOfManyProgramsAreRead) {
  struct Case {
    const char *text, *guess;
  };
  const Case cases[] = {
      {"x,y,z,rx,ry,rz\n0.1,0.2,0.3,0,0,1.5708\n0.4,0.5,0.6,0,0,0\n", "in the order of the pictures"},
      {"x,y,z,qw,qx,qy,qz\n0.1,0.2,0.3,0.7071068,0,0,0.7071068\n0.4,0.5,0.6,1,0,0,0\n",
       "in the order of the pictures"},
      {"X,Y,Z,A,B,C\n0.1,0.2,0.3,90,0,0\n0.4,0.5,0.6,0,0,0\n", "in the order of the pictures"},
      {"\xEF\xBB\xBFimage;x;y;z;rx;ry;rz\na_9.png;0.1;0.2;0.3;0;0;1.5708\na_10.png;0.4;0.5;0.6;0;0;0\n", ""},
      {"filename,x_mm,y_mm,z_mm,rx_deg,ry_deg,rz_deg\na_9.png,100,200,300,0,0,90\na_10.png,400,500,600,0,0,"
       "0\n",
       ""},
  };
  for (const Case& c : cases) {
    const data::TemporaryFolder folder;
    write_pictures(folder);
    folder.write("poses.csv", c.text);
    expect_read(folder, c.guess);
  }
}

// One reader serves flash-calib (load_dataset) and flash-sysid (load_trajectory, load_camera_pose).
TEST(Layouts, PosesOverTimeAreReadAlikeByBothPrograms) {
  struct Case {
    const char *file, *text;
  };
  const Case cases[] = {
      {"poses.tum", "1700000000 0.1 0.2 0.3 0 0 0.7071068 0.7071068\n1700000000.25 0.4 0.5 0.6 0 0 0 1\n"},
      {"poses.txt",
       "# t tx ty tz qw qx qy qz\n1700000000 0.1 0.2 0.3 0.7071068 0 0 0.7071068\n1700000000.25 0.4 0.5 0.6 "
       "1 "
       "0 0 0\n"},
      {"poses.tum",
       "1700000000000000000 0.1 0.2 0.3 0 0 0.7071068 0.7071068\n1700000000250000000 0.4 0.5 0.6 0 0 0 1\n"},
      {"poses.csv",
       "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []\n"
       "1700000000000000000,0.1,0.2,0.3,0.7071068,0,0,0.7071068\n1700000000250000000,0.4,0.5,0.6,1,0,0,0\n"},
      {"poses.csv",
       "# by hand\ntime;qw;qx;qy;qz;x;y;z\n1700000000;0.7071068;0;0;0.7071068;0.1;0.2;0.3\n"
       "1700000000.25;1;0;0;0;0.4;0.5;0.6\n"},
      {"poses.csv",
       "t,x_mm,y_mm,z_mm,rx_deg,ry_deg,rz_deg\n1700000000,100,200,300,0,0,90\n"
       "1700000000.25,400,500,600,0,0,0\n"},
      {"poses.txt",
       "1700000000 0 -1 0 0.1 1 0 0 0.2 0 0 1 0.3 0 0 0 1\n1700000000.25 1 0 0 0.4 0 1 0 0.5 0 0 1 0.6 0 0 0 "
       "1\n"},
      {"poses.csv",
       "1700000000000000000,0,-1,0,0.1,1,0,0,0.2,0,0,1,0.3\n1700000000250000000,1,0,0,0.4,0,1,0,0.5,0,0,1,0."
       "6\n"},
      {"poses.json",
       R"([{"t": 1700000000, "pose": [[0,-1,0,0.1],[1,0,0,0.2],[0,0,1,0.3],[0,0,0,1]]},
           {"t": 1700000000.25, "x": 0.4, "y": 0.5, "z": 0.6, "qx": 0, "qy": 0, "qz": 0, "qw": 1}])"},
      {"poses.json",
       R"({"poses": [{"timestamp": 1700000000000000000, "position": [0.1, 0.2, 0.3],
                      "orientation": {"w": 0.7071068, "x": 0, "y": 0, "z": 0.7071068}},
                     {"timestamp": 1700000000250000000, "translation": {"x": 0.4, "y": 0.5, "z": 0.6},
                      "rotation": [[1,0,0],[0,1,0],[0,0,1]]}]})"},
  };
  for (const Case& c : cases) {
    const data::TemporaryFolder folder;
    write_pictures(folder, "images", {"1700000000.000000.png", "1700000000.250000.png"});
    const std::string path = folder.write(c.file, c.text);
    const data::Trajectory trajectory = data::load_trajectory(path);
    ASSERT_EQ(trajectory.times.size(), 2U) << c.text;
    // A double of seconds since 1970 is told to a quarter of a microsecond.
    EXPECT_NEAR(trajectory.times[1] - trajectory.times[0], 0.25, 1e-6) << c.text;
    EXPECT_TRUE(trajectory.poses[0].isApprox(quarter(), 1e-6)) << c.text;
    EXPECT_TRUE(data::load_camera_pose(path, false).transform.T.isApprox(quarter(), 1e-6)) << c.text;
    const Dataset dataset = load_dataset(folder / "");
    ASSERT_EQ(dataset.frames.size(), 2U) << c.text;
    for (std::size_t i = 0; i < 2; ++i)
      EXPECT_TRUE(dataset.frames[i].T_base_gripper.isApprox(trajectory.poses[i], 1e-6)) << c.text;
  }
}

TEST(Layouts, PosesWithoutTimesAreNoTrajectory) {
  const data::TemporaryFolder folder;
  for (const auto& [name, text] :
       {std::pair("a.csv", "index,x,y,z,qx,qy,qz,qw\n1,0,0,0,0,0,0,1\n2,0,0,0,0,0,0,1\n"),
        {"b.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0 0 1 0 0 0 0 1 0\n"},
        {"c.json", R"([[0, 0, 0, 0, 0, 0, 1], [0, 0, 0, 0, 0, 0, 1]])"}}) {
    const std::string path = folder.write(name, text);
    EXPECT_EQ(data::input_error_of([&] { data::load_trajectory(path); }),
              path + ": found 2 poses without times, expected a time before each, as t tx ty tz qx qy qz qw");
  }
}

TEST(Layouts, NumbersInTheMiddleOfNamesOrderPicturesOfBarePoses) {
  const data::TemporaryFolder folder;
  write_pictures(folder, "images", {"img1_cam1.png", "img2_cam1.png", "img10_cam1.png"});
  folder.write("poses.txt", "0.1 0 0 0 0 0 1\n0.2 0 0 0 0 0 1\n1 0 0 0 0 0 1\n");
  const Dataset dataset = load_dataset(folder / "");
  ASSERT_EQ(dataset.frames.size(), 3U);
  for (const auto& [i, name, x] :
       {std::tuple(0, "img1_cam1.png", 0.1), {1, "img2_cam1.png", 0.2}, {2, "img10_cam1.png", 1.0}}) {
    const Frame& frame = dataset.frames[static_cast<std::size_t>(i)];
    EXPECT_EQ(frame.name, name);
    EXPECT_EQ(frame.T_base_gripper.translation().x(), x);
  }
}

TEST(Layouts, DepthOfRealNumbersIsFoundBesideThePictures) {
  for (const char* ending : {".png", ".npy", ".tif", ".tiff"}) {
    const data::TemporaryFolder folder;
    write_pictures(folder);
    folder.write("poses.tum", "9 0 0 0 0 0 0 1\n10 0 0 0 0 0 0 1\n");
    folder.write(std::string("depth/a_9") + ending, "");
    const Dataset dataset = load_dataset(folder / "");
    EXPECT_EQ(std::filesystem::path(dataset.frames[0].depth).extension(), ending);
    EXPECT_EQ(dataset.frames[1].depth, "");
  }
}

TEST(Layouts, PlacesThatNoRobotReachesAreRefused) {
  const data::TemporaryFolder folder;
  write_pictures(folder);
  folder.write("poses.tum", "9 1e300 0 0 0 0 0 1\n10 0 0 0 0 0 0 1\n11 0 0 0 0 0 0 1\n");
  const std::string message = data::input_error_of([&] { load_dataset(folder / ""); });
  EXPECT_NE(message.find("m away, expected metres"), std::string::npos) << message;
}

TEST(Layouts, ListsThatHoldThemselvesAreRefused) {
  const data::TemporaryFolder folder;
  write_pictures(folder);
  folder.write("poses.tum", "9 0 0 0 0 0 0 1\n10 0 0 0 0 0 0 1\n");
  folder.write("camera_info.yaml",
               "image_width: 640\nimage_height: 480\na: &a [*a]\ncamera_matrix: {data: *a}\n");
  EXPECT_NE(data::input_error_of([&] { load_dataset(folder / ""); }), "");
}

TEST(Layouts, MatrixPerTextFile) {
  for (const char* beginning : {"poses/pose_", "poses/"}) {
    const data::TemporaryFolder folder;
    write_pictures(folder);
    std::filesystem::create_directories(folder / "poses");
    folder.write(beginning + std::string("9.txt"), "0 -1 0 0.1\n1 0 0 0.2\n0 0 1 0.3\n0 0 0 1\n");
    folder.write(beginning + std::string("10.txt"), "1, 0, 0, 0.4\n0, 1, 0, 0.5\n0, 0, 1, 0.6\n0, 0, 0, 1\n");
    expect_read(folder, "a matrix, row by row [m]");
  }
}

TEST(Layouts, TransformsOfRos) {
  const data::TemporaryFolder folder;
  write_pictures(folder);
  const std::string head = "header: {stamp: {sec: 1, nanosec: 2}, frame_id: base}\nchild_frame_id: tool0\n";
  folder.write("poses/9.yaml", head +
                                   "transform:\n  translation: {x: 0.1, y: 0.2, z: 0.3}\n"
                                   "  rotation: {x: 0, y: 0, z: 0.7071068, w: 0.7071068}\n");
  folder.write("poses/10.yaml", head +
                                    "transform:\n  translation: {x: 0.4, y: 0.5, z: 0.6}\n"
                                    "  rotation: {x: 0, y: 0, z: 0, w: 1}\n");
  expect_read(folder, "");
}

TEST(Layouts, PosesInOneYamlAreNamedAsNotRead) {
  const data::TemporaryFolder folder;
  write_pictures(folder);
  folder.write("poses.yaml", "poses: []\n");
  const std::string message = data::input_error_of([&] { load_dataset(folder / ""); });
  EXPECT_NE(message.find("found poses.yaml, which is not read, expected poses.tum"), std::string::npos)
      << message;
}

TEST(Layouts, JsonLists) {
  const char* const kTexts[] = {
      R"([{"image": "a_10.png", "x": 0.4, "y": 0.5, "z": 0.6, "qx": 0, "qy": 0, "qz": 0, "qw": 1},
          {"image": "a_9.png", "pose": [[0,-1,0,0.1],[1,0,0,0.2],[0,0,1,0.3],[0,0,0,1]]}])",
      R"({"poses": [{"index": 9, "position": [0.1, 0.2, 0.3], "orientation": {"x": 0, "y": 0, "z": 0.7071068, "w": 0.7071068}},
          {"index": 10, "translation": {"x": 0.4, "y": 0.5, "z": 0.6}, "rotation": [[1,0,0],[0,1,0],[0,0,1]]}]})"};
  for (const char* text : kTexts) {
    const data::TemporaryFolder folder;
    write_pictures(folder);
    folder.write("poses.json", text);
    expect_read(folder, "");
  }
  const data::TemporaryFolder folder;
  write_pictures(folder);
  folder.write("poses.json", "[[0.1,0.2,0.3,0,0,0.7071068,0.7071068],[0.4,0.5,0.6,0,0,0,1]]");
  expect_read(folder, "in the order of the pictures");
}

TEST(Layouts, SamplesOfEasyHandeyeStandBesideTheirPictures) {
  const data::TemporaryFolder folder;
  write_pictures(folder);
  const std::string tracking =
      "  tracking:\n    translation: {x: 0, y: 0, z: 1}\n    rotation: {x: 0, y: 0, z: 0, w: 1}\n";
  folder.write(
      "robot.samples",
      "samples:\n- robot:\n    translation: {x: 0.1, y: 0.2, z: 0.3}\n    rotation: {x: 0, y: 0, z: "
      "0.7071068, w: 0.7071068}\n" +
          tracking +
          "- robot:\n    translation: {x: 0.4, y: 0.5, z: 0.6}\n    rotation: {x: 0, y: 0, z: 0, w: 1}\n" +
          tracking);
  expect_read(folder, "in the order of the pictures");
}

TEST(Layouts, PairsWithNamedFields) {
  const data::TemporaryFolder folder;
  const std::string path = folder.write("pairs.json",
                                        R"([{"gripper": [[1,0,0,1],[0,1,0,2],[0,0,1,3],[0,0,0,1]],
           "target": {"position": {"x": 0, "y": 0, "z": 1}, "orientation": {"x": 1, "y": 0, "z": 0, "w": 0}}}])");
  const std::vector<Observation> pairs = pair_observations(load_dataset(path));
  ASSERT_EQ(pairs.size(), 1U);
  EXPECT_EQ(pairs[0].T_base_gripper.translation(), Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(pairs[0].T_camera_target.front().translation().z(), 1);
  EXPECT_EQ(pairs[0].T_camera_target.front().linear()(1, 1), -1);
}

TEST(Layouts, PictureWithoutAPoseIsLeftOutByName) {
  const data::TemporaryFolder folder;
  write_pictures(folder);
  folder.write("poses.tum", "9 0 0 0 0 0 0 1\n");
  const Dataset dataset = load_dataset(folder / "");
  EXPECT_EQ(dataset.frames.size(), 1U);
  ASSERT_EQ(dataset.guesses.size(), 1U);
  EXPECT_NE(dataset.guesses[0].find("a_10.png: no pose with number 10"), std::string::npos)
      << dataset.guesses[0];
  EXPECT_NE(dataset.guesses[0].find("it is left out"), std::string::npos);
  // Where poses go by their place alone, one that is missing moves all others.
  std::filesystem::remove(folder / "poses.tum");
  folder.write("poses.csv", "0.1,0.2,0.3,0,0,0\n");
  const std::string message = data::input_error_of([&] { load_dataset(folder / ""); });
  EXPECT_NE(message.find("1 poses without names or numbers for 2 pictures"), std::string::npos) << message;
}

// What a program drew of its pictures, under other names.
TEST(Layouts, PicturesOfAProgramsOutputAreNamed) {
  const data::TemporaryFolder folder;
  write_pictures(folder);
  const std::string output = folder / "images/CalibratedResult9.png";
  std::filesystem::copy_file(folder / "images/a_9.png", output);
  folder.write("poses.tum", "9 0 0 0 0 0 0 1\n10 0 0 0 0 0 0 1\n");
  const std::string numbered = data::input_error_of([&] { load_dataset(folder / ""); });
  EXPECT_NE(numbered.find("1 CalibratedResultN and 2 a_N, with the same numbers"), std::string::npos)
      << numbered;
  std::filesystem::remove(folder / "poses.tum");
  folder.write("poses.csv", "0.1,0.2,0.3,0,0,1.5708\n0.4,0.5,0.6,0,0,0\n");
  const std::string in_order = data::input_error_of([&] { load_dataset(folder / ""); });
  EXPECT_NE(in_order.find("2 poses without names or numbers for 3 pictures (1 CalibratedResultN, 2 a_N)"),
            std::string::npos)
      << in_order;
}

TEST(Layouts, SimulatedTimeAndAWallClockAreNotMixed) {
  const data::TemporaryFolder folder;
  write_pictures(folder);
  std::filesystem::rename(folder / "images/a_9.png", folder / "images/685.125.png");
  std::filesystem::rename(folder / "images/a_10.png", folder / "images/686.5.png");
  folder.write("poses.tum", "1715408108.1 0 0 0 0 0 0 1\n1715408109.6 0 0 0 0 0 0 1\n");
  const std::string said = data::input_error_of([&] { load_dataset(folder / ""); });
  EXPECT_NE(said.find("685.125.png: found the time 685.125 s, and in "), std::string::npos) << said;
  EXPECT_NE(said.find("simulated time"), std::string::npos) << said;
}

TEST(Layouts, MatricesThatAreNoRotationAreRefusedWithTheNumber) {
  const data::TemporaryFolder folder;
  write_pictures(folder);
  const auto said = [&](const std::string& first) {
    folder.write("poses.csv", first + "\n1,0,0,0.4,0,1,0,0.5,0,0,1,0.6\n");
    return data::input_error_of([&] { load_dataset(folder / ""); });
  };
  EXPECT_NE(said("0.988995,0,0,0,0,1,0,0,0,0,1,0").find("R(0,0) is 0.989"), std::string::npos)
      << said("0.988995,0,0,0,0,1,0,0,0,0,1,0");
  EXPECT_NE(said("-1,0,0,0,0,1,0,0,0,0,1,0").find("mirrors"), std::string::npos);
  EXPECT_NE(said("1,0.1,0,0,0,0.994987,0,0,0,0,1,0").find("have the product 0.1"), std::string::npos)
      << said("1,0.1,0,0,0,0.994987,0,0,0,0,1,0");
}

TEST(Layouts, AColumnThatStandsTwiceIsRefused) {
  const data::TemporaryFolder folder;
  const std::string path =
      folder.write("poses.csv", "index,x,y,z,qx,qy,qz,qw,tx\n0,0,0,0,0,0,0,1,0.5\n1,0,0,0,0,0,0,1,0.5\n");
  EXPECT_NE(
      data::input_error_of([&] { data::load_pose_table(path); }).find("found tx as column 2 and as column 9"),
      std::string::npos);
}

TEST(Layouts, NumbersThatAreNoPoseAreNamed) {
  const data::TemporaryFolder folder;
  write_pictures(folder);
  folder.write("poses.txt", "1 2 3 4 5\n1 2 3 4 5\n");
  EXPECT_NE(data::input_error_of([&] { load_dataset(folder / ""); }).find("found 5 numbers"),
            std::string::npos);
  folder.write("poses.txt", "0 0 0 0 0 0\n0 0 0 0 0\n");
  EXPECT_NE(
      data::input_error_of([&] { load_dataset(folder / ""); }).find("pose 2: found 5 numbers, expected 6"),
      std::string::npos);
  folder.write("poses.txt", "0 0 0 0 0 nan\n0 0 0 0 0 0\n");
  EXPECT_NE(data::input_error_of([&] { load_dataset(folder / ""); }).find("line 1"), std::string::npos);
}

TEST(Layouts, IntrinsicsOfManyKinds) {
  const data::TemporaryFolder folder;
  const std::string files[] = {
      folder.write(
          "opencv.yml",
          "%YAML:1.0\n---\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 10., "
          "0., "
          "4., 0., 11., 3., 0., 0., 1. ]\ndist_coeffs: !!opencv-matrix\n   rows: 1\n   cols: 5\n   dt: d\n   "
          "data: [ -0.1, 0.01, 0.001, 0.002, 0. ]\n"),
      folder.write(
          "matrix.json",
          R"({"mtx": [[10,0,4],[0,11,3],[0,0,1]], "dist": [[-0.1, 0.01, 0.001, 0.002, 0.0]], "rms": 0.2})"),
      folder.write(
          "parts.json",
          R"({"intrinsics": {"fx": 10, "fy": 11, "ppx": 4, "ppy": 3, "coeffs": [-0.1, 0.01, 0.001, 0.002, 0]}})"),
      folder.write(
          "parts.yaml",
          "Camera:\n  fx: 10\n  fy: 11\n  cx: 4\n  cy: 3\n  k1: -0.1\n  k2: 0.01\n  p1: 0.001\n  p2: "
          "0.002\n"),
      folder.write(
          "model.yaml",
          "camera_matrix: [10, 0, 4, 0, 11, 3, 0, 0, 1]\ndistortion: {model: plumb_bob, coefficients: "
          "[-0.1, 0.01, 0.001, 0.002, 0]}\n"),
      folder.write(
          "capitals.json",
          R"({"Intrinsic": [[10,0,4],[0,11,3],[0,0,1]], "Distortion": [-0.1, 0.01, 0.001, 0.002, 0]})"),
      folder.write("numpy.npz", data::npz_text({{"mtx", {3, 3}, {10, 0, 4, 0, 11, 3, 0, 0, 1}},
                                                {"dist", {5}, {-0.1, 0.01, 0.001, 0.002, 0}}}))};
  for (const std::string& file : files) {
    const data::CameraIntrinsics camera = data::load_intrinsics(file);
    EXPECT_EQ(camera.width, 0) << file;
    EXPECT_EQ(camera.fx, 10) << file;
    EXPECT_EQ(camera.fy, 11) << file;
    EXPECT_EQ(camera.cx, 4) << file;
    EXPECT_EQ(camera.cy, 3) << file;
    EXPECT_EQ(camera.distortion, (std::vector<double>{-0.1, 0.01, 0.001, 0.002, 0})) << file;
  }
  EXPECT_EQ(data::load_intrinsics(folder.write("camera_info.yaml", kCamera)).width, 8);
}

TEST(Layouts, WithoutIntrinsicsTheVerbThatMakesThemIsNamed) {
  const data::TemporaryFolder folder;
  write_pictures(folder);
  std::filesystem::remove(folder / "camera_info.yaml");
  folder.write("poses.tum", "9 0 0 0 0 0 0 1\n10 0 0 0 0 0 0 1\n");
  const std::string message = data::input_error_of([&] { load_dataset(folder / ""); });
  EXPECT_NE(message.find("flash-calib intrinsics"), std::string::npos) << message;
}

TEST(Layouts, IntrinsicsThatAreNoneAreNamed) {
  const data::TemporaryFolder folder;
  EXPECT_NE(data::input_error_of([&] {
              data::load_intrinsics(folder.write("a.json", R"({"rms": 1})"));
            }).find("camera_matrix: missing"),
            std::string::npos);
  EXPECT_NE(data::input_error_of([&] {
              data::load_intrinsics(folder.write("b.json", R"({"K": [[10,1,4],[0,11,3],[0,0,1]]})"));
            }).find("expected 3 x 3"),
            std::string::npos);
  for (const char* distortion : {"distortion_model: fisheye", "distortion: {model: equidistant}"}) {
    const std::string said = data::input_error_of([&] {
      data::load_intrinsics(
          folder.write("d.yaml", std::string("{fx: 1, fy: 1, cx: 1, cy: 1, D: [0.1], ") + distortion + "}"));
    });
    EXPECT_NE(said.find("expected plumb_bob, rational_polynomial or none"), std::string::npos) << said;
  }
  for (const std::string& text :
       {std::string("no archive"), data::npz_text({{"mtx", {1}, {10}}}).substr(0, 60)})
    EXPECT_THROW(data::load_intrinsics(folder.write("c.npz", text)), data::InputError);
}

}  // namespace
}  // namespace flash::calib
