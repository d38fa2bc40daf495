#include "sysid/capture/synth.h"

#include <gtest/gtest.h>

#include <cmath>

#include "data/mesh/procedural_mesh.h"
#include "sysid/capture/render_depth.h"
#include "sysid/emulate/fingerprint.h"
#include "sysid/emulate/grid_search.h"
#include "sysid/infer/answer.h"
#include "sysid/replay/grasp_mesh.h"
#include "sysid/report/summarize.h"
#include "tests/data/temporary_folder.h"

namespace flash::sysid {
namespace {

constexpr const char* mesh_spec = "sheet:0.3x0.3:0.05:alternating";

data::SheetMaterial stiff_towel() {
  data::SheetMaterial material;
  material.membrane_stiffness = 30;
  material.bending_rigidity = 2e-4;
  return material;
}

SynthSettings short_lift() {
  SynthSettings settings;
  settings.name = "lift";
  settings.duration = 1.0;
  settings.grasp_within = 0.051;
  SynthCamera camera;
  camera.intrinsics.width = 80;
  camera.intrinsics.height = 60;
  camera.intrinsics.fx = camera.intrinsics.fy = 70;
  camera.intrinsics.cx = 39.5;
  camera.intrinsics.cy = 29.5;
  camera.base_from_camera = look_at({0.15, -0.6, 0.6}, {0.15, 0.15, 0.1}, Eigen::Vector3d::UnitZ());
  settings.cameras = {camera};
  return settings;
}

SynthRecording make(const SynthSettings& settings) {
  return synthesize(data::parse_mesh_spec(mesh_spec), mesh_spec, stiff_towel(), settings, {});
}

TEST(Synth, LoadsAsARecordingAndFitsItsOwnTruthToTheNoise) {
  const data::TemporaryFolder folder;
  SynthSettings settings = short_lift();
  settings.cloud_offset = {0.01, -0.005, 0.002};
  SynthRecording synthetic = make(settings);
  EXPECT_EQ(synthetic.unconverged_share, 0);
  save_synthetic(synthetic, folder / "lift");

  const data::Recording recording = data::load_recording(folder / "lift");
  EXPECT_EQ(recording.keyframes.size(), 11u);
  const Replay replay = make_replay(recording, {});
  const ReplayResult result = std::move(run(replay, {{stiff_towel(), {}}}).front());
  ScoreSettings score;
  score.objective.robust.kind = RobustKind::plain;
  const CandidateResult fit = score_motions({replay}, {result}, score);
  // Noise of 1 mm along rays that meet the sheet at angles up to grazing: a mean distance below sqrt(2/pi)
  // mm.
  EXPECT_LT(fit.score, 0.8e-3);
  EXPECT_GT(fit.score, 0.2e-3);
  // A sheet says little about its motion in its own plane; the height it says exactly.
  EXPECT_NEAR(fit.recordings[0].offset.z(), 0.002, 5e-4);
  EXPECT_LT((fit.recordings[0].offset - settings.cloud_offset).norm(), 3e-3);
}

/// Mean distance [m] of a lift's clouds from its truth, as grasped by the shape of the settings of the
/// replay.
double own_truth_missed_by(const data::Recording& recording, const ReplaySettings& settings) {
  const Replay replay = make_replay(recording, settings);
  const ReplayResult result = std::move(run(replay, {{stiff_towel(), {}}}).front());
  EXPECT_TRUE(result.converged);
  ScoreSettings score;
  score.objective.robust.kind = RobustKind::plain;
  return score_motions({replay}, {result}, score).score;
}

TEST(Synth, APinchIsClosedBeforeTheRecordingBegins) {
  const data::TemporaryFolder folder;
  SynthSettings settings = short_lift();
  settings.grasp_shape = data::GraspShape::pinch;
  settings.grasp_within = 0.06;
  SynthRecording synthetic = make(settings);
  EXPECT_EQ(synthetic.unconverged_share, 0);
  save_synthetic(synthetic, folder / "lift");

  const data::Recording recording = data::load_recording(folder / "lift");
  EXPECT_EQ(recording.grasps[0].shape, data::GraspShape::pinch);
  EXPECT_EQ(recording.grasps[0].depth, 0.06);
  const double fit = own_truth_missed_by(recording, {});
  EXPECT_LT(fit, 0.8e-3);
  ReplaySettings flat;
  flat.grasp_shape = data::GraspShape::clamp;
  EXPECT_GT(own_truth_missed_by(recording, flat), 2 * fit);

  settings.kind = "bar_pull";
  EXPECT_NE(data::input_error_of([&] { make(settings); }).find("--grasp-shape: found pinch"),
            std::string::npos);
}

TEST(Synth, ADeviceRecordsWhatTheProcessorDoes) {
  if (const std::string why = sim::why_no_cuda(); !why.empty()) GTEST_SKIP() << why;
  SynthSettings settings = short_lift();
  settings.depth_noise = 0;
  const SynthRecording here = make(settings);
  settings.device = sim::choose_device("cuda");
  const SynthRecording there = make(settings);
  EXPECT_EQ(there.unconverged_share, 0);
  ASSERT_EQ(here.clouds.size(), there.clouds.size());
  // Both are solved to a thousandth of the weight. Pixels at borders see the sheet on one of them alone.
  for (std::size_t k = 0; k < here.clouds.size(); ++k) {
    int apart = 0;
    for (Eigen::Index i = 0; i < there.clouds[k].rows(); ++i)
      apart += (here.clouds[k].rowwise() - there.clouds[k].row(i)).rowwise().norm().minCoeff() > 5e-5;
    EXPECT_LT(apart, 0.02 * static_cast<double>(there.clouds[k].rows())) << k;
  }
}

TEST(Synth, TheSameSeedGivesTheSameRecordingAndAnotherAnother) {
  SynthSettings settings = short_lift();
  settings.duration = 0.2;
  const SynthRecording once = make(settings), again = make(settings);
  settings.seed = 2;
  const SynthRecording other = make(settings);
  EXPECT_EQ(once.clouds.back(), again.clouds.back());
  EXPECT_NE(once.clouds.back(), other.clouds.back());
}

TEST(Synth, TheGripperHidesClothAndLostFramesAreLost) {
  SynthSettings settings = short_lift();
  settings.duration = 0.4;
  const SynthRecording seen = make(settings);
  settings.gripper_half_extents.setZero();
  const SynthRecording bare = make(settings);
  EXPECT_LT(seen.clouds.back().rows(), bare.clouds.back().rows());
  settings.dropped = 0.5;
  settings.keyframe_rate = 100;
  const SynthRecording thinned = make(settings);
  EXPECT_NEAR(static_cast<double>(thinned.clouds.size()), 20,
              12);  // 41 coins: four standard deviations are 13
}

// A depth camera sees the table and the gripper too: segment is to cut them away.
TEST(Synth, RawImagesShowTheTableBesideTheSheet) {
  const data::TemporaryFolder folder;
  SynthSettings settings = short_lift();
  settings.duration = 0.2;
  settings.raw = true;
  SynthRecording synthetic = make(settings);
  save_synthetic(synthetic, folder / "lift");
  const SynthCamera& camera = settings.cameras.front();
  const data::DepthImage image = data::load_depth_image(folder / "lift/camera1/depth/000.png");
  ASSERT_EQ(image.width, camera.intrinsics.width);
  int on_table = 0, below = 0;
  for (int v = 0; v < image.height; ++v)
    for (int u = 0; u < image.width; ++u) {
      if (image.at(u, v) == 0) continue;
      const Eigen::Vector3d point =
          camera.base_from_camera * data::unproject(camera.intrinsics, {u, v}, 1e-3 * image.at(u, v));
      // Five standard deviations along the ray and half a millimetre of rounding.
      const double tolerance = 5 * settings.depth_noise + 5e-4;
      on_table += std::abs(point.z()) < tolerance && (point.head<2>().minCoeff() < -0.05);
      below += point.z() < -tolerance;
    }
  EXPECT_GT(on_table, 100);
  EXPECT_EQ(below, 0);
}

// Seen through the stated camera, the table is where the error of the camera's place puts it.
TEST(Synth, RawImagesAreOfACameraThatStandsBesideTheStatedOne) {
  SynthSettings settings = short_lift();
  settings.duration = 0.2;
  settings.raw = true;
  settings.cloud_offset = {0.01, 0, 0.03};
  const SynthRecording synthetic = make(settings);
  const SynthCamera& stated = synthetic.cameras.front();
  const data::DepthImage& image = synthetic.raw.front().front();
  int on_table = 0;
  for (int v = 0; v < image.height; ++v)
    for (int u = 0; u < image.width; ++u) {
      if (image.at(u, v) == 0) continue;
      const Eigen::Vector3d point =
          stated.base_from_camera * data::unproject(stated.intrinsics, {u, v}, 1e-3 * image.at(u, v));
      // As above: five standard deviations along the ray, and rounding.
      on_table += std::abs(point.z() - settings.cloud_offset.z()) < 5 * settings.depth_noise + 5e-4 &&
                  point.head<2>().minCoeff() < -0.05;
    }
  EXPECT_GT(on_table, 100);
  const Eigen::Vector3d beside =
      stated.base_from_camera.translation() - settings.cameras.front().base_from_camera.translation();
  EXPECT_NEAR((beside - settings.cloud_offset).norm(), 0, 1e-15);
}

// The trajectory starts and ends at rest and the pull is seen at the border of the sheet.
TEST(Synth, ABarPullCarriesItsContourAndForce) {
  SynthSettings settings = short_lift();
  settings.kind = "bar_pull";
  settings.duration = 0.5;
  settings.forces = true;
  const SynthRecording pull = make(settings);
  ASSERT_EQ(pull.recording.grasps.size(), 2u);
  EXPECT_GT(pull.contours.back().rows(), 50);
  // E t e w = 30 N/m x 0.1 x 0.3 m, more for the clamped ends that cannot contract, less what friction
  // carries.
  ASSERT_TRUE(pull.recording.keyframes.back().force.has_value());
  EXPECT_NEAR(pull.recording.keyframes.back().force->x(), 0.9, 0.25);
  const data::Trajectory& gripper = pull.recording.trajectories.at("gripper");
  EXPECT_NEAR((gripper.poses.back().translation() - gripper.poses.front().translation()).x(), 0.03, 1e-12);
}

TEST(Synth, SaysWhatItCannotDo) {
  SynthSettings settings = short_lift();
  settings.kind = "juggle";
  EXPECT_NE(data::input_error_of([&] { make(settings); }).find("--kind"), std::string::npos);
  const auto message = [&](const auto& spoil) {
    settings = short_lift();
    spoil(settings);
    return data::input_error_of([&] { make(settings); });
  };
  using Settings = SynthSettings;
  EXPECT_NE(message([](Settings& s) { s.keyframe_rate = 1e9; }).find("--rate: found 1e+09"),
            std::string::npos);
  EXPECT_NE(message([](Settings& s) { s.duration = 1e9; }).find("--duration: found 1e+09"),
            std::string::npos);
  EXPECT_NE(message([](Settings& s) {
              s.displacement = {1e300, 0, 0};
            }).find("--displacement: found 1e+300"),
            std::string::npos);
  EXPECT_NE(
      message([](Settings& s) { s.cameras[0].base_from_camera.translation().x() = NAN; }).find("--camera"),
      std::string::npos);
  settings = short_lift();
  settings.cameras.clear();
  EXPECT_NE(data::input_error_of([&] { make(settings); }).find("--camera"), std::string::npos);
}

// The whole way: a recording with known truth, a search, an answer whose interval holds the truth.
/// A search of D about 2e-4 N m in a recording of it, simulated on the search's own mesh, not on cells of no
/// size.
struct LiftSearch {
  data::TemporaryFolder folder;
  std::vector<Replay> replays;
  GridSettings grid;
  GridResults results;

