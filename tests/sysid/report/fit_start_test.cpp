#include "sysid/report/fit_start.h"

#include <gtest/gtest.h>

#include "tests/data/temporary_folder.h"
#include "tests/sysid/summary_fixture.h"

namespace flash::sysid {
namespace {

SearchFolder example_search() {
  SearchFolder search{example_summary(), {}};
  search.results.axes = {parse_axis("poisson", "0,0.2,0.4"), parse_axis("bending", "1e-5:1e-3:3:log"),
                         parse_axis("air_drag", "0.5")};
  search.summary.best["air_drag"] = 0.5;
  return search;
}

std::vector<std::string> names_of(const std::vector<Axis>& axes) {
  std::vector<std::string> names;
  for (const Axis& axis : axes) names.push_back(axis.name);
  return names;
}

using Names = std::vector<std::string>;

TEST(FitStart, IsTheEstimateAndWhatIsLikelyAboutIt) {
  const FitStart start = fit_start(example_search(), {});
  EXPECT_EQ(names_of(start.grid.axes), (Names{"poisson", "bending", "air_drag"}));
  EXPECT_EQ(start.values, (std::vector<double>{0.2, 1.1e-4, 0.5}));
  // What stays open, an interval, and a value that the search held.
  EXPECT_EQ(start.around, (Extent{{0, 0.4}, {8e-5, 1.5e-4}, {0.5, 0.5}}));
  // Measured: it stays so. The areal density was assumed: it is the asset's.
  ASSERT_EQ(names_of(start.grid.fixed), Names{"friction"});
  EXPECT_EQ(start.grid.fixed[0].values, std::vector<double>{0.3});
}

TEST(FitStart, ANameIsHeldWhereTheSearchHasIt) {
  const FitStart start = fit_start(example_search(), {"poisson", "air_drag", "friction=0.4"});
  EXPECT_EQ(names_of(start.grid.axes), (Names{"bending", "poisson", "air_drag", "friction"}));
  EXPECT_EQ(start.values, (std::vector<double>{1.1e-4, 0.2, 0.5, 0.4}));
  EXPECT_TRUE(start.grid.fixed.empty());  // the measurement gave way to an assumption of the command line
  SearchFolder stated = example_search();
  stated.summary.fixed["friction"].deviation = 0.02;
  EXPECT_EQ(fit_start(stated, {"friction"}).grid.deviations.at("friction"), 0.02);
  EXPECT_EQ(names_of(fit_start(stated, {"friction"}).grid.fixed), Names{"friction"});
}

TEST(FitStart, NamesWhatCannotBeHeld) {
  const SearchFolder search = example_search();
  const auto message = [&](const Names& held) {
    return data::input_error_of([&] { fit_start(search, held); });
  };
  EXPECT_NE(message({"start_yaw"}).find("--hold start_yaw: the search neither found nor held it"),
            std::string::npos);
  EXPECT_NE(message({"poisson", "poisson=0.3"}).find("--hold poisson: given twice"), std::string::npos);
  EXPECT_NE(message({"poisson", "bending"}).find("--hold: no parameter is left"), std::string::npos);
}

}  // namespace
}  // namespace flash::sysid
