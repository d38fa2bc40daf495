#include "sysid/infer/answer_work.h"

#include <gtest/gtest.h>

namespace flash::sysid {
namespace {

TEST(AnswerMeter, TakesTheTimeOfWhatIsLeftFromThatOfItsKind) {
  AnswerMeter meter({.motions = 4, .scores = 100});
  EXPECT_EQ(meter.seconds_left(), 0);  // nothing is known
  meter.take({.motions = 1, .scores = 0}, {}, 6);
  EXPECT_EQ(meter.seconds_left(), 3 * 6);
  meter.take({.motions = 0, .scores = 10}, {}, 5);
  EXPECT_EQ(meter.seconds_left(), 3 * 6 + 90 * 0.5);
  meter.take({}, {.motions = 3, .scores = 80}, 0);
  EXPECT_EQ(meter.seconds_left(), 10 * 0.5);
  EXPECT_EQ(meter.most().scores, 20);
}

}  // namespace
}  // namespace flash::sysid
