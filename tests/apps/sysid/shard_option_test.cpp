#include "apps/sysid/shard_option.h"

#include <gtest/gtest.h>

#include <map>
#include <string>

#include "data/files/error.h"

namespace flash {
namespace {

/// What Slurm sets for a task.
sysid::Shard of_task(const std::map<std::string, std::string>& variables) {
  return parse_shard("slurm", [&](const char* name) -> const char* {
    const auto found = variables.find(name);
    return found == variables.end() ? nullptr : found->second.c_str();
  });
}

TEST(ShardOption, IsCountedFromOne) {
  const sysid::Shard shard = parse_shard("2/3");
  EXPECT_EQ(shard.index, 1);
  EXPECT_EQ(shard.count, 3);
  EXPECT_EQ(parse_shard("1/1").count, 1);
}

TEST(ShardOption, OfAJobArrayIsItsTask) {
  const sysid::Shard shard = of_task(
      {{"SLURM_ARRAY_TASK_ID", "12"}, {"SLURM_ARRAY_TASK_MIN", "10"}, {"SLURM_ARRAY_TASK_COUNT", "4"}});
  EXPECT_EQ(shard.index, 2);
  EXPECT_EQ(shard.count, 4);
}

TEST(ShardOption, RefusesWhatIsNoShare) {
  for (const char* text : {"", "2", "0/3", "4/3", "a/3", "1/0", "1/2/3", "-1/3", "1.5/3", "1/999999999"})
    EXPECT_THROW(parse_shard(text), data::InputError) << text;
  EXPECT_THROW(of_task({}), data::InputError);
  EXPECT_THROW(of_task({{"SLURM_ARRAY_TASK_ID", "3"},  // begun again by itself
                        {"SLURM_ARRAY_TASK_MIN", "3"},
                        {"SLURM_ARRAY_TASK_COUNT", "1"}}),
               data::InputError);
  EXPECT_THROW(of_task({{"SLURM_ARRAY_TASK_ID", "9"},  // of tasks 0,9: their numbers have a gap
                        {"SLURM_ARRAY_TASK_MIN", "0"},
                        {"SLURM_ARRAY_TASK_COUNT", "2"}}),
               data::InputError);
}

TEST(ShardOption, TheFirstHasTheFolderOfTheSearch) {
  EXPECT_EQ(folder_of_shard("run", parse_shard("1/3")), "run");
  EXPECT_EQ(folder_of_shard("run", parse_shard("3/3")), "run/shards/3");
}

}  // namespace
}  // namespace flash
