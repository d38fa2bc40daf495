#include "sysid/infer/agreement.h"

#include <gtest/gtest.h>

namespace flash::sysid {
namespace {

std::vector<Axis> bending_and_young() {
  return {{"young", {10, 100, 1000}, true}, {"bending", {1e-5, 1e-4, 1e-3}, true}};
}

// Percentage points of chi-square (Abramowitz and Stegun, table 26.8).
TEST(Agreement, ChanceIsThatOfTheTables) {
  EXPECT_NEAR(chance_beyond(3.84146, 1), 0.05, 1e-6);
  EXPECT_NEAR(chance_beyond(9.21034, 2), 0.01, 1e-6);
  EXPECT_NEAR(chance_beyond(16.2662, 3), 0.001, 1e-6);
  EXPECT_NEAR(chance_beyond(18.3070, 10), 0.05, 1e-5);
  EXPECT_EQ(chance_beyond(0, 3), 1);
}

TEST(Agreement, NamesTheParameterThatIsFarthestApartForWhatIsKnownOfIt) {
  // Young is farther apart, and less known.
  const Agreement agreement{30, 3e-7, {{10, 1e-4}, {200, 3e-4}}, {{2.5, 0.1}, {2.5, 0.1}}};
  const std::string text = contradiction_text(agreement, bending_and_young(), {"lift", "fold"});
  EXPECT_NE(text.find("lift asks for bending 0.0001, fold asks for bending 0.0003"), std::string::npos)
      << text;
  EXPECT_NE(text.find("once in 1,000,000 times or less"), std::string::npos) << text;
}

TEST(Agreement, ValuesAtAnEndAreBounds) {
  const Agreement agreement{30, 1e-4, {{100, 1e-5}, {100, 1e-3}}, {{1, 0.1}, {1, 0.1}}};
  const std::string text = contradiction_text(agreement, bending_and_young(), {"lift", "fold"});
  EXPECT_NE(text.find("lift asks for bending at most 1e-05, fold asks for bending at least 0.001"),
            std::string::npos)
      << text;
}

TEST(Agreement, SaysThatTheEstimateIsNotTheLikeliest) {
  Agreement agreement{1, 0.6, {{10, 1e-4}, {20, 1.2e-4}}, {{1, 0.1}, {1, 0.1}}, {15, 1.1e-4}, 9.5};
  const std::string text = better_text(agreement, bending_and_young());
  EXPECT_NE(text.find("young 15, bending 0.00011 is likelier"), std::string::npos) << text;
  agreement.estimate_excess = 8.5;
  EXPECT_EQ(better_text(agreement, bending_and_young()), "");
  agreement.estimate_excess = 9.5;
  agreement.chance = 1e-3;  // there is no such thing as one likeliest
  EXPECT_EQ(better_text(agreement, bending_and_young()), "");
}

TEST(Agreement, IsNoContradictionWhereChanceExplainsIt) {
  const Agreement agreement{5, 0.0101, {{10, 1e-4}, {20, 2e-4}}, {{1, 0.1}, {1, 0.1}}};
  EXPECT_EQ(contradiction_text(agreement, bending_and_young(), {"lift", "fold"}), "");
}

}  // namespace
}  // namespace flash::sysid
