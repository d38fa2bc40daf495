#include "sysid/replay/replay.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>

#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/mesh/procedural_mesh.h"
#include "sim/pairs/intersection.h"
#include "sysid/emulate/fingerprint.h"
#include "sysid/emulate/grid_search.h"
#include "sysid/replay/recorded_grasp.h"
#include "tests/sysid/short_lift.h"

namespace flash::sysid {
namespace {

constexpr double kPi = 3.14159265358979323846;

class Lift : public ::testing::Test {
 protected:
  void SetUp() override {
    path = std::string(FLASH_SHARED_DIR) + "/data/twin/lift_a";
    if (!std::filesystem::exists(path)) GTEST_SKIP() << "no recording at " << path;
    recording = data::load_recording(path);
    settings.mesh = "sheet:0.4x0.4:0.04:alternating";
    settings.grasp_within = 0.041;
  }
  std::string path;
  data::Recording recording;
  ReplaySettings settings;
};

TEST_F(Lift, ClampHoldsThePatchAsItLies) {
  const Replay replay = make_replay(recording, settings);
  EXPECT_EQ(replay.start, 0);
  EXPECT_NEAR(replay.pivot.x(), 0.39, 1e-12);
  EXPECT_NEAR(replay.start + (replay.steps - 1) * 0.01, 2.5, 1e-9);
  const sim::Environment environment = make_environment(replay, {});
  EXPECT_EQ(environment.holds.at(0).vertices.size(), 4u);
  EXPECT_EQ(environment.holds.at(0).targets.rows(), 0);
  EXPECT_EQ(environment.obstacles.size(), 1u);
}

TEST_F(Lift, PointHoldsTheCornerAlone) {
  settings.grasp_shape = data::GraspShape::point;
  const Replay replay = make_replay(recording, settings);
  const sim::Environment environment = make_environment(replay, {});
  ASSERT_EQ(environment.holds.at(0).vertices.size(), 1u);
  const auto corner = replay.recording.mesh.vertices.row(environment.holds[0].vertices[0]);
  EXPECT_NEAR((corner - Eigen::RowVector3d(0.4, 0.4, 0)).norm(), 0, 1e-12);
}

TEST_F(Lift, PinchClosesBeforeTheRecordingStarts) {
  settings.grasp_shape = data::GraspShape::pinch;
  const Replay replay = make_replay(recording, settings);
  EXPECT_NEAR(replay.start, -0.4, 1e-12);
  ReplayCandidate candidate;
  candidate.nuisance.grasp_depth = 0.041;
  const sim::Environment environment = make_environment(replay, candidate);
  const sim::Hold& grasp = environment.holds.at(0);
  EXPECT_EQ(grasp.vertices.size(), 4u);
  EXPECT_EQ(grasp.from, replay.start);
  EXPECT_LE(grasp.from + grasp.closing_time, 0);
  const Eigen::VectorXd heights = grasp.targets.col(2);  // the gripper starts at z = 0, unturned
  EXPECT_NEAR(heights.minCoeff(), 0, 1e-12);
  EXPECT_NEAR(heights.maxCoeff(), 0.04 / std::sqrt(2.0), 1e-12);
}

TEST_F(Lift, StartYawTurnsTheSheetAboutTheGripperAndTableHeightLeavesTheGripperWhereItIs) {
  settings.pre_roll = 0.3;
  const Replay replay = make_replay(recording, settings);
  ReplayCandidate candidate;
  candidate.nuisance.start_yaw = 0.2;
  candidate.nuisance.table_height = -0.01;
  const sim::Environment environment = make_environment(replay, candidate);
  const data::Points& start = environment.state.positions;
  const Eigen::RowVector3d was = replay.recording.start.row(0) - replay.pivot.transpose(),
                           is = start.row(0) - replay.pivot.transpose();
  EXPECT_NEAR(std::atan2(is.y(), is.x()) - std::atan2(was.y(), was.x()), 0.2, 1e-12);
  EXPECT_NEAR(is.head<2>().norm(), was.head<2>().norm(), 1e-12);
  EXPECT_NEAR(start.col(2).maxCoeff(), -0.01, 1e-12);
  EXPECT_NEAR(std::get<sim::Plane>(environment.obstacles.at(0).shape).point.z(), -0.01, 1e-12);
  EXPECT_NEAR(environment.holds.at(0).targets.col(2).norm(), 0, 1e-12);

  candidate.nuisance.table_height = 0.01;  // a table above the recorded grasp carries the patch
  const sim::Environment raised = make_environment(replay, candidate);
  EXPECT_NEAR(raised.holds.at(0).targets.col(2).minCoeff(), 0.01, 1e-12);
}

TEST_F(Lift, RegistrationTakesBoundsAndPivotOfTheRecording) {
  recording.nuisance.offset = {0.01, 0.02, 0.03};
  recording.nuisance.yaw = kPi / 12;
  const Replay replay = make_replay(recording, settings);
  const Motion motion;
  const RegistrationProblem problem = registration_problem(replay, motion);
  EXPECT_EQ(problem.bounds.offset, recording.nuisance.offset);
  EXPECT_EQ(problem.bounds.yaw, kPi / 12);
  EXPECT_EQ(problem.start.pivot, replay.pivot);
}

TEST_F(Lift, GridSearchEqualsItselfWithMoreThreadsAndAfterAStop) {
  settings.score_to = 0.3;
  Replay replay = make_replay(recording, settings);
  replay.steps = 30;
  GridSettings grid;
  grid.axes = {parse_axis("bending", "5e-5:2e-4:3:log"), parse_axis("friction", "0.2,0.4")};
  const auto folder = [](const char* name) {
    const auto place = std::filesystem::temp_directory_path() / name;
    std::filesystem::remove_all(place);
    return place.string();
  };
  const Fingerprint key = fingerprint({replay}, grid);
  const std::string at_once = folder("flash_grid_at_once"), stopped = folder("flash_grid_stopped");
  ResultsStore one(at_once, grid.axes, {recording.name}, key, Existing::refuse);
  EXPECT_TRUE(grid_search({replay}, grid, one));

  std::atomic<bool> stop = false;
  {
    ResultsStore first(stopped, grid.axes, {recording.name}, key, Existing::refuse);
    EXPECT_FALSE(grid_search(
        {replay}, grid, first, [&](const Progress& p) { stop = p.done >= 2; }, &stop));
    EXPECT_EQ(first.results().candidates.size(), 2u);
  }
  grid.threads = 2;
  EXPECT_EQ(fingerprint({replay}, grid), key);  // threads decide nothing
  ResultsStore rest(stopped, grid.axes, {recording.name}, key, Existing::resume);
  EXPECT_TRUE(grid_search({replay}, grid, rest));
  ASSERT_EQ(rest.results().candidates.size(), 6u);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(rest.results().candidates[i].score, one.results().candidates[i].score);
    EXPECT_EQ(rest.results().candidates[i].values, one.results().candidates[i].values);
  }
  std::filesystem::remove_all(at_once);
  std::filesystem::remove_all(stopped);
}

TEST_F(Lift, FingerprintFollowsSettingsAndInputs) {
  const Replay replay = make_replay(recording, settings);
  GridSettings grid;
  grid.axes = {parse_axis("bending", "1e-4")};
  const Fingerprint key = fingerprint({replay}, grid);
  GridSettings other = grid;
  other.base.material.friction += 0.1;
  EXPECT_NE(fingerprint({replay}, other), key);
  Replay moved = replay;
  moved.observations[3].points(0, 0) += 1e-6;
  EXPECT_NE(fingerprint({moved}, grid), key);
}

TEST(Replay, StampsOfAnyClockGiveTheSameStepsAndScore) {
  const data::TemporaryFolder folder;
  const Replay zero = short_lift(folder);
  const nlohmann::json recording = nlohmann::json::parse(data::read_file(folder / "lift/recording.json"));
  const data::Trajectory gripper = data::load_tum(folder / "lift/gripper.tum");
  const auto score_of = [](const Replay& replay) {
    return score_motions({replay}, run(replay, {{short_lift_material(), {}}}), {}).score;
  };
  const double expected = score_of(zero);
  for (const double epoch : {1000.0, 1.764e9}) {
    nlohmann::json moved = recording;
    moved["grasps"][0]["from"] = epoch;
    for (nlohmann::json& keyframe : moved["keyframes"]) keyframe["t"] = keyframe["t"].get<double>() + epoch;
    data::Trajectory path = gripper;
    for (double& time : path.times) time += epoch;
    data::save_tum(path, folder / "lift/gripper.tum");
    folder.write("lift/recording.json", moved.dump());
    const Replay replay = make_replay(data::load_recording(folder / "lift"), zero.settings);
    EXPECT_EQ(replay.steps, zero.steps);
    // Stamps of today are resolved to 2.4e-7 s; the gripper moves at less than 0.4 m/s.
    EXPECT_NEAR(score_of(replay), expected, 1e-7);
  }
}

TEST(Replay, AGraspInTwoPartsPullsAsOne) {
  const data::TemporaryFolder folder;
  const Replay whole = short_lift(folder);
  const ReplayCandidate candidate{short_lift_material(), {}};
  for (const double change : {0.2, 0.2037}) {
    data::Recording recording = whole.recording;
    recording.grasps.push_back(recording.grasps[0]);
    recording.grasps[0].to = recording.grasps[1].from = change;
    // Of vertices, wherever they are by then.
    for (data::RecordedGrasp& grasp : recording.grasps) {
      grasp.select = {};
      grasp.select.vertices = data::select_vertices(whole.recording, whole.recording.grasps[0]);
    }
    ReplaySettings settings = whole.settings;
    settings.clamp_slopes = false;
    const Motion parts = std::move(run(make_replay(recording, settings), {candidate}).front().motion);
    recording.grasps = {recording.grasps[0]};
    recording.grasps[0].to = std::numeric_limits<double>::infinity();
    const Motion one = std::move(run(make_replay(recording, settings), {candidate}).front().motion);
    ASSERT_EQ(parts.forces.size(), one.forces.size());
    for (std::size_t k = 0; k < one.forces.size(); ++k)
      EXPECT_LE((parts.forces[k] - one.forces[k]).norm(), 1e-12 + 1e-9 * one.forces[k].norm())
          << change << " " << k;
  }
}

/// The strip of short_lift hung up by one end, while the other end is carried over and through it.
Replay carried_through(const data::TemporaryFolder& folder,
                       const std::optional<sim::SelfContact>& self_contact) {
  const Replay lift = short_lift(folder, "sheet:0.2x0.05:0.0125:alternating");
  data::Recording recording = lift.recording;
  data::Trajectory& path = recording.trajectories.at(recording.grasps[0].gripper);
  const Eigen::Isometry3d start = path.poses.front();
  const bool grasps_far_end = start.translation().x() > 0.1;
  data::RecordedSupport bar;
  for (Eigen::Index i = 0; i < recording.mesh.vertices.rows(); ++i)
    if (grasps_far_end ? recording.mesh.vertices(i, 0) < 0.02 : recording.mesh.vertices(i, 0) > 0.18)
      bar.select.vertices.push_back(static_cast<int>(i));
  recording.supports = {bar};
  recording.has_table = false;
  const double duration = path.times.back(), way = grasps_far_end ? -0.23 : 0.23;
  data::Trajectory through;
  for (int k = 0; k <= 40; ++k) {
    Eigen::Isometry3d pose = start;
    pose.translation() += k / 40.0 * Eigen::Vector3d(way, 0, -0.04);
    through.times.push_back(duration * k / 40);
    through.poses.push_back(pose);
  }
  path = through;
  ReplaySettings settings = lift.settings;
  settings.self_contact = self_contact;
  return make_replay(recording, settings);
}

/// In how many steps two triangles pass through each other, each pair of them looked at.
int steps_passing_through(const Replay& replay, const ReplayCandidate& candidate) {
  int count = 0;
  run(replay, {candidate}, every_step(replay), [&](std::size_t, ReplayResult result) {
    const data::Triangles& triangles = replay.surface.triangles;
    for (const data::Points& x : result.motion.positions) {
      bool passing = false;
      for (Eigen::Index a = 0; a < triangles.rows() && !passing; ++a)
        for (Eigen::Index b = 0; b < triangles.rows() && !passing; ++b) {
          bool apart = true;
          for (int i = 0; i < 9; ++i) apart = apart && triangles(a, i / 3) != triangles(b, i % 3);
          if (!apart) continue;
          Eigen::Vector3d corners[3];
          for (int i = 0; i < 3; ++i) corners[i] = x.row(triangles(b, i));
          for (int i = 0; i < 3; ++i)
            passing =
                passing || sim::passes(x.row(triangles(a, i)), x.row(triangles(a, (i + 1) % 3)), corners);
        }
      count += passing;
    }
  });
  return count;
}

TEST(Replay, ASheetCarriedThroughItselfIsHeldUpBySelfContact) {
  const data::TemporaryFolder folder;
  ReplayCandidate candidate{short_lift_material(), {}};
  candidate.material.bending_rigidity = 1e-6;
  EXPECT_GT(steps_passing_through(carried_through(folder, {}), candidate), 0);
  const Replay replay = carried_through(folder, sim::SelfContact{.thickness = 1e-3, .friction = -1});
  EXPECT_EQ(steps_passing_through(replay, candidate), 0);
}

TEST(Replay, SelfContactHasTheFrictionOfTheSheetUnlessItHasItsOwn) {
  const data::TemporaryFolder folder;
  const Replay without = short_lift(folder);
  ReplayCandidate candidate{short_lift_material(), {}};
  candidate.material.friction = 0.7;
  EXPECT_FALSE(make_environment(without, candidate).self_contact);
  ReplaySettings settings = without.settings;
  settings.self_contact = sim::SelfContact{.thickness = 2e-3, .friction = -1};
  EXPECT_EQ(make_environment(make_replay(without, settings), candidate).self_contact,
            (sim::SelfContact{.thickness = 2e-3, .friction = 0.7}));
  settings.self_contact->friction = 0.1;
  const Replay with = make_replay(without, settings);
  EXPECT_EQ(make_environment(with, candidate).self_contact->friction, 0.1);
  // A search does not go on under another setting.
  EXPECT_EQ(difference(fingerprint({without}, {}), fingerprint({with}, {})),
            "layer_friction was absent and is 0.1, and 1 more");
  settings.self_contact->thickness = 0.1;
  EXPECT_NE(data::input_error_of([&] { make_replay(without, settings); }).find("the mean edge of the mesh"),
            std::string::npos);
}

TEST(Replay, AGraspThatActsInNoStepIsRefused) {
  const data::TemporaryFolder folder;
  const Replay replay = short_lift(folder);
  data::Recording recording = replay.recording;
  recording.grasps[0].to = recording.grasps[0].from + 1e-6;
  EXPECT_NE(data::input_error_of([&] {
              make_replay(recording, replay.settings);
            }).find("grasps[0]: found 1e-06 s between from and to, expected the middle of a step of 0.01 s"),
            std::string::npos);
}

TEST(Replay, ASimulationWithoutEndIsRefusedWithItsCause) {
  const data::TemporaryFolder folder;
  const Replay replay = short_lift(folder);
  const auto message_of = [&](const auto& spoil) {
    data::Recording recording = replay.recording;
    ReplaySettings settings = replay.settings;
    spoil(recording, settings);
    return data::input_error_of([&] { make_replay(recording, settings); });
  };
  EXPECT_NE(
      message_of([](data::Recording&, ReplaySettings& s) {
        s.solver.time_step = 1e-9;
      }).find("--time-step: found 1e-09 s, which makes 4e+08 steps of 0.4 s, expected at most 1,000,000"),
      std::string::npos);
  EXPECT_NE(message_of([](data::Recording& r, ReplaySettings&) {
              r.grasps[0].from = -20'000;
            }).find("grasps.from: found 2e+04 s before the first keyframe"),
            std::string::npos);
  EXPECT_NE(message_of([](data::Recording& r, ReplaySettings&) {
              r.keyframes.back().time = 20'000;
            }).find("recording.json: keyframes: "),
            std::string::npos);
  EXPECT_NE(
      message_of([](data::Recording&, ReplaySettings& s) { s.score_from = 3; }).find("--from, --until: "),
      std::string::npos);
}

TEST(Replay, AClampThatHoldsTheSlopeConvergesWithTheSquareOfTheCell) {
  // A strip carried by its end; places held alone leave the slope to one cell: first order.
  data::Recording recording;
  recording.name = recording.source = "strip";
  recording.has_table = true;
  recording.keyframes = {};
  data::RecordedGrasp grasp;
  grasp.gripper = "gripper";
  grasp.select.corner = {1, 1};
  grasp.select.within = 0.0501;
  recording.grasps = {grasp};
  data::Trajectory& path = recording.trajectories["gripper"];
  for (int i = 0; i <= 30; ++i) {
    path.times.push_back(0.01 * i);
    path.poses.emplace_back(Eigen::Translation3d(0.175, 0.025, 0.04 * i / 30));
  }
  data::SheetMaterial material;
  material.membrane_stiffness = 30;
  material.bending_rigidity = 2e-4;
  const auto height = [&](double cell, bool slopes) {  // of the middle of the strip, in the end
    Replay replay;
    replay.recording = recording;
    replay.recording.mesh = data::parse_mesh_spec("sheet:0.2x0.05:" + std::to_string(cell));
    replay.recording.start = replay.recording.mesh.vertices;
    sim::Sheet sheet = sim::make_sheet(replay.recording.mesh);
    if (slopes) stiffen_clamped(replay, sheet);
    replay.plan = sim::make_sheet_plan(sheet);
    replay.steps = 30;
    replay.schedule = gripper_schedule(replay);
    data::Points last;
    run(replay, {{material, {}}}, {replay.steps},
        [&](std::size_t, ReplayResult result) { last = result.motion.positions.back(); });
    for (Eigen::Index i = 0; i < last.rows(); ++i)
      if ((replay.recording.mesh.vertices.row(i) - Eigen::RowVector3d(0.1, 0, 0)).norm() < 1e-9)
        return last(i, 2);
    return 0.0;
  };
  for (const bool slopes : {false, true}) {
    const double coarse = height(0.025, slopes), middle = height(0.0125, slopes),
                 fine = height(0.00625, slopes);
    const double order = std::log2(std::abs((coarse - middle) / (middle - fine)));
    EXPECT_EQ(order > 1.5, slopes) << order;
  }
}

// Files are not read again: they may be gone.
TEST(Replay, UnderOtherSettingsIsThatOfItsFilesWithoutThem) {
  const data::TemporaryFolder folder;
  Replay replay = short_lift(folder, "sheet:0.2x0.05:0.025:alternating");
  ReplaySettings settings = replay.settings;
  settings.mesh = "sheet:0.2x0.05:0.0125:alternating";
  settings.solver.time_step *= 0.5;
  const Replay read = make_replay(data::load_recording(folder / "lift"), settings);
  replay.observations[3].weight = 0.5;
  Mark mark;  // the middle of an edge from the corner
  mark.triangle = 0;
  mark.barycentric = {0.5, 0.5, 0};
  replay.observations[3].marks = {mark};
  std::filesystem::remove_all(folder / "lift");
  const Replay made = make_replay(replay, settings);
  EXPECT_EQ(made.sheet().rest.vertices, read.sheet().rest.vertices);
  EXPECT_EQ(made.steps, read.steps);
  EXPECT_EQ(made.start, read.start);
  ASSERT_EQ(made.observations.size(), read.observations.size());
  for (std::size_t k = 0; k < read.observations.size(); ++k) {
    EXPECT_EQ(made.observations[k].t, read.observations[k].t);
    EXPECT_EQ(made.observations[k].points, read.observations[k].points);
    EXPECT_EQ(made.observations[k].weight, k == 3 ? 0.5 : read.observations[k].weight);
  }
  const data::TriangleMesh& coarse = replay.recording.mesh;
  const Eigen::RowVector3d middle =
      0.5 * (coarse.vertices.row(coarse.triangles(0, 0)) + coarse.vertices.row(coarse.triangles(0, 1)));
  const Mark& found = made.observations[3].marks[0];
  EXPECT_LT((mark_position(found, corners_of(made.surface.vertices, made.surface.triangles, found.triangle)) -
             middle.transpose())
                .norm(),
            1e-12);
}

}  // namespace
}  // namespace flash::sysid
