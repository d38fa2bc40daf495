#include "sysid/capture/clocks.h"

#include <gtest/gtest.h>

#include "tests/data/temporary_folder.h"

namespace flash::sysid {
namespace {

std::vector<double> times_at(double rate) {
  std::vector<double> times;
  for (int i = 0; i <= 50; ++i) times.push_back(i / rate);
  return times;
}

data::Trajectory between(double begin, double end) {
  data::Trajectory trajectory;
  for (int k = 0; k <= 10; ++k) {
    trajectory.times.push_back(begin + (end - begin) * k / 10);
    trajectory.poses.emplace_back(Eigen::Translation3d(0.01 * k, 0, 0));
  }
  return trajectory;
}

TEST(Clocks, FramesOfAnotherClockAreRefused) {
  const std::vector<double> times = times_at(10);
  EXPECT_TRUE(compare_clocks(times, between(0, 5), "g.tum").empty());
  EXPECT_EQ(
      data::input_error_of([&] { compare_clocks(times, between(1.764e9, 1.764e9 + 5), "g.tum"); }),
      "g.tum: the frames are of 0.000 to 5.000 s, the trajectory of 1764000000.000 to 1764000005.000 s: "
      "51 of 51 frames are outside of it, expected one clock for both (--times)");
  EXPECT_NE(data::input_error_of([&] { compare_clocks(times, between(0, 2), "g.tum"); }), "");
  std::vector<double> milliseconds;
  for (const double t : times_at(10)) milliseconds.push_back(1e3 * (1.764e9 + t));
  EXPECT_NE(data::input_error_of([&] {
              compare_clocks(milliseconds, between(1.764e9, 1.764e9 + 5), "g.tum");
            }).find("are one's stamps in milliseconds or microseconds?"),
            std::string::npos);
  EXPECT_NE(compare_clocks(milliseconds, between(1.764e12, 1.764e12 + 5000), "g.tum")
                .at(0)
                .find("100 s from one frame to the next: are the stamps in milliseconds"),
            std::string::npos);
  EXPECT_NE(compare_clocks(times, between(0, 4), "g.tum").at(0).find("10 of 51 frames are outside"),
            std::string::npos);
  EXPECT_NE(compare_clocks(times_at(1000), between(0, 5), "g.tum").at(0).find("far longer"),
            std::string::npos);
}

}  // namespace
}  // namespace flash::sysid
