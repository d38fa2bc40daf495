#include "calib/watch/watch_state.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/calib/four_axis_scene.h"
#include "tests/calib/hand_eye_scene.h"

namespace flash::calib {
namespace {

struct Recording {
  HandEyeScene scene;
  Target target = parse_target("chessboard:9x6:0.025");
  Dataset posed = {};
  std::vector<Detection> detections = {};
};

Recording make_recording(const SceneSettings& settings, unsigned seed) {
  Recording recording{.scene = make_scene(settings, board_points(), seed)};
  recording.posed.camera = recording.scene.camera;
  for (const Observation& view : recording.scene.observations) {
    Frame frame;
    frame.name = frame.image = view.image;
    frame.T_base_gripper = view.T_base_gripper;
    recording.posed.frames.push_back(frame);
    recording.detections.push_back({view.image, "", {{"image_model", view}}});
  }
  return recording;
}

WatchInputs inputs_of(const Recording& recording) {
  WatchInputs inputs;
  inputs.setup = recording.scene.settings.setup;
  inputs.camera = recording.scene.camera;
  inputs.points = recording.scene.points;
  for (const Detection& detection : recording.detections)
    inputs.pictures.push_back(
        {detection.image, true, detection, detection.readings.front().observation.T_base_gripper});
  inputs.last = recording.detections.back().image;
  return inputs;
}

WatchAnswer answer_of(const Recording& recording) {
  return watch_answer(recording.scene.settings.setup, recording.posed, recording.target, recording.detections,
                      {}, {});
}

SceneSettings few_views(int views) {
  SceneSettings settings;
  settings.views = views;
  settings.robot_deg = 0.01;
  settings.robot_mm = 0.1;
  return settings;
}

TEST(WatchState, NothingYetIsAStateToo) {
  const WatchState state = watch_state({});
  EXPECT_FALSE(state.last.has_value());
  EXPECT_FALSE(state.next.has_value());
  EXPECT_NE(state.advice.find("first picture"), std::string::npos);
  const nlohmann::ordered_json json = to_json(state);
  EXPECT_EQ(json["schema"], "flash-watch/1");
  EXPECT_TRUE(json["last"].is_null());
  EXPECT_TRUE(json["answer"].is_null());
}

TEST(WatchState, BeforeFourViewsItSaysHowManyAreMissingAndWhereToTurn) {
  const Recording recording = make_recording(few_views(2), 5);
  WatchInputs inputs = inputs_of(recording);
  inputs.answer = answer_of(recording);
  EXPECT_EQ(inputs.answer->not_yet, "2 of the 4 views that the first answer takes");
  const WatchState state = watch_state(inputs);
  EXPECT_EQ(state.last->found, 54);
  EXPECT_EQ(state.last->expected, 54);
  EXPECT_NE(state.advice.find("Turn the gripper by 20 to 40 deg about"), std::string::npos) << state.advice;
  // Two poses turn about one axis: nothing is known of the others.
  EXPECT_NEAR(state.turns.spread_deg.y(), 0, 1e-5);
  const Eigen::Vector3d turn = rotation_log(recording.posed.frames[0].T_base_gripper.linear().transpose() *
                                            recording.posed.frames[1].T_base_gripper.linear());
  EXPECT_NEAR(state.turns.spread_deg.x(), turn.norm() * 180 / M_PI, 1e-6);
}

TEST(WatchState, EveryCornerIsCountedInTheCellThatItLiesIn) {
  const Recording recording = make_recording(few_views(6), 2);
  const WatchState state = watch_state(inputs_of(recording));
  Eigen::Matrix<int, ImageCoverage::kRows, ImageCoverage::kColumns> counts;
  counts.setZero();
  int outside = 0;  // the scene lets corners leave the picture
  for (const Observation& view : recording.scene.observations)
    for (const auto& pixel : view.pixels.colwise()) {
      const int column = static_cast<int>(std::floor((pixel.x() + 0.5) / 80)),
                row = static_cast<int>(std::floor((pixel.y() + 0.5) / 80));
      if (column < 0 || row < 0 || column >= 8 || row >= 6)
        ++outside;
      else
        ++counts(row, column);
    }
  EXPECT_EQ(state.image.counts.sum(), 6 * 54);
  EXPECT_EQ((state.image.counts - counts).sum(), outside);
  EXPECT_GE((state.image.counts - counts).minCoeff(), 0);
}

TEST(WatchState, TheNextPictureShowsTheTargetWhereItsOutlineIs) {
  for (const calib::Setup setup : {calib::Setup::eye_in_hand, calib::Setup::eye_to_hand}) {
    SceneSettings settings = few_views(8);
    settings.setup = setup;
    const Recording recording = make_recording(settings, 4);
    WatchInputs inputs = inputs_of(recording);
    inputs.answer = answer_of(recording);
    ASSERT_TRUE(inputs.answer->calibration) << inputs.answer->not_yet;
    ASSERT_TRUE(inputs.answer->next) << inputs.answer->no_plan;
    const WatchState state = watch_state(inputs);
    ASSERT_TRUE(state.next);
    const HandEyeScene& scene = recording.scene;
    const Eigen::Isometry3d& G = state.next->T_base_gripper;
    const Eigen::Isometry3d T_camera_target = setup == calib::Setup::eye_in_hand
                                                  ? scene.truth.X.inverse() * G.inverse() * scene.truth.Z
                                                  : scene.truth.X.inverse() * G * scene.truth.Z;
    const Eigen::Vector3d far(0.2, 0.125, 0);
    // A camera known to 0.3 mm and 0.1 deg: 615 px * (0.3 / 300 + 0.0017) for corners, three deviations.
    EXPECT_LT((state.next->outline.col(0) -
               project(to_vector(scene.camera), T_camera_target * Eigen::Vector3d::Zero()))
                  .norm(),
              5);
    EXPECT_LT((state.next->outline.col(2) - project(to_vector(scene.camera), T_camera_target * far)).norm(),
              5);
    EXPECT_LT(state.next->translation_sd, known_after(*inputs.answer).translation_sd);
    const nlohmann::ordered_json json = to_json(state);
    EXPECT_EQ(json["answer"]["transform"]["parent"], setup == calib::Setup::eye_in_hand ? "gripper" : "base");
    EXPECT_EQ(json["next"]["outline_px"].size(), 8U);
  }
}

TEST(WatchState, TurnsAboutOneAxisAreNamedAndNothingIsThrown) {
  Recording recording = make_recording(few_views(6), 3);
  // The arm turns about its z alone.
  for (std::size_t i = 0; i < recording.posed.frames.size(); ++i) {
    Eigen::Isometry3d pose =
        make_pose({0.5, 0.01 * static_cast<double>(i), 0.3}, {0, 0, 0.2 * static_cast<double>(i)});
    recording.posed.frames[i].T_base_gripper = pose;
    recording.detections[i].readings.front().observation.T_base_gripper = pose;
  }
  WatchInputs inputs = inputs_of(recording);
  inputs.answer = answer_of(recording);
  EXPECT_FALSE(inputs.answer->calibration);
  EXPECT_FALSE(inputs.answer->not_yet.empty());  // the pictures show other turns
  const WatchState state = watch_state(inputs);
  EXPECT_FALSE(state.next);
  EXPECT_NE(state.turns.sentence.find("turn more about"), std::string::npos);
  EXPECT_EQ(state.turns.sentence.find("(0.00, 0.00, 1.00)"), std::string::npos);
}

// Its place along the axis has no deviation, and does not count in how well the camera is known.
TEST(WatchState, WhatAnArmOfFourAxesDoesNotTellHasNoDeviation) {
  const HandEyeScene scene = make_four_axis_scene({}, 1);
  CalibrateSettings settings;
  settings.folds = 2;
  WatchAnswer answer{.views = scene.observations.size(), .not_yet = {}};
  answer.calibration = calibrate(scene.settings.setup, scene.camera, scene.points,
                                 grid_symmetries(scene.points), scene.observations, settings);
  ASSERT_TRUE(answer.calibration->along && !answer.calibration->along->told);
  EXPECT_LT(known_after(answer).translation_sd, 0.01);
  WatchState state;
  state.answer = std::move(answer);
  const nlohmann::ordered_json json = to_json(state)["answer"];
  int untold = 0;
  for (const auto& sd : json["sd_mm"]) untold += sd.is_null();
  EXPECT_EQ(untold, 1);
}

}  // namespace
}  // namespace flash::calib
