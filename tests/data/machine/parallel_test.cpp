#include "data/machine/parallel.h"

#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>
#include <string>
#include <vector>

namespace flash::data {
namespace {

TEST(Parallel, EachIndexIsWorkedOnOnceOnAnyNumberOfThreads) {
  for (const int threads : {0, 1, 3, 50})
    for (const std::size_t count : {0, 1, 2, 1000}) {
      std::vector<int> times(count, 0);
      for_each_in_parallel(count, threads, [&](std::size_t i) { ++times[i]; });
      EXPECT_EQ(times, std::vector<int>(count, 1)) << threads << " threads";
    }
}

TEST(Parallel, OneOfSeveralFailuresReachesTheCallerAndNothingIsBegunAfterIt) {
  for (const int threads : {1, 3}) {
    std::atomic<int> begun = 0;
    std::string message;
    try {
      for_each_in_parallel(100000, threads, [&](std::size_t i) {
        ++begun;
        throw std::runtime_error("failure " + std::to_string(i));
      });
    } catch (const std::runtime_error& failure) {
      message = failure.what();
    }
    EXPECT_TRUE(message.starts_with("failure ")) << message;
    // A thread begins no second one after its own.
    EXPECT_LE(begun, threads);
  }
}

}  // namespace
}  // namespace flash::data
