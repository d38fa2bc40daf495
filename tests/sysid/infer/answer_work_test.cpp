#include "sysid/infer/answer_work.h"

#include <gtest/gtest.h>

namespace flash::sysid {
namespace {

TEST(AnswerMeter, CountsWhatIsDoneAndWhatThereIsAtMost) {
  AnswerMeter meter({.motions = 4, .scores = 100});
  meter.take({.motions = 1, .scores = 10}, {.motions = 2, .scores = 80});
  meter.take({}, {.motions = -1});  // needed beside it
  EXPECT_EQ(meter.done().motions, 1);
  EXPECT_EQ(meter.done().scores, 10);
  EXPECT_EQ(meter.most().motions, 3);
  EXPECT_EQ(meter.most().scores, 20);
}

}  // namespace
}  // namespace flash::sysid
