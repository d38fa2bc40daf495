// Size of the target and focal length of the camera, of pairs of poses.
#include "calib/calibrate/pair_scales.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/calib/pairs_of_scene.h"
#include "tests/data/temporary_folder.h"

namespace flash::calib {
namespace {

using Mount = calib::Setup;  // testing::Test has a private member of the name Setup

TEST(PairScales, OfATargetOfAnotherSizeAreToldItAndSolvedForIt) {
  for (const Mount setup : {Mount::eye_in_hand, Mount::eye_to_hand})
    for (const double size : {1.2, 0.9, 1.05}) {
      const HandEyeScene scene = noisy_scene(setup, 0.5, 0.5, 21);
      std::vector<Observation> pairs = pairs_of(scene);
      for (Observation& pair : pairs) pair.T_camera_target.front().translation() /= size;
      const Calibration stated = calibrate_pairs(setup, pairs);
      EXPECT_TRUE(!stated.usable || within_999(stated, scene)) << size;
      EXPECT_EQ(stated.warnings.front().substr(0, 14), "the target is ") << stated.warnings.front();
      ASSERT_TRUE(stated.size && stated.size->wanted);
      EXPECT_LT(std::abs(stated.size->wanted->estimate - size), 4 * stated.size->wanted->sd) << size;
      CalibrateSettings kept;
      kept.size_as_stated = true;
      EXPECT_TRUE(calibrate_pairs(setup, pairs, kept).usable) << size;
      CalibrateSettings unknown;
      unknown.target_size_sd = std::numeric_limits<double>::infinity();
      const Calibration solved = calibrate_pairs(setup, pairs, unknown);
      EXPECT_TRUE(solved.usable) << size;
      EXPECT_FALSE(tells_of_size(solved)) << size;
      EXPECT_TRUE(within_999(solved, scene)) << size;
    }
}

// Where the size is solved for, what was stated is no reason to refuse, unless it is that of another unit.
TEST(PairScales, OfATargetOfAnySizeAreSolvedForIt) {
  for (const Mount setup : {Mount::eye_in_hand, Mount::eye_to_hand})
    for (const double size : {0.1, 0.45, 3.0, 1000.0}) {
      const HandEyeScene scene = noisy_scene(setup, 0.5, 0.5, 21);
      std::vector<Observation> pairs = pairs_of(scene);
      for (Observation& pair : pairs) pair.T_camera_target.front().translation() /= size;
      const std::string said = data::input_error_of([&] { calibrate_pairs(setup, pairs); });
      EXPECT_EQ(said.substr(0, 4), size > 20 ? "tran" : "the ") << size << said;
      CalibrateSettings unknown;
      unknown.target_size_sd = std::numeric_limits<double>::infinity();
      if (size > 20) {
        EXPECT_EQ(data::input_error_of([&] { calibrate_pairs(setup, pairs, unknown); }), said);
        continue;
      }
      const Calibration solved = calibrate_pairs(setup, pairs, unknown);
      EXPECT_TRUE(solved.usable) << size;
      EXPECT_EQ(solved.used.size(), pairs.size()) << size;
      EXPECT_LT(std::abs(solved.size->estimate - size), 4 * solved.size->sd) << size;
      EXPECT_TRUE(within_999(solved, scene)) << size;
      // Poses stay as they were given.
      EXPECT_NEAR((solved.selection.observations[3].T_camera_target.front().translation() -
                   pairs[3].T_camera_target.front().translation())
                          .norm() /
                      pairs[3].T_camera_target.front().translation().norm(),
                  0, 1e-12);
    }
}

// So few do not tell their noise and a size together.
TEST(PairScales, OfWhichThereAreFewAreToldOfASizeThatClosesThem) {
  const HandEyeScene scene = noisy_scene(Mount::eye_in_hand, 0.1, 0.1, 21);
  std::vector<Observation> pairs = pairs_of(scene);
  pairs.resize(6);
  EXPECT_FALSE(tells_of_size(calibrate_pairs(Mount::eye_in_hand, pairs)));
  for (Observation& pair : pairs) pair.T_camera_target.front().translation() /= 0.8;
  const Calibration result = calibrate_pairs(Mount::eye_in_hand, pairs);
  EXPECT_TRUE(tells_of_size(result));
  EXPECT_FALSE(result.usable);
}

// Prints are off by a percent or two.
TEST(PairScales, OfATargetOfNearlyTheSizeStatedAreAnsweredForTheSizeThatTheyTell) {
  for (const Mount setup : {Mount::eye_in_hand, Mount::eye_to_hand})
    for (const double size : {0.98, 0.99, 1.0, 1.01, 1.02})
      for (const unsigned seed : {21U, 22U, 23U}) {
        const HandEyeScene scene = noisy_scene(setup, 0.5, 0.5, seed);
        std::vector<Observation> pairs = pairs_of(scene);
        for (Observation& pair : pairs) pair.T_camera_target.front().translation() /= size;
        const Calibration result = calibrate_pairs(setup, pairs);
        EXPECT_TRUE(result.usable && within_999(result, scene)) << size << ' ' << seed;
        EXPECT_LT(std::abs(result.size->estimate - size), 4 * result.size->sd) << size << ' ' << seed;
      }
}

TEST(PairScales, OfALensThatIsOffAreAnsweredForTheFocalLengthThatTheyTell) {
  for (const Mount setup : {Mount::eye_in_hand, Mount::eye_to_hand})
    for (const double too_long : {0.97, 0.99, 1.0, 1.01, 1.03})
      for (const unsigned seed : {21U, 22U, 23U}) {
        const HandEyeScene scene = noisy_scene(setup, 0.1, 0, seed);
        const std::vector<Observation> pairs = pairs_of_lens(scene, too_long);
        const Calibration result = calibrate_pairs(setup, pairs);
        EXPECT_TRUE(result.usable && within_999(result, scene)) << too_long << ' ' << seed;
        ASSERT_TRUE(result.focal_length && result.focal_length->wanted);
        EXPECT_LT(std::abs(result.focal_length->estimate - 1 / too_long), 4 * result.focal_length->sd)
            << too_long << ' ' << seed;
        EXPECT_EQ(tells_of_lens(result), std::abs(too_long - 1) > 0.015) << too_long << ' ' << seed;
        CalibrateSettings kept;
        kept.lens = LensKnowledge::stated;
        const Calibration by_stated = calibrate_pairs(setup, pairs, kept);
        EXPECT_EQ(by_stated.focal_length.has_value(), tells_of_lens(by_stated));
        EXPECT_EQ(tells_of_lens(by_stated), too_long != 1) << too_long << ' ' << seed;
      }
}

// What --lens stated and --for two-arms keep is examined all the same.
TEST(PairScales, AFocalLengthThatIsKeptAgainstThePairsIsTold) {
  for (const Mount setup : {Mount::eye_in_hand, Mount::eye_to_hand}) {
    const HandEyeScene scene = noisy_scene(setup, 0.1, 0, 21);
    const std::vector<Observation> pairs = pairs_of_lens(scene, 1.03);
    CalibrateSettings stated, arms;
    stated.lens = LensKnowledge::stated;
    arms.use = Use::two_arms;
    const Calibration by_stated = calibrate_pairs(setup, pairs, stated),
                      for_arms = calibrate_pairs(setup, pairs, arms);
    EXPECT_TRUE(tells_of_lens(by_stated));
    EXPECT_FALSE(by_stated.usable && !within_999(by_stated, scene));
    EXPECT_TRUE(tells_of_lens(for_arms));
    EXPECT_TRUE(for_arms.usable && within_999(for_arms, scene));
    ASSERT_TRUE(for_arms.focal_length);
    EXPECT_EQ(for_arms.focal_length->estimate, 1);
    // Where it is right, what it may be off counts for the camera.
    const std::vector<Observation> right = pairs_of_lens(scene, 1);
    EXPECT_FALSE(tells_of_lens(calibrate_pairs(setup, right, arms)));
    EXPECT_GT(calibrate_pairs(setup, right, arms).covariance.trace(),
              calibrate_pairs(setup, right, stated).covariance.trace());
  }
}

// Of few pairs, too, an answer is for what they tell, or its deviations hold it.
TEST(PairScales, OfFewPairsAreWithinWhatIsStated) {
  struct Case {
    double size, too_long;
    LensKnowledge lens;
    bool size_as_stated;
  };
  const auto near = LensKnowledge::near, unknown = LensKnowledge::unknown;
  for (const std::size_t count : {std::size_t{5}, std::size_t{7}})
    for (const Case& c :
         {Case{1, 1, near, false}, Case{1.1, 1, near, false}, Case{0.9, 1, near, false},
          Case{1.1, 1, near, true}, Case{1, 1.03, unknown, false}, Case{1, 1, unknown, false}}) {
      int answered = 0, inside = 0, told = 0;
      for (unsigned seed = 41; seed < 51; ++seed) {
        const Mount setup = seed % 2 ? Mount::eye_in_hand : Mount::eye_to_hand;
        const HandEyeScene scene = noisy_scene(setup, 0.3, 0, seed);
        std::vector<Observation> pairs = pairs_of_lens(scene, c.too_long);
        pairs.resize(count);
        for (Observation& pair : pairs) pair.T_camera_target.front().translation() /= c.size;
        CalibrateSettings settings;
        settings.lens = c.lens;
        settings.size_as_stated = c.size_as_stated;
        try {
          const Calibration result = calibrate_pairs(setup, pairs, settings);
          ++answered;
          inside += within_999(result, scene);
          told += tells_of_size(result);
        } catch (const data::InputError&) {  // one looks wrong, and the others are too few
        }
      }
      EXPECT_GE(answered, 8);
      EXPECT_GE(inside, answered - 1) << count << ' ' << c.size << ' ' << c.too_long;
      EXPECT_EQ(told >= answered - 1, c.size != 1) << count << ' ' << c.size << ' ' << told;
    }
}

TEST(PairScales, OfARobotThatOnlyTurnsDoNotTellTheSize) {
  HandEyeScene scene = noisy_scene(Mount::eye_in_hand, 0.5, 0.5, 21);
  const Eigen::Vector3d place = scene.true_poses.front().translation();
  std::mt19937 random(5);
  std::normal_distribution<double> normal(0, 5e-4);
  for (std::size_t i = 0; i < scene.observations.size(); ++i) {
    Eigen::Isometry3d pose = scene.true_poses[i];
    pose.translation() = place;
    scene.observations[i].T_base_gripper = pose;
    scene.observations[i].T_camera_target = {scene.truth.X.inverse() * pose.inverse() * scene.truth.Z};
    for (double& value : scene.observations[i].T_camera_target.front().translation()) value += normal(random);
  }
  CalibrateSettings unknown;
  unknown.target_size_sd = std::numeric_limits<double>::infinity();
  const std::string said =
      data::input_error_of([&] { calibrate_pairs(Mount::eye_in_hand, pairs_of(scene), unknown); });
  EXPECT_EQ(said.substr(0, 48), "the data do not tell the size of the target: the") << said;
}

}  // namespace
}  // namespace flash::calib
