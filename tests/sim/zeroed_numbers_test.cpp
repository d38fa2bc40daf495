#include "sim/zeroed_numbers.h"

#include <gtest/gtest.h>

#include <utility>

namespace flash::sim {
namespace {

TEST(ZeroedNumbers, AreZeroUntilTheyAreWrittenAndMoveWithTheirOwner) {
  constexpr std::size_t count = 1'000'000;
  ZeroedNumbers numbers(count);
  for (std::size_t i = 0; i < count; i += 999) ASSERT_EQ(numbers.data()[i], 0);
  numbers.data()[count - 1] = 3;
  const ZeroedNumbers moved = std::move(numbers);
  EXPECT_EQ(moved.data()[count - 1], 3);
}

TEST(ZeroedNumbers, OfNoneAreNone) { EXPECT_NO_THROW(ZeroedNumbers(0)); }

}  // namespace
}  // namespace flash::sim
