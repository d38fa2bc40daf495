// The shipped scenes, coarser where they would take long.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>
#include <vector>

#include "apps/sim/scene_run.h"
#include "data/mesh/mesh_io.h"
#include "data/mesh/procedural_mesh.h"
#include "data/scene/scene.h"
#include "sim/pairs/intersection.h"

namespace flash::sim {
namespace {

namespace fs = std::filesystem;

/// One thing in the text of a file, and what takes its place.
struct Change {
  std::string from, to;
};

class ExampleScenes : public testing::Test {
 protected:
  ExampleScenes()
      : folder_(
            fs::temp_directory_path() /
            ("flash_example_" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()))) {
    fs::remove_all(folder_);
    for (const char* part : {"assets", "scenes"}) fs::create_directories(folder_ / part);
  }
  ~ExampleScenes() override { fs::remove_all(folder_); }

  /// Takes a file of the examples over, with some changes.
  void take(const std::string& name, const std::vector<Change>& changes = {}) {
    std::ifstream in(fs::path(FLASH_EXAMPLES) / name);
    std::string text(std::istreambuf_iterator<char>(in), {});
    for (const Change& change : changes) {
      const std::size_t at = text.find(change.from);
      ASSERT_NE(at, std::string::npos) << name << ": " << change.from;
      text.replace(at, change.from.size(), change.to);
    }
    std::ofstream(folder_ / name) << text;
  }

  /// Runs a scene that was taken over, into a folder of its own.
  SceneSummary run(const std::string& scene, int steps, const std::string& out, double tolerance = 1e-3) {
    data::Scene read = data::load_scene((folder_ / scene).string());
    read.steps = steps;
    read.solver.tolerance = tolerance;
    return run_scene(read, {}, (folder_ / out).string());
  }

  /// Where all vertices are in a frame, those inside of solids too.
  data::Points frame(const std::string& out, int step) const {
    char name[32];
    std::snprintf(name, sizeof name, "frames/%06d.ply", step);
    return data::load_geometry((folder_ / out / name).string()).points;
  }

  /// The last force of a body along z [N].
  double last_force(const std::string& out, const std::string& body) const {
    std::ifstream in(folder_ / out / "forces.csv");
    double force = 0;
    for (std::string line; std::getline(in, line);) {
      std::istringstream stream(line);
      std::vector<std::string> words;
      for (std::string word; std::getline(stream, word, ',');) words.push_back(word);
      if (words.at(1) == body) force = std::stod(words.at(4));
    }
    return force;
  }

