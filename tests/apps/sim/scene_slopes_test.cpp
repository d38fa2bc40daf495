// A strip that a clamp holds out against gravity, against the beam of Euler and Bernoulli.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "apps/sim/scene_run.h"
#include "data/files/error.h"
#include "data/files/text.h"
#include "data/mesh/mesh_io.h"
#include "data/scene/scene.h"
#include "tests/apps/sim/scene_run_fixture.h"

namespace flash::sim {
namespace {

constexpr double length = 0.1, density = 0.2, gravity = 9.81;
constexpr double bending = 10 * density * gravity * length * length * length;  // sags by 1/80 of its length

class SceneSlopesTest : public SceneRunTest {
 protected:
  /// The asset strip.json: `cells` a length and one more that is held, two wide.
  int write_strip(const std::string& model, int cells) {
    const double cell = length / cells;
    const auto number = [](double value) { return data::format_number(value); };
    write("strip.json",
          R"({"schema": "flash-asset/1", "element_type": "TRIANGLE", "mesh": "sheet:)" +
              number(length + cell) + "x" + number(2 * cell) + ":" + number(cell) +
              (model == "plate" ? "" : ":alternating_by_row") +  // the mesh on which D of the others is D
              R"(", "mechanical_props": {"constitutive": "TRI_COROTATED", "areal_density": 0.2, "poisson": 0,
      "young": )" +
              number(2e4 * density * gravity * length) +  // stretches by 2.5e-5
              R"(, "bending_model": ")" + model + R"(", "bending_rigidity": )" + number(bending) + "}}");
    return cells + 2;  // columns
  }

  /// The vertices of the first two columns.
  static std::string clamp(int columns) {
    std::string list;
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column < 2; ++column)
        list += (list.empty() ? "[" : ", ") + std::to_string(row * columns + column);
    return list + "]";
  }

