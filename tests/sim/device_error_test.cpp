#include "sim/device_error.h"

#include <gtest/gtest.h>

namespace flash::sim {
namespace {

TEST(DeviceError, NamesRunsOfNumbers) {
  const auto text = [](std::vector<std::size_t> numbers) {
    return std::string(DeviceError("CUDA device 1: out of memory", std::move(numbers)).what());
  };
  const std::string why = "CUDA device 1: out of memory";
  EXPECT_EQ(text({}), why);
  EXPECT_EQ(text({7}), why + "; no result of environment 7");
  EXPECT_EQ(text({8, 7}), why + "; no result of environments 7, 8");
  EXPECT_EQ(text({64, 3, 65, 66}), why + "; no result of environments 3, 64 to 66");
  EXPECT_EQ(text({0, 2, 4, 6, 8, 10}), why + "; no result of environments 0, 2, 4, 6 and 2 more");
}

TEST(DeviceError, GoesByTheNumbersOfWhoAsked) {
  const DeviceError error("lost", {0, 1, 2});
  const DeviceError whole = error.renumbered([](std::size_t e) { return 10 + 2 * e; }, "candidate");
  EXPECT_EQ(whole.without_result(), (std::vector<std::size_t>{10, 12, 14}));
  EXPECT_EQ(std::string(whole.what()), "lost; no result of candidates 10, 12, 14");
  EXPECT_EQ(whole.why(), "lost");
}

}  // namespace
}  // namespace flash::sim
