#include "data/machine/memory_limit.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

namespace flash::data {
namespace {

TEST(MemoryLimit, IsTheLeastOfMachineAndProcess) {
  const double before = memory_limit();
  rlimit given{};
  ASSERT_EQ(getrlimit(RLIMIT_AS, &given), 0);
  rlimit less = given;
  less.rlim_cur = rlim_t{1} << 45;  // more than this test could take, sanitizers included
  ASSERT_EQ(setrlimit(RLIMIT_AS, &less), 0);
  EXPECT_LE(memory_limit(), static_cast<double>(less.rlim_cur));
  EXPECT_GT(memory_limit(), 0);
  ASSERT_EQ(setrlimit(RLIMIT_AS, &given), 0);
  EXPECT_EQ(memory_limit(), before);
}

}  // namespace
}  // namespace flash::data
