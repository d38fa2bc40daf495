#include "data/asset/asset_units.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "tests/data/temporary_folder.h"

namespace flash::data {
namespace {

using nlohmann::json;

const char* const kTowel = R"({"schema": "flash-asset/1", "mesh": "sheet:0.5x0.4:0.1",
  "mechanical_props": {"areal_density": 0.2, "young": 3e4, "poisson": 0.25, "constitutive": "TRI_COROTATED",
  "thickness": 1e-3, "friction": 0.4}})";

json saved(const Asset& asset, const TemporaryFolder& folder) {
  save_asset(asset, folder / "saved.json");
  return json::parse(read_file(folder / "saved.json"));
}

/// What the towel with these units is refused for; empty where it is read.
std::string refusal(const char* units, const TemporaryFolder& folder) {
  json file = json::parse(kTowel);
  file["identification"]["units"] = json::parse(units);
  try {
    load_asset(folder.write("towel.json", file.dump()));
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(AssetUnits, OfEveryNumberAreWritten) {
  const TemporaryFolder folder;
  const json file = saved(load_asset(folder.write("towel.json", kTowel)), folder);
  const json& units = file["identification"]["units"];
  for (const char* part : {"mechanical_props", "transformation"})
    for (const auto& [name, value] : file[part].items())
      EXPECT_EQ(units.contains(name), !value.is_string()) << name;
  EXPECT_EQ(units["areal_density"], "kg/m^2");
  EXPECT_EQ(units["rotation"], "deg");
}

TEST(AssetUnits, YoungIsInPascalBesideAThicknessAlone) {
  const TemporaryFolder folder;
  Asset asset = load_asset(folder.write("towel.json", kTowel));
  EXPECT_EQ(saved(asset, folder)["identification"]["units"]["young"], "Pa");
  asset.thickness.reset();
  asset.bending_rigidity = 1e-5;
  EXPECT_EQ(saved(asset, folder)["identification"]["units"]["young"], "N/m");
}

TEST(AssetUnits, OfWhatWasIdentifiedAreThereToo) {
  const TemporaryFolder folder;
  Asset asset = load_asset(folder.write("towel.json", kTowel));
  asset.identification = R"({"estimate": {"bending": 1e-5}})";
  EXPECT_EQ(saved(asset, folder)["identification"]["units"]["bending"], "N m");
}

// They are of the file: what is read is as if they were not there, and so is a file without them.
TEST(AssetUnits, AreNoPartOfWhatIsRead) {
  const TemporaryFolder folder;
  Asset asset = load_asset(folder.write("towel.json", kTowel));
  saved(asset, folder);
  EXPECT_EQ(load_asset(folder / "saved.json").identification, "");
  asset.identification = R"({"score_m":0.005})";
  saved(asset, folder);
  EXPECT_EQ(load_asset(folder / "saved.json").identification, asset.identification);
}

// Readers from before the units take `identification` whole, whatever it holds.
TEST(AssetUnits, StandWhereEarlierReadersPassThemBy) {
  const TemporaryFolder folder;
  json file = saved(load_asset(folder.write("towel.json", kTowel)), folder);
  file.erase("identification");
  for (const auto& [name, value] : file.items())
    EXPECT_TRUE(name == "schema" || name == "mesh" || name == "element_type" || name == "transformation" ||
                name == "mechanical_props")
        << name;
}

TEST(AssetUnits, ThatAreWrongOrOfNothingAreRefusedByName) {
  const TemporaryFolder folder;
  EXPECT_EQ(refusal(R"({"young": "Pa", "areal_density": "kg/m^2"})", folder), "");
  EXPECT_NE(refusal(R"({"areal_density": "g/m^2"})", folder)
                .find("towel.json: identification.units.areal_density: found \"g/m^2\", expected \"kg/m^2\""),
            std::string::npos)
      << refusal(R"({"areal_density": "g/m^2"})", folder);
  EXPECT_NE(refusal(R"({"young": "N/m"})", folder).find("expected \"Pa\", in which young is read beside a"),
            std::string::npos);
  EXPECT_NE(refusal(R"({"yuong": "Pa"})", folder).find("units.yuong: found \"Pa\", expected a number"),
            std::string::npos)
      << refusal(R"({"yuong": "Pa"})", folder);
  EXPECT_NE(refusal(R"(["Pa"])", folder).find("identification.units"), std::string::npos);
  EXPECT_NE(refusal(R"({"young": 3})", folder), "");
}

}  // namespace
}  // namespace flash::data
