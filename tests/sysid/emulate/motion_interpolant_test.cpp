#include "sysid/emulate/motion_interpolant.h"

#include <gtest/gtest.h>

#include <cmath>

#include "sysid/emulate/sensitivity.h"
#include "sysid/emulate/two_mesh_motions.h"
#include "sysid/replay/half_cell.h"
#include "tests/sysid/short_lift.h"

namespace flash::sysid {
namespace {

TEST(MotionInterpolant, IsExactForMotionsCubicInTheCoordinates) {
  const std::vector<Axis> axes = {parse_axis("friction", "0.1,0.2,0.45,0.5,0.9"),
                                  parse_axis("bending", "1e-5:1e-3:6:log"), parse_axis("poisson", "0.3")};
  const auto motion_at = [](const std::vector<double>& p) {
    const double x = p[0], y = std::log(p[1]);
    Motion motion{0.1, 0.02, {data::Points::Zero(2, 3), data::Points(0, 3), data::Points::Zero(2, 3)}, {}};
    motion.positions[0](1, 2) = x * x * x - 2 * x * y;
    motion.positions[2](0, 0) = y * y * y + x * x * y * y - 3;
    motion.forces = {{x, y, 1}, {x * y * y, 2, x * x * x * y}};
    return motion;
  };
  std::vector<Motion> motions;
  for (const std::vector<double>& point : cartesian_product(axes)) motions.push_back(motion_at(point));
  const MotionInterpolant surface(axes, motions), by_four_threads(axes, motions, 4);
  for (const std::vector<double>& point : std::vector<std::vector<double>>{
           {0.33, 2.2e-5, 0.3}, {0.1, 1e-3, 0.3}, {0.88, 1.7e-4, 0.3}, {0.2, 4e-5, 0.3}}) {
    const Motion found = surface.at(point), expected = motion_at(point);
    ASSERT_EQ(found.positions.size(), 3u);
    EXPECT_EQ(found.positions[1].rows(), 0);
    EXPECT_EQ(by_four_threads.at(point).positions, found.positions);
    for (const int i : {0, 2}) EXPECT_LT((found.positions[i] - expected.positions[i]).norm(), 1e-10);
    for (const int i : {0, 1}) EXPECT_LT((found.forces[i] - expected.forces[i]).norm(), 1e-10);
  }
}

struct Lift {
  data::TemporaryFolder folder;
  Replay replay = short_lift(folder, "sheet:0.2x0.05:0.0125:alternating");
  GridSettings grid;
  Lift() {
    grid.base.material = short_lift_material();
    grid.axes = {parse_axis("bending", "1e-4:1e-3:5:log")};
    grid.rollouts = folder / "rollouts";
  }
};

TEST(TwoMeshMotions, IsTheFinerSimulationWhereThatWasMade) {
  const Lift lift;
  const MotionStore store(lift.grid.rollouts);
  const auto model = with_finer_mesh(lift.replay, on_half_the_cell(lift.replay),
                                     *motion_interpolant(lift.replay, lift.grid, store),
                                     thinned(lift.grid.axes), lift.grid, store);
  ASSERT_TRUE(model);
  const data::TriangleMesh& fine = model->replay.recording.mesh;
  EXPECT_EQ(fine.vertices.rows(), 33 * 9);
  const Eigen::SparseMatrix<double> matrix = prolongation(lift.replay.recording.mesh, fine);
  EXPECT_LT((matrix * lift.replay.recording.mesh.vertices - fine.vertices).norm(), 1e-12);
  for (const Axis& axis : thinned(lift.grid.axes))
    for (const double bending : axis.values) {
      const ReplayCandidate candidate = candidate_at({bending}, lift.grid);
      const Motion finer = store.run(model->replay, candidate).motion,
                   own = store.run(lift.replay, candidate).motion;
      const Motion modelled = model->model.at({bending}, 1), coarse = model->model.at({bending}, 0);
      for (std::size_t i = 0; i < finer.positions.size(); ++i) {
        if (modelled.positions[i].rows() == 0) continue;  // read by no keyframe
        EXPECT_LT((modelled.positions[i] - finer.positions[i]).norm(), 1e-12);
        EXPECT_LT((coarse.positions[i] - matrix * own.positions[i]).norm(), 1e-12);
      }
    }
}

TEST(TwoMeshMotions, OneFinerSimulationMovesEveryMotionByWhatItHasBeyondTheOwn) {
  const Lift lift;
  const MotionStore store(lift.grid.rollouts);
  const MotionInterpolant own = *motion_interpolant(lift.replay, lift.grid, store);
  const std::vector<Axis> point = {{"bending", {2e-4}, true}};
  const auto model =
      with_finer_mesh(lift.replay, on_half_the_cell(lift.replay), own, point, lift.grid, store);
  ASSERT_TRUE(model);
  const auto beyond = [&](double bending) {
    Motion difference = model->model.at({bending}, 1);
    add(difference, -1, model->model.at({bending}, 0));
    return difference.positions.front();
  };
  const Motion finer = store.run(model->replay, candidate_at({2e-4}, lift.grid)).motion;
  EXPECT_LT((model->model.at({2e-4}, 1).positions.front() - finer.positions.front()).norm(), 1e-12);
  EXPECT_LT((beyond(7e-4) - beyond(2e-4)).norm(), 1e-12);
}

}  // namespace
}  // namespace flash::sysid
