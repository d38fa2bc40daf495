#include "sysid/report/settings_texts.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/sysid/short_lift.h"

namespace flash::sysid {
namespace {

using Lines = std::vector<std::string>;

TEST(SettingsTexts, OfTheSearchBehindAnAssetWhatDiffersIsNamed) {
  const data::TemporaryFolder folder;
  Replay replay = short_lift(folder);
  GridSettings grid;
  grid.base.material = short_lift_material();
  const auto searched = settings_texts({replay}, grid);
  data::Asset asset;
  EXPECT_EQ(unlike_the_search(asset, searched, {}), Lines{});  // of no search
  nlohmann::json identification = {{"solver", searched},
                                   {"estimate", {{"start_yaw", 0.02}, {"bending", 1e-4}}},
                                   {"fixed", {{"table_height", {{"value", 0.01}, {"source", "assumed"}}}}}};
  asset.identification = identification.dump();
  const Axis yaw = parse_axis("start_yaw", "0.02"), height = parse_axis("table_height", "0.01");
  EXPECT_EQ(unlike_the_search(asset, searched, {yaw, height}), Lines{});
  EXPECT_EQ(unlike_the_search(asset, searched, {height}),
            Lines{"--hold start_yaw: found none, the search behind the asset had 0.02"});

  replay.settings.grasp_within = 0.02;
  replay.settings.solver.time_step /= 2;
  const Lines lines = unlike_the_search(asset, settings_texts({replay}, grid), {yaw, height});
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_EQ(lines[0], "--grasp-within: found 20 mm, the search behind the asset had as recorded");
  EXPECT_EQ(lines[1].find("--time-step: found "), 0u);

  // So do the keyframes that counted. Of an earlier program's asset they are not known.
  Replay later = replay;
  later.settings = short_lift(folder).settings;
  later.settings.score_from = 0.1;
  const Lines window = unlike_the_search(asset, settings_texts({later}, grid), {yaw, height});
  EXPECT_EQ(window, Lines{"--from: found 0.1, the search behind the asset had none"});
  data::Asset earlier = asset;
  identification["solver"].erase("min_points");
  earlier.identification = identification.dump();
  EXPECT_EQ(unlike_the_search(earlier, settings_texts({later}, grid), {yaw, height}), Lines{});

  // A mesh of the same object counts, one of another object does not.
  auto other = searched;
  other["mesh"] = "sheet:1x1:0.5 (9 vertices)";
  EXPECT_EQ(unlike_the_search(asset, other, {yaw, height}).size(), 1u);
  other["object_mesh"] = "sheet:1x1:0.1:alternating";
  EXPECT_EQ(unlike_the_search(asset, other, {yaw, height}), Lines{});
}

TEST(SettingsTexts, AnotherAuthorsIdentificationIsNoSearch) {
  data::Asset asset;
  for (const char* text :
       {"{}", "{\"solver\": \"mine\"}", "{\"solver\": {}, \"estimate\": null, \"fixed\": 3}"}) {
    asset.identification = text;
    EXPECT_NO_THROW(unlike_the_search(asset, {}, {})) << text;
    EXPECT_EQ(unlike_the_search(asset, {}, {}), Lines{}) << text;
  }
}

}  // namespace
}  // namespace flash::sysid