  /// `rest`: of the object, after its asset; `hands`: of the scene.
  SceneSummary run(const std::string& rest, const std::string& hands = "") {
    const std::string path = write(
        "scene.json", R"({"schema": "flash-scene/1", "gravity": [0, 0, -9.81], "timestep": 1, "steps": 40,
      "quasistatic": {"motion": 1e-9}, "solver": {"tolerance": 1e-5},
      "objects": {"strip": {"asset": "strip.json")" +
                          rest + "}}" + hands + "}");
    return run_scene(data::load_scene(path), {}, out());
  }

  std::string refusal(const std::string& rest, const std::string& hands = "") {
    try {
      run(rest, hands);
    } catch (const data::InputError& error) {
      return error.what();
    }
    return "";
  }

  /// By how much the tip of the last frame sags more than the beam's rho_A g L^4 / (8 D).
  double too_soft(int columns) const {
    std::filesystem::path last;
    for (const auto& entry : std::filesystem::directory_iterator(folder_ / "out" / "frames"))
      last = std::max(last, entry.path());
    const data::Points x = data::load_triangle_mesh(last.string()).vertices;
    double tip = 0;
    for (int row = 0; row < 3; ++row) tip -= x(row * columns + columns - 1, 2) / 3;
    return tip / (density * gravity * std::pow(length, 4) / (8 * bending)) - 1;
  }
};

bool tells_of_slopes(const SceneSummary& summary) {
  for (const std::string& notice : summary.notices)
    if (notice.find("\"slopes\": true") != std::string::npos) return true;
  return false;
}

// Within (4 / 3) / 40^2 of the cells' error and 1e-4 of the sag's square; twice that of the hinges.
TEST_F(SceneSlopesTest, AClampedStripIsTheBeam) {
  for (const std::string model : {"plate", "hinge", "isometric"}) {
    const int columns = write_strip(model, 40);
    const SceneSummary summary =
        run(R"(, "fixed": [{"vertices": )" + clamp(columns) + R"(, "slopes": true}])");
    EXPECT_FALSE(tells_of_slopes(summary)) << model;
    EXPECT_TRUE(summary.at_rest.value_or(false)) << model;
    EXPECT_LT(std::abs(too_soft(columns)), 0.003) << model << ' ' << too_soft(columns);
  }
}

// What places alone do: the strip is longer by a part of a cell.
TEST_F(SceneSlopesTest, WithoutSlopesTheStripIsTooSoftAndANoticeSaysSo) {
  const double expected[] = {0.2538, 0.1233};
  for (int k = 0; k < 2; ++k) {
    const int columns = write_strip("plate", 10 << k);
    const SceneSummary summary = run(R"(, "fixed": [{"vertices": )" + clamp(columns) + "}]");
    EXPECT_TRUE(tells_of_slopes(summary));
    EXPECT_NEAR(too_soft(columns), expected[k], 1e-3);
    run(R"(, "fixed": [{"vertices": )" + clamp(columns) + R"(, "slopes": true}])");
    EXPECT_LT(std::abs(too_soft(columns)), 1.5 / std::pow(10 << k, 2));
  }
}

TEST_F(SceneSlopesTest, PrescribedMotionsAndGraspsKeepSlopesToo) {
  const int columns = write_strip("plate", 20);
  const std::string still = R"("keyframes": [{"t": 0, "translation": [0.0025, 0.005, 0]}])";
  EXPECT_FALSE(tells_of_slopes(
      run(R"(, "prescribed": [{"vertices": )" + clamp(columns) + R"(, "slopes": true, )" + still + "}]")));
  EXPECT_LT(std::abs(too_soft(columns)), 0.005);
  const auto hand = [&](const std::string& slopes) {
    return R"(, "end_effectors": {"hand": {"size": [0.0051, 0.02, 0.001], )" + still +
           R"(, "grasps": [{"threshold": 0)" + slopes + "}]}}";
  };
  EXPECT_FALSE(tells_of_slopes(run("", hand(R"(, "slopes": true)"))));
  EXPECT_LT(std::abs(too_soft(columns)), 0.005);
  EXPECT_TRUE(tells_of_slopes(run("", hand(""))));
  EXPECT_GT(too_soft(columns), 0.1);
}

// Its dynamics come to rest by the drag of the air, from sagging by a sixteenth of the length.
TEST_F(SceneSlopesTest, TheProjectiveSolverKeepsThemToo) {
  const std::string membrane = data::format_number(200 * density * gravity * length);
  write("soft.json",
        R"({"schema": "flash-asset/1", "element_type": "TRIANGLE", "mesh": "sheet:0.11x0.02:0.01",
    "mechanical_props": {"constitutive": "TRI_ARAP", "areal_density": 0.2, "poisson": 0, "air_drag": 5, "young": )" +
            membrane + R"(, "bending_rigidity": )" + data::format_number(bending / 5) + "}}");
  const auto sag = [&](const std::string& slopes) {
    const std::string path = write("projective.json", R"({"schema": "flash-scene/1", "gravity": [0, 0, -9.81],
      "timestep": 0.01, "steps": 300, "keyframes": [3], "solver": {"type": "projective", "tolerance": 1e-4,
      "iterations": 400}, "objects": {"strip": {"asset": "soft.json", "fixed": [{"vertices": )" +
                                                          clamp(12) + slopes + "}]}}}");
    run_scene(data::load_scene(path), {}, out());
    return (too_soft(12) + 1) / 5;
  };
  // Of a plate within (4 / 3) / 10^2, and of a beam whose sag is that large within a hundredth.
  EXPECT_NEAR(sag(R"(, "slopes": true)"), 1, 0.02);
  EXPECT_GT(sag(""), 1.2);
}

TEST_F(SceneSlopesTest, NothingIsSaidWhereNothingBendsAboutAHold) {
  const int columns = write_strip("plate", 10);
  EXPECT_FALSE(tells_of_slopes(run(R"(, "fixed": [{"vertices": "all"}])")));
  EXPECT_FALSE(tells_of_slopes(run(R"(, "fixed": [{"vertices": [0, 1]}, {"vertices": [2], "axes": "z"}])")));
  EXPECT_FALSE(tells_of_slopes(run(R"(, "fixed": [{"vertices": )" + clamp(columns) + R"(, "axes": "yz"}])")));
  // Two supports that stand still are one clamp.
  EXPECT_TRUE(tells_of_slopes(run(R"(, "fixed": [{"vertices": [0, 12, 24]}, {"vertices": [1, 13, 25]}])")));
}

TEST_F(SceneSlopesTest, WhatCannotKeepThemIsRefused) {
  const int columns = write_strip("plate", 10);
  const std::string scene = (folder_ / "scene.json").string();
  EXPECT_EQ(refusal(R"(, "fixed": [{"vertices": [0, 12, 24], "slopes": true}])"),
            scene +
                ": objects.strip.fixed.slopes: found no triangle of which it holds all vertices, expected a "
                "patch a cell wide at least: a row of vertices has no slope");
  EXPECT_NE(refusal(R"(, "fixed": [{"vertices": [0, 1, 12], "axes": "z", "slopes": true}])")
                .find("what rolls keeps no slope"),
            std::string::npos);
  EXPECT_EQ(refusal(R"(, "prescribed": [{"vertices": )" + clamp(columns) +
                    R"(, "slopes": true, "from": 2, "keyframes": [{"t": 0}]}])"),
            scene +
                ": objects.strip.prescribed.slopes: found a hold from 2 s to 40 s, expected one that acts in "
                "every step, to 40 s");
  EXPECT_NE(
      refusal("", R"(, "end_effectors": {"hand": {"keyframes": [{"t": 0}],
    "grasps": [{"to": 3, "slopes": true}]}})")
          .find("end_effectors.hand.grasps.slopes: found a hold from 0 s to 3 s, expected one that acts "
                "in every step"),
      std::string::npos);
  EXPECT_NE(refusal("", R"(, "end_effectors": {"hand": {"keyframes": [{"t": 0}],
    "grasps": [{"zero_length": true, "slopes": true}]}})")
                .find("what is pulled into a point has no slope"),
            std::string::npos);
  const std::string bent = R"(, "fixed": [{"vertices": [0, 12, 1, 13, 2, 14], "slopes": true,
    "positions": [[0, 0, 0], [0, 0.01, 0], [0.01, 0, 0], [0.01, 0.01, 0], [0.02, 0, 0.001], [0.02, 0.01, 0.001]]}])";
  EXPECT_NE(refusal(bent).find("objects.strip: found a bend of 5.711 degrees within what holds with slopes "
                               "carry, expected a flat patch, or bending_model hinge"),
            std::string::npos)
      << refusal(bent);
  write_strip("hinge", 10);
  EXPECT_EQ(refusal(bent), "");
  write("strip.json", R"({"schema": "flash-asset/1", "mesh": "box:0.04x0.02x0.02:0.02",
    "element_type": "TETRAHEDRON", "mechanical_props": {"constitutive": "TET_NEOHOOKEAN", "density": 1000,
    "young": 1e5, "poisson": 0.3}})");
  EXPECT_NE(refusal(R"(, "fixed": [{"vertices": [0, 1, 2], "slopes": true}])")
                .find("objects.strip.fixed.slopes: found true, expected false for strip, a solid"),
            std::string::npos);
}

}  // namespace
}  // namespace flash::sim
