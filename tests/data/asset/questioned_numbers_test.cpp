#include "data/asset/questioned_numbers.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/data/temporary_folder.h"

namespace flash::data {
namespace {

using nlohmann::json;

TEST(QuestionedNumbers, OfOtherUnitsAreOneNotice) {
  const TemporaryFolder folder;
  const auto question = [&](const json& changes, bool thick = true) {
    json asset = json::parse(R"({"schema": "flash-asset/1", "mesh": "sheet:0.5x0.4:0.1", "mechanical_props": {
      "areal_density": 0.2, "young": 5e4, "poisson": 0.25, "constitutive": "TRI_COROTATED", "thickness": 1e-3,
      "bending_rigidity": 1e-4}})");
    json& props = asset["mechanical_props"];
    props.update(changes);
    if (!thick) props.erase("thickness");
    std::string text;
    for (const std::string& notice :
         resolve_sheet(load_asset(folder.write("towel.json", asset.dump())), 0.2).notices)
      if (notice.find("is the unit right?") != std::string::npos)
        text += notice.substr(notice.find("? ") + 2);
    return text;
  };
  EXPECT_EQ(question(json::object()), "");
  EXPECT_EQ(question({{"areal_density", 150}}),
            "areal density found 150 kg/m^2, usually 0.005 to 20 (150 g/m^2 are 0.15)");
  EXPECT_EQ(
      question({{"young", 50}}),
      "young with a thickness found 50 Pa, usually 1000 to 1e+12 (E t in N/m has no thickness beside it)");
  EXPECT_EQ(question({{"young", 1e9}}, false),
            "young without a thickness found 1e+09 N/m, usually 0.1 to 1e+08 (E in Pa needs a thickness)");
  EXPECT_EQ(question({{"young", 50}}, false), "");
  EXPECT_EQ(
      question({{"areal_density", 150}, {"young", 50}}),
      "areal density found 150 kg/m^2, usually 0.005 to 20 (150 g/m^2 are 0.15); young with a thickness "
      "found 50 Pa, usually 1000 to 1e+12 (E t in N/m has no thickness beside it)");
  // From tissue paper to a sheet of steel.
  EXPECT_EQ(question({{"areal_density", 0.015}, {"young", 1e9}}), "");
  EXPECT_EQ(question({{"areal_density", 7.8}, {"young", 2.1e11}}), "");
}

}  // namespace
}  // namespace flash::data
