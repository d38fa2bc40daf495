#include "sysid/capture/import_cut.h"

#include <gtest/gtest.h>

#include "tests/data/temporary_folder.h"

namespace flash::sysid {
namespace {

/// Ten frames a second for a second; poses at 0, 0.4 and 1.2 s, up by 1 m/s.
ImportSettings recorded() {
  ImportSettings settings;
  for (int k = 0; k <= 10; ++k) {
    settings.clouds.push_back(std::to_string(k) + ".ply");
    settings.times.push_back(100 + 0.1 * k);
  }
  for (const double t : {0.0, 0.4, 1.2}) {
    settings.trajectory.times.push_back(100 + t);
    settings.trajectory.poses.emplace_back(Eigen::Translation3d(0, 0, t));
  }
  return settings;
}

TEST(ImportCut, LeavesFramesAndPosesBetweenTheTimes) {
  ImportSettings settings = recorded();
  cut({}, {}, settings);
  EXPECT_EQ(settings.clouds.size(), 11u);
  cut(100.25, 100.75, settings);
  EXPECT_EQ(settings.clouds, (std::vector<std::string>{"3.ply", "4.ply", "5.ply", "6.ply", "7.ply"}));
  EXPECT_EQ(settings.times.size(), 5u);
  EXPECT_EQ(settings.trajectory.times, (std::vector<double>{100.25, 100.4, 100.75}));
  EXPECT_NEAR(settings.trajectory.poses.front().translation().z(), 0.25, 1e-9);
  EXPECT_NEAR(settings.trajectory.poses.back().translation().z(), 0.75, 1e-9);
}

TEST(ImportCut, TimesThatHoldNothingAreRefusedByTheirOption) {
  const auto message = [](std::optional<double> from, std::optional<double> until) {
    ImportSettings settings = recorded();
    return data::input_error_of([&] { cut(from, until, settings); });
  };
  // Counted from the start, not by the clock.
  EXPECT_EQ(message(0.5, {}), "--from: found 0.5 s, expected a time of the trajectory, 100 to 101.2 s");
  EXPECT_EQ(message(102, {}), "--from: found 102 s, expected a time of the trajectory, 100 to 101.2 s");
  EXPECT_EQ(message({}, 2), "--until: found 2 s, expected a time of the trajectory, 100 to 101.2 s");
  EXPECT_EQ(message(101.1, {}), "--from: found no frame in that time, expected one of 100 to 101 s");
  EXPECT_EQ(message(100.5, 100.5), "--from: found 100.5 s, expected less than --until 100.5 s");
}

}  // namespace
}  // namespace flash::sysid