  explicit LiftSearch(const std::string& axis = "bending=5e-5:8e-4:5:log", double bending_over_truth = 1,
                      bool grasp_is_known = false) {
    SynthRecording synthetic = make(short_lift());
    save_synthetic(synthetic, folder / "lift");
    replays = {make_replay(data::load_recording(folder / "lift"), {})};
    grid.base.material = stiff_towel();
    grid.base.material.bending_rigidity *= bending_over_truth;
    const std::size_t name = axis.find('=');
    grid.axes = {parse_axis(axis.substr(0, name), axis.substr(name + 1))};
    grid.fixed = {parse_hold("friction=0.3").axis};
    if (grasp_is_known) {
      if (const auto size = grasp_size(replays[0].recording, replays[0].settings))
        grid.fixed.push_back({"grasp_size", {*size}, false});
      grid.fixed.push_back({"grasp_stiffness", {rigid_pads}, false});
    }
    grid.rollouts = folder / "motions";
    ResultsStore store(folder / "run", grid.axes, {"lift"}, fingerprint(replays, grid), Existing::refuse);
    EXPECT_TRUE(grid_search(replays, grid, store));
    results = store.results();
  }
};

TEST(Answer, FindsTheTruthOfASyntheticLift) {
  LiftSearch search;
  AnswerSettings settings;
  settings.solver_check = false;
  const Answer answer = find_answer(search.results, search.replays, search.grid, settings);
  const Summary summary = summarize(search.results, answer, search.replays, search.grid, settings);
  EXPECT_EQ(summary.exit_code, 0);
  ASSERT_EQ(summary.parameters.size(), 1u);
  const ParameterFinding& bending = summary.parameters[0];
  EXPECT_EQ(bending.identifiable, Identifiable::yes);
  EXPECT_GT(*bending.bits, 1);
  EXPECT_LE((*bending.interval95)[0], 2e-4);
  EXPECT_GE((*bending.interval95)[1], 2e-4);
  EXPECT_NEAR(std::log(*bending.estimate / 2e-4), 0, std::log(2));  // one step of the grid
  EXPECT_EQ(summary.fixed.at("friction").source, "measured");
  EXPECT_TRUE(summary.solver_check.empty());
  EXPECT_EQ(summary.samples.rows(), 64);
  EXPECT_EQ(summary.recordings[0].sha256.size(), 64u);
}

TEST(Answer, IsThatOfTheSearchsOwnMeshWhereThatExplainsMore) {
  LiftSearch search;
  const Answer answer = find_answer(search.results, search.replays, search.grid, {});
  EXPECT_TRUE(std::any_of(answer.warnings.begin(), answer.warnings.end(), [](const std::string& warning) {
    return warning.find("the answer is of that mesh") != std::string::npos;
  }));
  ASSERT_EQ(answer.parameters.size(), 1u);
  const ParameterFinding& bending = answer.parameters[0];
  EXPECT_EQ(bending.identifiable, Identifiable::yes);
  EXPECT_LE((*bending.interval95)[0], 2e-4);
  EXPECT_GE((*bending.interval95)[1], 2e-4);
  // Between the values searched, which are a factor of 2 apart.
  EXPECT_LT((*bending.interval95)[1] / (*bending.interval95)[0], 1.5);
  EXPECT_TRUE(std::any_of(answer.checks.begin(), answer.checks.end(),
                          [](const SolverCheck& check) { return check.what == "double_mesh"; }));
}

TEST(Answer, SaysThatAStiffnessWasHeldAtAValueThatTheRecordingContradicts) {
  for (const double factor : {1.0, 2.0}) {
    LiftSearch search("young=20:80:3:log", factor, true);  // another grasp would explain another stiffness
    const Answer answer = find_answer(search.results, search.replays, search.grid, {});
    const Summary summary = summarize(search.results, answer, search.replays, search.grid, {});
    if (factor == 1) {
      EXPECT_TRUE(answer.contradicted.empty()) << answer.contradicted.front();
      continue;
    }
    ASSERT_EQ(answer.contradicted.size(), 1u);
    EXPECT_EQ(answer.contradicted[0].rfind("bending was held at 0.0004 N m", 0), 0u)
        << answer.contradicted[0];
    EXPECT_EQ(summary.exit_code, 3);
    EXPECT_EQ(summary.warnings.front(), answer.contradicted[0]);
  }
}

}  // namespace
}  // namespace flash::sysid
