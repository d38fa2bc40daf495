#include "calib/solve/view_selection.h"

#include <gtest/gtest.h>

#include "calib/geometry/projection.h"
#include "tests/calib/hand_eye_scene.h"

namespace flash::calib {
namespace {

using Mount = calib::Setup;  // testing::Test has a private member of the name Setup

// A board turned as a whole closes as well as the board as it was numbered: no residual tells them apart.
TEST(ViewSelection, MostViewsKeepTheNumberingOfTheirDetector) {
  for (const Mount setup : {Mount::eye_in_hand, Mount::eye_to_hand})
    for (unsigned seed = 1; seed <= 8; ++seed) {
      SceneSettings settings = protocol_settings(setup);
      settings.robot_deg = 0.05;
      settings.robot_mm = 0.5;
      HandEyeScene scene = make_scene(settings, board_points(), seed);
      const std::vector<Symmetry> symmetries = grid_symmetries(scene.points);
      const auto flipped = [](std::size_t i) { return i % 3 == 2; };
      for (std::size_t i = 0; i < scene.observations.size(); ++i) {
        if (!flipped(i)) continue;
        for (int& point : scene.observations[i].points)
          point = symmetries[1].permutation[static_cast<std::size_t>(point)];
        Eigen::Isometry3d& T = scene.observations[i].T_camera_target.front();
        T = T * symmetries[1].turn.inverse();
      }
      const ViewSelection selection = select_views(setup, scene.observations, symmetries);
      for (std::size_t i = 0; i < selection.views.size(); ++i) {
        EXPECT_EQ(selection.views[i].symmetry, flipped(i) ? 1 : 0) << "seed " << seed << ", view " << i;
        for (std::size_t k = 0; k < selection.observations[i].points.size(); ++k)
          ASSERT_EQ(selection.observations[i].points[k], static_cast<int>(k));
      }
      EXPECT_EQ(selection.renumbered, static_cast<int>(selection.views.size() / 3));
      // The seed stands at the true end of the board, whose ends are 0.24 m apart; it knows it to 2 cm.
      EXPECT_LT((selection.robust_seed.poses.Z.translation() - scene.truth.Z.translation()).norm(), 0.02);
    }
}

}  // namespace
}  // namespace flash::calib
