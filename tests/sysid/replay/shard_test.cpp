#include "sysid/replay/shard.h"

#include <gtest/gtest.h>

#include <vector>

#include "data/files/sha256.h"

namespace flash::sysid {
namespace {

TEST(Shard, OfAListEachTakesAsManyAsTheOthersOrOneMore) {
  for (const int count : {1, 2, 3, 7}) {
    std::vector<int> taken(static_cast<std::size_t>(count));
    for (std::size_t place = 0; place < 23; ++place)
      ++taken[static_cast<std::size_t>(owner_of(place, data::sha256("first"), count))];
    for (const int each : taken) {
      EXPECT_GE(each, 23 / count);
      EXPECT_LE(each, 23 / count + 1);
    }
  }
}

TEST(Shard, ListsOfOneMotionBeginAtUnlikeShares) {
  // 700 draws of seven even ones: a share has 100, a standard deviation of 9.3. Five of them are 46.
  std::vector<int> taken(7);
  for (int i = 0; i < 700; ++i)
    ++taken[static_cast<std::size_t>(owner_of(0, data::sha256(std::to_string(i)), 7))];
  for (const int each : taken) EXPECT_NEAR(each, 100, 46);
}

}  // namespace
}  // namespace flash::sysid
