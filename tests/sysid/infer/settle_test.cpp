#include "sysid/infer/settle.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "data/procedural_mesh.h"
#include "sysid/capture/render_depth.h"
#include "sysid/capture/synth.h"
#include "sysid/emulate/fingerprint.h"
#include "sysid/infer/answer.h"
#include "tests/data/temporary_folder.h"

namespace flash::sysid {
namespace {

data::SheetMaterial cloth() {
  data::SheetMaterial material;
  material.membrane_stiffness = 100;
  material.bending_rigidity = 3e-5;
  return material;
}

/// A corner lifted within a second, seen at three times, and searched for three parameters on the mesh that
/// it was made on, with no candidate near the truth.
Answer answer_of_three_keyframes(unsigned seed) {
  constexpr const char* mesh = "sheet:0.3x0.3:0.03:alternating";
  const data::TemporaryFolder folder;
  SynthSettings settings;
  settings.name = "lift";
  settings.duration = 1;
  settings.keyframe_rate = 2;
  settings.seed = seed;
  SynthCamera camera;
  camera.intrinsics.width = 160;
  camera.intrinsics.height = 120;
  camera.intrinsics.fx = camera.intrinsics.fy = 160 / 2 / std::tan(M_PI / 6);
  camera.intrinsics.cx = 79.5;
  camera.intrinsics.cy = 59.5;
  camera.base_from_camera = look_at({0.15, -0.525, 0.57}, {0.15, 0.15, 0.09}, Eigen::Vector3d::UnitZ());
  settings.cameras = {camera};
  SynthRecording made = synthesize(data::parse_mesh_spec(mesh), mesh, cloth(), settings, {});
  save_synthetic(made, folder / "lift");
  std::vector<Replay> replays = {make_replay(data::load_recording(folder / "lift"), {})};
  GridSettings grid;
  grid.base.material = cloth();
  grid.axes = {parse_axis("young", "30:300:3:log"), parse_axis("bending", "3e-6:3e-4:4:log"),
               parse_axis("friction", "0.1:0.6:3")};
  grid.rollouts = folder / "motions";
  ResultsStore store(folder / "run", grid.axes, {"lift"}, fingerprint(replays, grid), Existing::refuse);
  EXPECT_TRUE(grid_search(replays, grid, store));
  GridResults results = store.results();
  return find_answer(results, replays, grid, {});
}

// Cells of no size miss such a recording by millimetres. By how little a row then counts, no motion of the
// search's own mesh would be likelier, though it misses by the noise alone.
TEST(Settle, AModelThatMissesByFarMoreThanNoiseIsNotTheMeasureOfOneThatDoesNot) {
  constexpr std::array<double, 3> truth = {100, 3e-5, 0.3};
  const Answer answer = answer_of_three_keyframes(1);
  EXPECT_TRUE(std::any_of(answer.warnings.begin(), answer.warnings.end(), [](const std::string& warning) {
    return warning.find("the answer is of that mesh") != std::string::npos;
  }));
  ASSERT_EQ(answer.parameters.size(), truth.size());
  for (std::size_t k = 0; k < truth.size(); ++k) {
    const ParameterFinding& finding = answer.parameters[k];
    EXPECT_EQ(finding.identifiable, Identifiable::yes) << finding.name;
    EXPECT_LT((*finding.interval95)[0], truth[k]) << finding.name;
    EXPECT_GT((*finding.interval95)[1], truth[k]) << finding.name;
  }
}

}  // namespace
}  // namespace flash::sysid
