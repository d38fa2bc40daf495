#include "apps/sysid/frame_times.h"

#include <gtest/gtest.h>

#include "tests/data/temporary_folder.h"

namespace flash {
namespace {

const std::vector<std::string> three = {"a/0.png", "a/1.png", "a/2.png"};

TEST(FrameTimes, ARateMayHaveAStart) {
  EXPECT_EQ(frame_times("rate:4", three), (std::vector<double>{0, 0.25, 0.5}));
  EXPECT_EQ(frame_times("rate:4:1764000000", three),
            (std::vector<double>{1764000000, 1764000000.25, 1764000000.5}));
  for (const char* wrong :
       {"rate:", "rate:0", "rate:-1", "rate:nan", "rate:inf", "rate:10:inf", "rate:1:2:3", "rate:10:1e300"})
    EXPECT_TRUE(data::input_error_of([&] { frame_times(wrong, three); }).starts_with("--times: found"))
        << wrong;
  for (const char* wrong : {"rate:ten", "rate:1e300"})
    EXPECT_EQ(data::input_error_of([&] { frame_times(wrong, three); }),
              "--times: found \"" + std::string(wrong) +
                  "\", expected rate:HZ, rate:HZ:START or a CSV file with a column t");
}

TEST(FrameTimes, AnythingElseIsAFile) {
  const data::TemporaryFolder folder;
  const std::string path = folder.write("times.csv", "frame,t_s\n0,0.01\n1,0.11\n");
  EXPECT_EQ(frame_times(path, {three[0], three[2]}), (std::vector<double>{0.01, 0.11}));
  EXPECT_EQ(data::input_error_of([&] { frame_times(path, three); }),
            path + ": found 2 times, expected 3, one a frame");
}

TEST(FrameTimes, ARateIsNotThatOfFramesOfWhichSomeAreLost) {
  EXPECT_EQ(
      data::input_error_of([] {
        frame_times("rate:4", {"a/7.png", "a/8.png", "a/10.png"});
      }),
      "--times: found \"rate:4\", but no frame between 8.png and 10.png: expected a CSV file with the time "
      "of each frame that is there");
}

}  // namespace
}  // namespace flash
