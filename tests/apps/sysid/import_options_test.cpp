#include "apps/sysid/import_options.h"

#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <limits>
#include <utility>

#include "sysid/capture/segmented_cell.h"
#include "tests/data/temporary_folder.h"

namespace flash {
namespace {

constexpr double kOpen = std::numeric_limits<double>::infinity();

TEST(ImportOptions, AGraspIsACornerVerticesOrAPosition) {
  EXPECT_EQ(parse_grasp("corner").corner, (std::array<int, 2>{0, 0}));
  EXPECT_EQ(parse_grasp("corner:0,1").corner, (std::array<int, 2>{0, 1}));
  EXPECT_EQ(parse_grasp("vertices:3,1").vertices, (std::vector<int>{3, 1}));
  EXPECT_EQ(parse_grasp("position").position, Eigen::Vector3d(Eigen::Vector3d::Zero()));
  for (const char* wrong : {"corner:0,2", "corner:1", "vertices", "position:1", "edge", ""})
    EXPECT_EQ(data::input_error_of([&] { parse_grasp(wrong); }),
              "--grasp: found \"" + std::string(wrong) +
                  "\", expected corner, corner:I,J with I and J 0 or 1, vertices:A,B,... or position");
  for (const char* wrong : {"vertices:1,x", "corner:-1,0", "vertices:"})
    EXPECT_EQ(data::input_error_of([&] { parse_grasp(wrong); }),
              "--grasp: found \"" + std::string(wrong) + "\", expected whole numbers from 0 after the colon");
  EXPECT_EQ(data::input_error_of([] { parse_grasp("vertices:99999999999"); }),
            "--grasp: found \"vertices:99999999999\", expected numbers of vertices of the mesh, none above "
            "2,147,483,647");
  EXPECT_EQ(data::input_error_of([] { parse_grasp("vertices:3,1,3"); }),
            "--grasp: found \"vertices:3,1,3\", expected each vertex once");
}

TEST(ImportOptions, EitherSideOfACropMayBeOpen) {
  std::array<std::string, 3> ranges = {"-0.1:0.2", ":0.3", "0.075:"};
  const data::CropBox crop = parse_crop(ranges);
  EXPECT_EQ(crop.min, Eigen::Vector3d(-0.1, -kOpen, 0.075));
  EXPECT_EQ(crop.max, Eigen::Vector3d(0.2, 0.3, kOpen));
  ranges[2] = "0.5:0.1";
  EXPECT_EQ(data::input_error_of([&] { parse_crop(ranges); }),
            "--crop-z: found \"0.5:0.1\", expected a low end below the high one");
  for (const char* wrong : {"1", "1:2:3", "low:1"}) {
    ranges[0] = wrong;
    EXPECT_EQ(data::input_error_of([&] { parse_crop(ranges); }),
              "--crop-x: found \"" + std::string(wrong) +
                  "\", expected LOW:HIGH in metres, either side may be empty");
  }
}

/// A folder with three frames, and options that can be used.
class ImportOptionsOfAFolder : public testing::Test {
 protected:
  ImportOptionsOfAFolder() {
    for (const char* name : {"clouds/9.ply", "clouds/10.pcd", "clouds/11.ply", "clouds/notes.txt"})
      folder_.write(name, "");
    options_.clouds = folder_ / "clouds";
    options_.trajectory = folder_.write("tcp.tum", "0 0.5 0.1 0.052 0 0 0 1\n1 0.5 0.1 0.1 0 0 0 1\n");
    options_.mesh = "sheet:0.2x0.1:0.02";
  }

  template <class Change>
  std::string message_of(const Change& change) const {
    ImportOptions options = options_;
    change(options);
    sysid::ImportSettings settings;
    return data::input_error_of([&] { read_options(options, settings); });
  }

