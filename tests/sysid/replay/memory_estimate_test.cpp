#include "sysid/replay/memory_estimate.h"

#include <gtest/gtest.h>

#include "tests/sysid/short_lift.h"

namespace flash::sysid {
namespace {

TEST(MemoryEstimate, WhatCannotFitOrEndIsRefusedWithTheRightAdvice) {
  const data::TemporaryFolder folder;
  std::vector<Replay> replays = {short_lift(folder)};
  const MemoryEstimate small = estimate_batch(replays, 1);
  EXPECT_NO_THROW(check_job(replays, 1, small, 0));
  EXPECT_NO_THROW(check_job(replays, 1, small, 2 * small.total()));
  const auto advice = [&](double candidates, double machine) {
    return data::input_error_of([&] { check_job(replays, candidates, estimate_batch(replays, 1), machine); });
  };
  EXPECT_NE(advice(1, 1e6).find("at most the 1 MB that there are: use a coarser --mesh"), std::string::npos);
  EXPECT_NE(advice(1e12, 0).find("years: use fewer values"), std::string::npos);
  replays.front().steps = 1'000'000;
  EXPECT_NE(advice(1, 1e8).find("a longer --time-step"), std::string::npos);
  EXPECT_EQ(advice(1, 0), "");
  MemoryEstimate tracked;
  tracked.kept = tracked.keyframes = 1e9;
  EXPECT_NE(data::input_error_of([&] { check_job(replays, 1, tracked, 1e8); }).find("use fewer keyframes: "),
            std::string::npos);
}

}  // namespace
}  // namespace flash::sysid
