#include "sysid/replay/motion_store.h"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/sha256.h"
#include "data/mesh/procedural_mesh.h"
#include "sysid/capture/render_depth.h"
#include "sysid/capture/synth.h"
#include "sysid/emulate/grid_search.h"
#include "sysid/emulate/sensitivity.h"
#include "tests/data/temporary_folder.h"

namespace flash::sysid {
namespace {

constexpr const char* kMesh = "sheet:0.3x0.3:0.05:alternating";

data::SheetMaterial towel() {
  data::SheetMaterial material;
  material.membrane_stiffness = 30;
  material.bending_rigidity = 2e-4;
  return material;
}

/// A short recording of some kind, loaded back from its files.
Replay recorded(const data::TemporaryFolder& folder, const std::string& kind, unsigned seed,
                bool forces = false) {
  SynthSettings settings;
  settings.name = kind;
  settings.kind = kind;
  settings.duration = 0.6;
  settings.grasp_within = 0.05;
  settings.seed = seed;
  settings.forces = forces;
  SynthCamera camera;
  camera.intrinsics.width = 48;
  camera.intrinsics.height = 36;
  camera.intrinsics.fx = camera.intrinsics.fy = 40;
  camera.intrinsics.cx = 23.5;
  camera.intrinsics.cy = 17.5;
  camera.base_from_camera = look_at({0.15, -0.5, 0.6}, {0.15, 0.15, 0.05}, Eigen::Vector3d::UnitZ());
  settings.cameras = {camera};
  SynthRecording made = synthesize(data::parse_mesh_spec(kMesh), kMesh, towel(), settings, {});
  save_synthetic(made, folder / kind);
  return make_replay(data::load_recording(folder / kind), {});
}

int files_in(const std::string& folder) {
  return static_cast<int>(std::distance(std::filesystem::directory_iterator(folder), {}));
}

TEST(MotionStore, AKeptMotionScoresAsTheSimulatedOneBitForBit) {
  const data::TemporaryFolder folder;
  const Replay replay = recorded(folder, "corner_lift", 1, true);
  const MotionStore store(folder / "rollouts");
  const ReplayCandidate candidate{towel(), {}};
  const auto score = [&](const ReplayResult& result) { return score_motions({replay}, {result}, {}).score; };
  const double simulated = score(std::move(run(replay, {candidate}).front()));
  EXPECT_EQ(score(store.run(replay, candidate)), simulated);
  EXPECT_EQ(score(store.run(replay, candidate)), simulated);
  EXPECT_EQ(files_in(folder / "rollouts"), 1);
}

TEST(MotionStore, AnotherMotionIsAnotherFileAndAnotherNoiseIsNot) {
  const data::TemporaryFolder folder;
  const MotionStore store(folder / "rollouts");
  ReplayCandidate candidate{towel(), {}};
  store.run(recorded(folder, "corner_lift", 1), candidate);
  store.run(recorded(folder, "corner_lift", 2), candidate);  // the same motion seen anew
  EXPECT_EQ(files_in(folder / "rollouts"), 1);
  candidate.material.friction += 0.1;
  store.run(recorded(folder, "corner_lift", 1), candidate);
  EXPECT_EQ(files_in(folder / "rollouts"), 2);
  Replay layered = recorded(folder, "corner_lift", 1);
  layered.settings.self_contact = sim::SelfContact{.thickness = 1e-3, .friction = -1};
  store.run(layered, candidate);
  EXPECT_EQ(files_in(folder / "rollouts"), 3);
  candidate.material.bending_model = data::BendingModel::hinge;
  store.run(recorded(folder, "corner_lift", 1), candidate);
  candidate.material.yield_curvature = 20;
  store.run(recorded(folder, "corner_lift", 1), candidate);
  EXPECT_EQ(files_in(folder / "rollouts"), 5);
}

TEST(MotionStore, WhatIsPreparedIsThereOnceAndBitForBitThatOfARun) {
  const data::TemporaryFolder folder;
  const Replay replay = recorded(folder, "corner_lift", 1), dragged = recorded(folder, "drag", 1);
  const MotionStore prepared(folder / "prepared"), run(folder / "run");
  const ReplayCandidate here{towel(), {}};
  ReplayCandidate there = here;
  there.material.friction += 0.1;
  prepared.run(replay, here);
  const std::vector<WantedMotion> wanted = {
      {&replay, here}, {&replay, there}, {&dragged, here}, {&replay, there}};
  prepared.prepare(wanted);
  EXPECT_EQ(files_in(folder / "prepared"), 3);
  prepared.prepare(wanted);
  EXPECT_EQ(files_in(folder / "prepared"), 3);
  for (const WantedMotion& each : wanted) run.run(*each.replay, each.candidate);
  EXPECT_EQ(files_in(folder / "run"), 3);
  for (const auto& file : std::filesystem::directory_iterator(folder / "run"))
    EXPECT_EQ(data::read_file(file.path()),
              data::read_file(folder / ("prepared/" + file.path().filename().string())));
}

TEST(Replay, ACandidateThatNoDeviceSimulatesIsNamedAmongOthers) {
  const data::TemporaryFolder folder;
  const Replay replay = recorded(folder, "corner_lift", 1);
  const ReplayCandidate plain{towel(), {}};
  ReplayCandidate yields = plain, woven = plain;
  yields.material.yield_curvature = 20;
  woven.material.weave.young_ratio = 0.5;
  EXPECT_EQ(why_not_on_device(replay, {}), "");
  EXPECT_EQ(why_not_on_device(replay, {plain, plain}), "");
  EXPECT_NE(why_not_on_device(replay, {plain, yields}).find("yield_curvature"), std::string::npos);
  EXPECT_NE(why_not_on_device(replay, {plain, woven}).find("young_ratio"), std::string::npos);
}

TEST(MotionStore, RemovesWhatWasLeftByAProgramThatWasKilledADayAgo) {
  namespace fs = std::filesystem;
  const data::TemporaryFolder folder;
  const std::string left = folder.write("rollouts/KEY.rollout.12-0.tmp", "half a motion");
  const MotionStore beside_a_writer(folder / "rollouts");
  EXPECT_TRUE(fs::exists(left));
  fs::last_write_time(left, fs::file_time_type::clock::now() - std::chrono::hours(25));
  const MotionStore store(folder / "rollouts");
  EXPECT_FALSE(fs::exists(left));
}

TEST(MotionStore, AFileThatIsNotAsItWasWrittenIsSimulatedAgainAndAnotherIsNamed) {
  const data::TemporaryFolder folder;
  const Replay replay = recorded(folder, "corner_lift", 1);
  const MotionStore store(folder / "rollouts");
  ReplayCandidate candidate{towel(), {}};
  store.run(replay, candidate);
  const std::string file = std::filesystem::directory_iterator(folder / "rollouts")->path();
  const std::string whole = data::read_file(file);
  const auto message_of = [&](const std::string& content) {
    data::write_atomically(file, content);
    const std::string message = data::input_error_of([&] { store.run(replay, candidate); });
    return message.starts_with(file + ": ") ? message.substr(file.size() + 2) : message;
  };
  const std::size_t header = whole.find('\n') + 1 + 2 * 64;
  std::string flipped = whole;
  flipped[whole.size() / 2] = static_cast<char>(flipped[whole.size() / 2] ^ 1);
  const std::string bytes(64, '\xff');  // in place of the SHA-256
  for (const std::string& content :
       {std::string(), "flash-rollout/2\n" + whole.substr(header), whole.substr(0, header - 1),
        whole.substr(0, whole.size() / 2), whole + '0', flipped,
        whole.substr(0, header - 64) + bytes + whole.substr(header)}) {
    EXPECT_EQ(message_of(content), "");
    EXPECT_EQ(data::read_file(file), whole);
  }

  // Sound in itself, but of no vertices, or too short.
  const auto sealed = [&](const std::string& numbers) {
    return whole.substr(0, header - 64) + data::sha256(numbers) + numbers;
  };
  const std::size_t rows = header + 5 * sizeof(double) + 2;  // start, step, three figures; two flags
  std::string none = whole.substr(header);
  none.replace(rows - header, sizeof(std::int64_t), sizeof(std::int64_t), '\0');
  EXPECT_EQ(message_of(sealed(none)).find("vertices: found 0 x 3, expected 49 x 3"), 0u);
  EXPECT_EQ(message_of(sealed(whole.substr(header, 100))).find("length: "), 0u);
  EXPECT_EQ(message_of(sealed(whole.substr(header) + '0')).find("length: "), 0u);

  // Another motion under this name.
  std::filesystem::remove(file);
  candidate.material.friction += 0.1;
  store.run(replay, candidate);
  const std::string other = data::read_file(std::filesystem::directory_iterator(folder / "rollouts")->path());
  candidate.material.friction = towel().friction;
  EXPECT_EQ(message_of(other).find("key: "), 0u);
  EXPECT_EQ(message_of(whole), "");
}

/// Six of the towel, each with another friction.
std::vector<WantedMotion> six(const Replay& replay) {
  std::vector<WantedMotion> wanted;
  for (int i = 0; i < 6; ++i) {
    ReplayCandidate candidate{towel(), {}};
    candidate.material.friction += 0.02 * i;
    wanted.push_back({&replay, candidate});
  }
  return wanted;
}

TEST(MotionStore, SharesSimulateTheirOwnAndReadTheOthers) {
  const data::TemporaryFolder folder;
  const Replay replay = recorded(folder, "corner_lift", 1);
  const std::vector<WantedMotion> wanted = six(replay);
  std::array<std::atomic<int>, 2> simulated{};
  std::array<std::vector<double>, 2> ends;
  std::vector<std::thread> programs;
  for (int k = 0; k < 2; ++k)
    programs.emplace_back([&, k] {
      const MotionStore store(folder / "rollouts", {.index = k, .count = 2});
      store.prepare(wanted, [&, k] { ++simulated[static_cast<std::size_t>(k)]; });
      for (const WantedMotion& motion : wanted)
        ends[static_cast<std::size_t>(k)].push_back(
            store.run(replay, motion.candidate).motion.positions.back().sum());
    });
  for (std::thread& program : programs) program.join();
  EXPECT_EQ(simulated[0], 3);
  EXPECT_EQ(simulated[1], 3);
  EXPECT_EQ(ends[0], ends[1]);
  for (std::size_t i = 0; i < wanted.size(); ++i)
    EXPECT_EQ(ends[0][i], run(replay, {wanted[i].candidate}).front().motion.positions.back().sum());
}

TEST(MotionStore, AShareThatDoesNotComeIsSimulatedHere) {
  const data::TemporaryFolder folder;
  const Replay replay = recorded(folder, "corner_lift", 1);
  std::vector<std::string> told;
  const MotionStore store(folder / "rollouts",
                          {.index = 2, .count = 3, .patience = 0, .told = [&](const std::string& what) {
                             told.push_back(what);
                           }});
  store.prepare(six(replay));
  EXPECT_EQ(files_in(folder / "rollouts"), 6);
  EXPECT_EQ(told.size(), 2u);  // of each of the others, once
  for (const std::string& what : told)
    EXPECT_NE(what.find("of 3 came for 0 s: its share is simulated here"), std::string::npos) << what;
}

TEST(MotionStore, WithoutWaitingTheOwnShareIsKeptAndTheOthersAreMissing) {
  const data::TemporaryFolder folder;
  const Replay replay = recorded(folder, "corner_lift", 1);
  for (int k = 0; k < 3; ++k) {
    const MotionStore store(folder / "share" + std::to_string(k), {.index = k, .count = 3, .waits = false});
    EXPECT_THROW(store.prepare(six(replay)), OthersMissing);
    EXPECT_EQ(files_in(folder / "share" + std::to_string(k)), 2);
  }
  data::write_atomically((std::filesystem::directory_iterator(folder / "share2")->path()).string(), "torn");
  const MotionStore store(folder / "all", {.waits = false});
  EXPECT_EQ(store.take_from(folder / "share0"), 2);
  EXPECT_EQ(store.take_from(folder / "share1"), 2);
  EXPECT_EQ(store.take_from(folder / "share1"), 0);
  EXPECT_EQ(store.take_from(folder / "share2"), 1);
}

TEST(MotionStore, WhoWaitsForOthersStopsWhenAsked) {
  const data::TemporaryFolder folder;
  Replay replay = recorded(folder, "corner_lift", 1);
  std::atomic<bool> stop = false;
  replay.settings.solver.stop = &stop;
  const MotionStore store(folder / "rollouts", {.index = 0, .count = 2});
  int simulated = 0;
  EXPECT_THROW(store.prepare(six(replay), [&] { stop = ++simulated == 3; }), data::Stopped);
  EXPECT_EQ(files_in(folder / "rollouts"), 3);
}

TEST(Sensitivity, ExplainsTheMotionOfAnotherParameterByThatParameter) {
  const data::TemporaryFolder folder;
  GridSettings grid;
  grid.base.material = towel();
  grid.axes = {parse_axis("bending", "1e-4:4e-4:2:log"), parse_axis("friction", "0.2:0.5:2")};
  const std::vector<double> values = {2e-4, 0.35};
  const std::vector<Replay> replays = {recorded(folder, "corner_lift", 1)};
  const Sensitivity sensitivity = measure_sensitivity(replays, grid, values);
  const std::vector<ReplayResult> other = run(replays[0], {candidate_at({2e-4 * 1.05, 0.35}, grid)});
  const Eigen::VectorXd found =
      explain(sensitivity, displacements(sensitivity, replays, other), Eigen::Vector2d(std::log(4.0), 0.3));
  // Half the step of the differences: what is not linear over 10 % is a few per cent of 5 %.
  EXPECT_NEAR(found[0], std::log(1.05), 0.005);
  EXPECT_NEAR(found[1], 0, 0.01);
}

TEST(Sensitivity, APullTellsYoungsModulusByItsForceAlone) {
  const data::TemporaryFolder folder;
  GridSettings grid;
  grid.base.material = towel();
  grid.axes = {parse_axis("young", "15:60:2:log")};
  const auto strength = [&](bool forces) {
    const std::vector<Replay> replays = {recorded(folder, "bar_pull", 1, forces)};
    return measure_sensitivity(replays, grid, {30}).parameters.norm();
  };
  // 3 N at 10 % of strain, 20 mN a millimetre: decimetres. The shape moves by a fraction of a millimetre.
  EXPECT_GT(strength(true), 20 * strength(false));
}

}  // namespace
}  // namespace flash::sysid
