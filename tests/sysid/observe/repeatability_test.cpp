#include "sysid/observe/repeatability.h"

#include <gtest/gtest.h>

#include <cmath>

#include "data/files/error.h"
#include "data/mesh/procedural_mesh.h"
#include "sysid/capture/render_depth.h"
#include "sysid/capture/synth.h"
#include "tests/data/temporary_folder.h"

namespace flash::sysid {
namespace {

constexpr double noise = 1e-3;

/// A trial of a lift: the same motion and cloth but for what is asked, seen with noise of its own.
data::Recording trial(const data::TemporaryFolder& folder, unsigned seed, double bending = 2e-4,
                      const Eigen::Vector3d& offset = Eigen::Vector3d::Zero(), double clock = 0) {
  SynthSettings settings;
  settings.name = "trial_" + std::to_string(seed);
  settings.duration = 1.0;
  settings.keyframe_rate = 20;
  settings.depth_noise = noise;
  settings.gripper_half_extents.setZero();
  settings.grasp_within = 0.051;
  settings.cloud_offset = offset;
  settings.time_offset = clock;
  settings.seed = seed;
  SynthCamera camera;
  camera.intrinsics.width = 80;
  camera.intrinsics.height = 60;
  camera.intrinsics.fx = camera.intrinsics.fy = 70;
  camera.intrinsics.cx = 39.5;
  camera.intrinsics.cy = 29.5;
  camera.base_from_camera = look_at({0.15, -0.6, 0.6}, {0.15, 0.15, 0.1}, Eigen::Vector3d::UnitZ());
  settings.cameras = {camera};
  data::SheetMaterial material;
  material.membrane_stiffness = 30;
  material.bending_rigidity = bending;
  const std::string spec = "sheet:0.3x0.3:0.05:alternating";
  SynthRecording made = synthesize(data::parse_mesh_spec(spec), spec, material, settings, {});
  save_synthetic(made, folder / settings.name);
  return data::load_recording(folder / settings.name);
}

TEST(Repeatability, OfTwoTrialsThatDifferByNoiseIsThatOfNoise) {
  const data::TemporaryFolder folder;
  const Repeatability found = measure_repeatability(trial(folder, 1), trial(folder, 2), {});
  // A point against the mean of about twelve others, seen at up to 45 degrees: between 0.7 and 1.12 times the
  // noise; the mean magnitude of its smallest 95 % is 0.72 of that. The plane also errs by curvature.
  EXPECT_GT(found.distance, 0.72 * 0.7 * noise * 0.9);
  EXPECT_LT(found.distance, 0.72 * 1.12 * noise * 1.3);
  for (const TrialDistance& keyframe : found.keyframes) EXPECT_GT(keyframe.seen, 0.8);
}

TEST(Repeatability, TakesOutHowCameraAndClockStand) {
  const data::TemporaryFolder folder;
  const Eigen::Vector3d offset(0.01, -0.005, 0.004);
  // The bounds are those of the first trial: the one with the errors.
  const data::Recording off = trial(folder, 1, 2e-4, offset, 0.03), right = trial(folder, 2);
  const Repeatability found = measure_repeatability(off, right, {});
  EXPECT_LT((found.registration.offset - offset).norm(), 2e-3);
  EXPECT_NEAR(found.registration.time_offset, 0.03, 0.01);
  EXPECT_LT(found.distance, 1.5e-3);
}

TEST(Repeatability, SeesAnotherCloth) {
  const data::TemporaryFolder folder;
  const double same = measure_repeatability(trial(folder, 1), trial(folder, 2), {}).distance;
  const double other = measure_repeatability(trial(folder, 1), trial(folder, 3, 5e-6), {}).distance;
  EXPECT_GT(other, 2 * same);
}

TEST(Repeatability, ABoundThatIsReachedIsToldAndAnotherSheetRefused) {
  const data::TemporaryFolder folder;
  data::Recording first = trial(folder, 1, 2e-4, Eigen::Vector3d(0.02, 0, 0)), second = trial(folder, 2);
  first.nuisance.offset = {0.005, 0, 0};
  EXPECT_EQ(measure_repeatability(first, second, {}).bounds_hit, std::vector<std::string>{"offset_x"});
  second.mesh.vertices *= 1.1;
  EXPECT_THROW(measure_repeatability(first, second, {}), data::InputError);
}

TEST(Repeatability, TrialsWithoutACommonTimeAreRefused) {
  const data::TemporaryFolder folder;
  RepeatabilitySettings settings;
  settings.score_from = 100;
  try {
    measure_repeatability(trial(folder, 1), trial(folder, 2), settings);
    FAIL() << "nothing is left to compare";
  } catch (const data::InputError& error) {
    const std::string message = error.what();
    EXPECT_TRUE(message.starts_with("--from 100: found no keyframe with cloth in between, expected some of"))
        << message;
    EXPECT_TRUE(message.ends_with(" s")) << message;
  }
}

}  // namespace
}  // namespace flash::sysid
