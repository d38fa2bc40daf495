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
            "areal density found 150 kg/m^2, usually 0.01 to 20 (150 g/m^2 are 0.15)");
  EXPECT_EQ(question({{"areal_density", 0.008}}), "areal density found 0.008 kg/m^2, usually 0.01 to 20");
  EXPECT_EQ(
      question({{"young", 50}, {"bending_rigidity", 1e-9}}),
      "young with a thickness found 50 Pa, usually 1000 to 1e+12 (E t in N/m has no thickness beside it)");
  EXPECT_EQ(
      question({{"young", 1e9}}, false),
      "young without a thickness found 1e+09 N/m, usually 0.1 to 1e+05 (E in Pa needs a thickness; steps of "
      "stiffer sheets take long)");
  EXPECT_EQ(question({{"young", 50}}, false), "");
  EXPECT_EQ(question({{"areal_density", 150}, {"young", 50}, {"bending_rigidity", 1e-9}}),
            "areal density found 150 kg/m^2, usually 0.01 to 20 (150 g/m^2 are 0.15); young with a thickness "
            "found 50 Pa, usually 1000 to 1e+12 (E t in N/m has no thickness beside it)");
  // From tissue paper to a rubber mat.
  EXPECT_EQ(question({{"areal_density", 0.015}, {"young", 1e9}, {"thickness", 5e-5}}), "");
  EXPECT_EQ(
      question({{"areal_density", 6.5}, {"young", 5e6}, {"thickness", 5e-3}, {"bending_rigidity", 0.05}}),
      "");
  // A sheet of steel.
  EXPECT_EQ(
      question({{"areal_density", 7.8}, {"young", 2.1e11}, {"bending_rigidity", 18}}),
      "E t found 2.1e+08 N/m, usually 0 to 1e+05 of cloth (paper and plates have more; their steps take "
      "long)");
}

// A woven cloth bends a hundred times less than its membrane would; a thousand times is another unit.
TEST(QuestionedNumbers, BendingIsHeldAgainstThatOfAPlate) {
  const TemporaryFolder folder;
  const auto is_questioned = [&](double bending) {
    json asset = json::parse(R"({"schema": "flash-asset/1", "mesh": "sheet:0.5x0.4:0.1", "mechanical_props": {
      "areal_density": 0.2, "young": 5e4, "poisson": 0, "constitutive": "TRI_COROTATED", "thickness": 1e-3}})");
    asset["mechanical_props"]["bending_rigidity"] = bending;
    for (const std::string& notice :
         resolve_sheet(load_asset(folder.write("towel.json", asset.dump())), 0.2).notices)
      if (notice.find("about that of a plate of this young and thickness") != std::string::npos) return true;
    return false;
  };
  const double plate = 5e4 * 1e-9 / 12;
  EXPECT_FALSE(is_questioned(0.99e3 * plate));
  EXPECT_TRUE(is_questioned(1.01e3 * plate));
  EXPECT_FALSE(is_questioned(1.01e-3 * plate));
  EXPECT_TRUE(is_questioned(0.99e-3 * plate));
  EXPECT_FALSE(is_questioned(0));  // a membrane
}

}  // namespace
}  // namespace flash::data