  fs::path folder_;
};

TEST_F(ExampleScenes, SticksAndSlipsOnTenDegrees) {
  constexpr double g = 9.81, h = 0.01, friction = 0.1753, tolerance = 1e-6;
  constexpr int steps = 100;
  const double slope = 10 * M_PI / 180;
  for (const char* name : {"assets/incline_cloth.json", "assets/incline_cloth_beside.json",
                           "scenes/incline_stick.json", "scenes/incline_slip.json"})
    take(name);
  const auto slid = [&](const std::string& scene) {
    EXPECT_EQ(run("scenes/" + scene + ".json", steps, scene, tolerance).unconverged_steps, 0);
    const data::Points moved = frame(scene, steps) - frame(scene, 0);
    return moved.colwise().mean().norm();
  };
  EXPECT_LT(slid("incline_stick"), 2e-6);  // bristles of 1e-6 m, which tan(alpha) / mu of it bends
  const double expected =
      g * (std::sin(slope) - friction * std::cos(slope)) * h * h * steps * (steps + 1) / 2;
  // What drives it is a thousandth of the weight, a thousand times the tolerance; and it starts by its
  // bristles.
  EXPECT_NEAR(slid("incline_slip"), expected, 1e-3 * expected + 2e-6);
}

TEST_F(ExampleScenes, ASoftGripperHoldsASoftCube) {
  take("scenes/gripper.json");
  take("assets/soft_finger.json", {{":0.0075", ":0.015"}});
  take("assets/soft_cube.json", {{":0.006", ":0.01"}});
  constexpr int steps = 160, cube_vertices = 4 * 4 * 4;
  constexpr double lift = 0.08, cube_weight = 1000 * 0.03 * 0.03 * 0.03 * 9.81,
                   finger_weight = 1000 * 0.016 * 0.03 * 0.06 * 9.81;
  EXPECT_EQ(run("scenes/gripper.json", steps, "out").unconverged_steps, 0);
  EXPECT_EQ(last_force("out", "table"), 0);
  const double carried = last_force("out", "left_hand") + last_force("out", "right_hand");
  EXPECT_NEAR(carried, cube_weight + 2 * finger_weight, 2e-3 * carried);  // the tolerance, twice
  const auto height = [&](int step) { return frame("out", step).topRows(cube_vertices).col(2).mean(); };
  EXPECT_NEAR(height(120) - height(60), lift, 0.05 * lift);
}

/// The first fold, on a coarse mesh: the hand lays the sleeve over the front, every step is solved, and
/// nothing passes through.
TEST_F(ExampleScenes, ATShirtsSleeveIsFolded) {
  take("scenes/tshirt_fold.json");
  take("assets/tshirt.json", {{":0.0138", ":0.0425"}});
  constexpr int steps = 300;
  constexpr double thickness = 1e-3;
  const SceneSummary summary = run("scenes/tshirt_fold.json", steps, "out");
  EXPECT_EQ(summary.unconverged_steps, 0);
  EXPECT_GT(summary.layer_distance_min, 0.5 * thickness);
  // Most steps take the sleeve over the front: about eight iterations each.
  EXPECT_LT(summary.iterations, 12 * steps);
  PairSurface surface(make_sheet(data::parse_mesh_spec("tshirt:0.0425")));
  for (const int step : {100, 200, 300})
    EXPECT_FALSE(first_intersection(surface, frame("out", step))) << step;
  const data::Points start = frame("out", 0);
  const auto cuff = [&](int step) {
    const data::Points end = frame("out", step);
    Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
    int count = 0;
    for (Eigen::Index i = 0; i < start.rows(); ++i) {
      if (start(i, 0) > -0.409) continue;
      ++count;
      sum += end.row(i);
    }
    EXPECT_GT(count, 4);
    return Eigen::RowVector3d(sum / count);
  };
  // Where the hand is, within the thickness of both layers of the sleeve: on its way, and above both layers
  // of the front at its end.
  EXPECT_LT((cuff(100) - Eigen::RowVector3d(-0.3774, cuff(0)[1], 0.1000)).norm(), 2 * thickness);
  EXPECT_LT((cuff(300) - Eigen::RowVector3d(-0.0751, cuff(0)[1], 0.0033)).norm(), 2 * thickness);
  EXPECT_GT(cuff(300)[2], 2 * thickness);
}

/// The published method on two local-global and two contact iterations stays bounded, at ten times the speed.
TEST_F(ExampleScenes, TwoPlusTwoIterationsStayBounded) {
  take("scenes/two_plus_two.json");
  take("assets/towel.json");
  constexpr int steps = 150;
  const SceneSummary budget = run("scenes/two_plus_two.json", steps, "budget");
  EXPECT_EQ(budget.unconverged_steps, steps);  // and says so
  take("scenes/two_plus_two.json", {{R"("type": "projective", "iterations": 2)", R"("type": "newton")"}});
  const SceneSummary exact = run("scenes/two_plus_two.json", steps, "exact");
  EXPECT_EQ(exact.unconverged_steps, 0);
  const double diagonal = 0.3 * std::sqrt(2.0), lifted = 0.25;
  const auto reach = [&](const std::string& out, int step) {
    return (frame(out, step).rowwise() - Eigen::RowVector3d(0.25, 0.25, lifted)).rowwise().norm().maxCoeff();
  };
  // A towel that does not stretch reaches its diagonal; that of the budget lags behind, and stays on the
  // scale of the scene.
  EXPECT_LT(reach("exact", steps), 1.05 * diagonal);
  for (const int step : {10, 20, 50, 100, 150}) EXPECT_LT(reach("budget", step), 2 * diagonal) << step;
  EXPECT_GT(budget.penetration_max, 1e-4);
  EXPECT_LT(exact.penetration_max, 1e-9);
}

}  // namespace
}  // namespace flash::sim
