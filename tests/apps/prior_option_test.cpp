#include "apps/prior_option.h"

#include <gtest/gtest.h>

#include "tests/data/temporary_folder.h"

namespace flash {
namespace {

TEST(PriorOption, IsAValueWithAFactorOrADifference) {
  const sysid::Prior bending = parse_prior("bending=1e-5:2");
  EXPECT_EQ(bending.name, "bending");
  EXPECT_EQ(bending.value, 1e-5);
  EXPECT_EQ(bending.spread, 2);
  EXPECT_EQ(parse_prior("start_yaw=-0.1:0.05").spread, 0.05);
}

TEST(PriorOption, IsRefusedByItsName) {
  const auto message = [](const std::string& text) {
    return data::input_error_of([&] { parse_prior(text); });
  };
  EXPECT_EQ(message("bending=1e-5"),
            "--prior: \"bending=1e-5\": expected name=value:factor, as bending=1e-5:2");
  EXPECT_EQ(message("bending=1e-5:1"),
            "--prior: \"bending=1e-5:1\": found the spread 1, expected a factor above 1");
  EXPECT_EQ(message("start_yaw=-0.1:x"),
            "--prior: \"start_yaw=-0.1:x\": found the spread x, expected a number above 0");
  EXPECT_EQ(message("bendin=1e-5:2"), "--prior bendin: unknown parameter (did you mean \"bending\"?)");
}

}  // namespace
}  // namespace flash
