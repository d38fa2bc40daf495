#include "calib/uncertainty/corner_noise_ratios.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "tests/calib/hand_eye_scene.h"

namespace flash::calib {
namespace {

/// Twenty-four views by a robot that reports its poses to a micrometre, corners of every third `blur` times
/// as noisy.
HandEyeScene blurred_scene(double blur, unsigned seed) {
  SceneSettings settings{.views = 24};
  settings.robot_mm = 0.001;
  settings.robot_deg = 1e-4;
  HandEyeScene scene = make_scene(settings, board_points(), seed);
  std::mt19937 random(seed + 1000);
  std::normal_distribution<double> normal(0, settings.corner_px * std::sqrt(blur * blur - 1));
  for (std::size_t i = 0; i < scene.observations.size(); i += 3)
    for (double& pixel : scene.observations[i].pixels.reshaped()) pixel += normal(random);
  return scene;
}

Refinement refined(const HandEyeScene& scene, const std::vector<double>& ratios) {
  Bundle bundle =
      make_bundle(scene.settings.setup, scene.camera, scene.points, scene.observations, scene.truth);
  for (std::size_t i = 0; i < ratios.size(); ++i) bundle.views[i].corner_noise = ratios[i];
  return refine(std::move(bundle), {});
}

TEST(CornerNoiseRatios, AreOneWhereAllViewsAreAlike) {
  for (unsigned seed = 1; seed <= 5; ++seed)
    for (const double ratio : corner_noise_ratios(refined(blurred_scene(1, seed), {}).bundle))
      // As few corners as 54 tell a deviation to 7 %: what is left of that by chance is a part of it.
      EXPECT_NEAR(ratio, 1, 0.1);
}

TEST(CornerNoiseRatios, TellWhichViewsAreBlurred) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const std::vector<double> ratios = corner_noise_ratios(refined(blurred_scene(4, seed), {}).bundle);
    double blurred = 0, sharp = 0;
    for (std::size_t i = 0; i < ratios.size(); ++i) (i % 3 == 0 ? blurred : sharp) += std::log(ratios[i]);
    // Of 8 and 16 views: their mean logarithms to 7 % over the root of their number, drawn in by some
    // percent.
    EXPECT_NEAR(std::exp(blurred / 8 - sharp / 16), 4, 0.5);
  }
}

// The information of views that count as they should: X is nearer the truth, as far as its covariance says.
TEST(CornerNoiseRatios, BlurredViewsThatCountLessBringTheCameraNearer) {
  constexpr int kSeeds = 20;
  double alike = 0, weighed = 0, stated_alike = 0, stated = 0;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    const HandEyeScene scene = blurred_scene(6, seed);
    const Refinement first = refined(scene, {}), second = refined(scene, corner_noise_ratios(first.bundle));
    const auto squared = [&](const Refinement& r) {
      return motion_between(r.bundle.cameras[0], scene.truth.X).head<3>().squaredNorm();
    };
    alike += squared(first);
    weighed += squared(second);
    stated_alike += first.covariance.topLeftCorner<3, 3>().trace();
    stated += second.covariance.topLeftCorner<3, 3>().trace();
  }
  std::printf(
      "X off by %.3f mm where all views count alike (stated %.3f), %.3f where blurred ones count less "
      "(stated %.3f)\n",
      1e3 * std::sqrt(alike / kSeeds), 1e3 * std::sqrt(stated_alike / kSeeds),
      1e3 * std::sqrt(weighed / kSeeds), 1e3 * std::sqrt(stated / kSeeds));
  EXPECT_LT(weighed, 0.5 * alike);
  // 60 numbers: their mean square to 18 %.
  EXPECT_NEAR(weighed / stated, 1, 0.4);
}

}  // namespace
}  // namespace flash::calib
