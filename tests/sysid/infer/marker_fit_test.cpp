#include "sysid/infer/marker_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/sysid/tracked_beam.h"

namespace flash::sysid {
namespace {

TEST(MarkerFit, NoiseAlonePassesItsBoundOnceInTwenty) {
  std::mt19937_64 engine(30);
  std::normal_distribution<double> normal(0, 2e-4);
  for (const int sightings : {1, 6, 50}) {
    MarkerFit fit{sightings, 0, 1, 2e-4};
    int passed = 0;
    constexpr int trials = 20000;
    for (int trial = 0; trial < trials; ++trial) {
      double squares = 0;
      for (int i = 0; i < 3 * sightings; ++i) squares += std::pow(normal(engine), 2);
      fit.miss = std::sqrt(squares / sightings);
      passed += !fit.follows();
    }
    // Three standard deviations of the count, and Wilson and Hilferty's own error.
    EXPECT_NEAR(passed / double(trials), 0.05, 3 * std::sqrt(0.05 * 0.95 / trials) + 1e-3) << sightings;
  }
}

TEST(MarkerFit, SaysWhenAMotionIsNotExplained) {
  const MarkerFit upside_down{6, 0.0124, 0.0062, 1e-3}, good{6, 2e-4, 0.0062, 1e-3},
      strict{6, 2e-4, 0.0062, 1e-5}, still{6, 4e-4, 5e-4, 1e-3}, noisy{3000, 1.732e-3, 1.80e-3, 1e-3};
  EXPECT_TRUE(upside_down.explains_nothing());
  EXPECT_FALSE(upside_down.follows());
  EXPECT_TRUE(good.follows() && !good.explains_nothing());
  EXPECT_TRUE(!strict.follows() && !strict.explains_nothing());
  EXPECT_TRUE(still.explains_nothing());   // half a millimetre under noise of one
  EXPECT_FALSE(noisy.explains_nothing());  // half a millimetre too, seen three thousand times
}

TEST(MarkerFit, IsTheDistanceToWhereMarkersAreSimulated) {
  const data::TemporaryFolder folder;
  ReplaySettings settings;
  settings.solver.time_step = 1;
  const data::Recording recording = tracked_beam(folder, {0, 4, 4.5}, 0, 1, settings, beam_material(2.5e5));
  const Replay replay = make_replay(recording, settings);
  const auto fit_of = [&](double young) {
    Motion motion;
    run(replay, {{{}, {}, beam_material(young)}}, scored_steps(replay),
        [&](std::size_t, ReplayResult result) { motion = std::move(result.motion); });
    return *marker_fit_of(replay, motion, {}, 1e-3);
  };
  const MarkerFit truth = fit_of(2.5e5), soft = fit_of(1.25e5);
  EXPECT_EQ(truth.sightings, 12);
  EXPECT_LT(truth.miss, 2e-6);  // six digits of the file
  EXPECT_GT(truth.motion, 2e-3);
  // Twice as soft sags twice as far, to a few per cent.
  EXPECT_NEAR(soft.miss, truth.motion, 0.1 * truth.motion);
}

}  // namespace
}  // namespace flash::sysid
