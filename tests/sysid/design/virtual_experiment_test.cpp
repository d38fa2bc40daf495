#include "sysid/design/virtual_experiment.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "data/mesh/procedural_mesh.h"
#include "tests/data/temporary_folder.h"

namespace flash::sysid {
namespace {

data::SheetMaterial towel() {
  data::SheetMaterial material;
  material.membrane_stiffness = 30;
  material.bending_rigidity = 2e-4;
  return material;
}

/// A recording whose rest sheet lies anywhere.
data::Recording some_recording() {
  data::Recording recording;
  recording.mesh_spec = "sheet:0.2x0.2:0.05:alternating";
  recording.mesh = data::parse_mesh_spec(recording.mesh_spec);
  recording.mesh.vertices.rowwise() += Eigen::RowVector3d(-0.1, -0.1, 0);
  return recording;
}

class VirtualExperiment : public testing::TestWithParam<const char*> {};

TEST_P(VirtualExperiment, BeginsWithTheSheetOnTheTableAndLeavesNoFiles) {
  const Replay replay = virtual_experiment(GetParam(), some_recording(), towel(), {});
  EXPECT_EQ(replay.recording.kind, GetParam());
  EXPECT_LE(replay.observations.back().t, longest_virtual_experiment);
  EXPECT_FALSE(std::filesystem::exists(replay.recording.source));
  const data::Points& first = replay.observations.front().points;
  ASSERT_GT(first.rows(), 100);
  // Without noise all points are on it; clouds keep floats, 1e-7 of a length below 1 m.
  EXPECT_LT(first.col(2).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_GT(first.leftCols(2).minCoeff(), -1e-6);
  EXPECT_LT(first.leftCols(2).maxCoeff(), 0.2 + 1e-6);
}

INSTANTIATE_TEST_SUITE_P(All, VirtualExperiment, testing::ValuesIn(virtual_experiments));

TEST(VirtualExperiments, OfAnUnknownKindIsRefused) {
  EXPECT_EQ(data::input_error_of([] { virtual_experiment("fold", some_recording(), towel(), {}); }),
            "--kind: found fold, expected corner_lift, hang, drag, bar_pull or bias_pull");
}

}  // namespace
}  // namespace flash::sysid
