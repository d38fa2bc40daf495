#include "sysid/observe/registration_parameter.h"

#include <gtest/gtest.h>

namespace flash::sysid {
namespace {

TEST(RegistrationParameter, BoundsAreNamedWithValueAndField) {
  data::NuisanceBounds bounds;
  bounds.offset = {0.06, 0.07, 0.08};
  bounds.yaw = 0.26;
  bounds.time = 0.2;
  std::vector<std::string> texts;
  for (const RegistrationParameter& parameter : registration_parameters)
    texts.push_back(at_bound_text(parameter, bounds));
  EXPECT_EQ(texts[2], "offset z is at its bound of 0.08 m; widen nuisance.offset_m in recording.json");
  EXPECT_EQ(texts[3],
            "yaw is at its bound of 0.26 rad; widen nuisance.yaw_rad in recording.json, or mend the "
            "heading with which the sheet starts (--heading of import)");
  EXPECT_EQ(texts[4], "clock is at its bound of 0.2 s; widen nuisance.time_s in recording.json");
  EXPECT_TRUE(is_at_bound({"yaw", "offset_z"}, registration_parameters[2]));
  EXPECT_FALSE(is_at_bound({"yaw", "offset_z"}, registration_parameters[4]));
}

}  // namespace
}  // namespace flash::sysid