  data::TemporaryFolder folder_;
  ImportOptions options_;
};

TEST_F(ImportOptionsOfAFolder, TakeWhatTheCloudsWereSegmentedWith) {
  sysid::SegmentedCell cell;
  cell.table = {{0, 0, 0.05}, Eigen::Vector3d::UnitZ()};
  cell.times = {0, 0.1, 0.2};
  cell.trajectory = options_.trajectory;
  cell.cameras = {{0, 0, 1}};
  save_segmented_cell(cell, folder_ / "segment.json");
  const auto read = [&](const auto& change, bool accept) {
    ImportOptions options = options_;
    sysid::ImportSettings settings;
    settings.accept_unusable = accept;
    change(options, settings);
    read_options(options, settings);
    return settings;
  };
  const sysid::ImportSettings taken =
      read([](ImportOptions& options, auto&) { options.trajectory = ""; }, false);
  EXPECT_EQ(taken.times, cell.times);
  EXPECT_EQ(taken.table_height, 0.05);
  EXPECT_EQ(taken.trajectory.poses.size(), 2u);
  EXPECT_EQ(taken.cameras, cell.cameras);
  ASSERT_EQ(taken.taken.size(), 1u);
  EXPECT_TRUE(
      taken.taken[0].starts_with("the trajectory, the times and the table's height, 0.05 m, are from "));

  const std::string other = folder_.write("other.tum", "0 0.5 0.1 0.052 0 0 0 1\n1 0.5 0.2 0.1 0 0 0 1\n");
  const std::vector<std::pair<const char*, std::function<void(ImportOptions&, sysid::ImportSettings&)>>>
      others = {{"--trajectory", [&](ImportOptions& options, auto&) { options.trajectory = other; }},
                {"--times", [](ImportOptions& options, auto&) { options.times = "rate:15"; }},
                {"--table-z",
                 [](ImportOptions&, sysid::ImportSettings& settings) { settings.table_height = 0.17; }}};
  for (const auto& each : others) {
    EXPECT_TRUE(data::input_error_of([&] { read(each.second, false); }).starts_with(each.first))
        << each.first;
    EXPECT_TRUE(read(each.second, true).taken[0].starts_with("warning: " + std::string(each.first)))
        << each.first;
  }
  const auto stated = [&](double height, double bound) {
    return read(
        [&](auto&, sysid::ImportSettings& settings) {
          settings.table_height = height;
          settings.nuisance.offset.setConstant(bound);
        },
        false);
  };
  EXPECT_TRUE(stated(0.054, 0).taken[0].starts_with("the trajectory") ||
              stated(0.054, 0).taken[0].find("--table-z") == std::string::npos);
  EXPECT_EQ(data::input_error_of([&] { stated(0.038, 0); }),
            "--table-z: found 0.038 m, expected 0.05 m, as in " + (folder_ / "segment.json") +
                ", with which the clouds were segmented; --despite-doubts takes it as it is");
  EXPECT_NE(stated(0.038, 0.01).taken[0].find("--table-z: found 0.038 m, expected 0.05 m"),
            std::string::npos);
  cell.times.pop_back();
  save_segmented_cell(cell, folder_ / "segment.json");
  EXPECT_NE(
      data::input_error_of([&] { read([](auto&, auto&) {}, false); }).find("times: found 2, expected 3"),
      std::string::npos);
}

TEST_F(ImportOptionsOfAFolder, BecomeValues) {
  sysid::ImportSettings settings;
  read_options(options_, settings);
  EXPECT_EQ(settings.clouds, (std::vector<std::string>{folder_ / "clouds/9.ply", folder_ / "clouds/10.pcd",
                                                       folder_ / "clouds/11.ply"}));
  EXPECT_TRUE(settings.depth.empty());
  EXPECT_TRUE(settings.times.empty());
  EXPECT_EQ(settings.mesh_spec, "sheet:0.2x0.1:0.02");
  EXPECT_EQ(settings.mesh.vertices.rows(), 11 * 6);
  EXPECT_DOUBLE_EQ(settings.grasp.within, 0.02);
  EXPECT_EQ(settings.trajectory.times, (std::vector<double>{0, 1}));
  options_.times = "rate:4:1";
  options_.within = 0.05;
  read_options(options_, settings);
  EXPECT_EQ(settings.times, (std::vector<double>{1, 1.25, 1.5}));
  EXPECT_EQ(settings.grasp.within, 0.05);
}

TEST_F(ImportOptionsOfAFolder, AreRefusedByTheirNames) {
  EXPECT_EQ(
      message_of([](ImportOptions& o) { o.mesh = "sheet:0.2x0.1:0.15"; }),
      "--mesh: found \"sheet:0.2x0.1:0.15\", expected cells of at most the shorter side of the sheet, 0.1 m");
  EXPECT_EQ(message_of([](ImportOptions& o) { o.mesh = "sheet:200x200:10"; }),
            "--mesh: found \"sheet:200x200:10\", expected metres (millimetres read as metres?)");
  EXPECT_TRUE(message_of([](ImportOptions& o) {
                o.mesh = "sheet:0.2:0.02";
              }).starts_with("--mesh: found \"sheet:0.2:0.02\", expected sheet:WIDTHxHEIGHT"));
  EXPECT_EQ(message_of([](ImportOptions& o) { o.mesh = ""; }),
            "import: expected --mesh, as sheet:0.3x0.24:0.01");
  const std::string one = folder_.write("one.tum", "0 0.5 0.1 0.052 0 0 0 1\n");
  EXPECT_EQ(message_of([&](ImportOptions& o) { o.trajectory = one; }),
            "--trajectory: " + one + ": found one pose, expected two or more");
  EXPECT_EQ(message_of([&](ImportOptions& o) { o.clouds = folder_ / ".", o.trajectory = ""; }),
            (folder_ / ".") + ": found no clouds, expected a folder of .ply or .pcd files: is it " +
                (folder_ / "./clouds") + "?");
  EXPECT_EQ(message_of([](ImportOptions& o) { o.clouds = ""; }),
            "import: expected either a folder of clouds or --depth");
  EXPECT_EQ(message_of([](ImportOptions& o) { o.depth = o.clouds, o.clouds = ""; }),
            options_.clouds + ": found no depth images, expected a folder of .png or .tiff files");
  folder_.write("depth/a.png", "");
  EXPECT_EQ(message_of([&](ImportOptions& o) { o.depth = folder_ / "depth", o.clouds = ""; }),
            "import: --depth needs --extrinsics, and --intrinsics where these hold no lens");
}

}  // namespace
}  // namespace flash
