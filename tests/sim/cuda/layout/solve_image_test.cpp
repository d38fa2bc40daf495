#include "sim/cuda/layout/solve_image.h"

#include <gtest/gtest.h>

#include <cstring>
#include <numeric>

#include "sim/oracle/projective_system.h"
#include "tests/sim/sheet_scene.h"

namespace flash::sim::cuda {
namespace {

template <typename Number>
std::vector<Number> numbers(const SolveImage& image, int at, std::size_t count) {
  std::vector<Number> all(count);
  std::memcpy(all.data(), image.tables.data() + at, count * sizeof(Number));
  return all;
}

InverseTree tree_of(int cells) {
  const auto plan = make_sheet_plan(small_sheet(cells, 0.16));
  data::SheetMaterial material;
  material.membrane_stiffness = 100;
  material.bending_rigidity = 1e-4;
  material.areal_density = 0.2;
  material.bending_model = data::BendingModel::isometric;
  return plan_inverse(pattern_of(projective_matrix(*plan, {material}, 0.01).matrix),
                      plan->sheet.rest.vertices);
}

TEST(SolveImage, EachRowOfTilesIsOneTasksOnTheWayDownAndUp) {
  for (const int cells : {2, 6, 31})
    for (const int warps : {1, 16, 128}) {
      const InverseTree tree = tree_of(cells);
      const SolveImage image = make_solve_image(tree, warps);
      const auto levels = numbers<SolveLevel>(image, image.layout.levels, tree.levels.size());
      const std::size_t task_count =
          static_cast<std::size_t>(levels.back().first_up + levels.back().up_count);
      const auto tasks = numbers<SolveTask>(image, image.layout.tasks, task_count);
      std::vector<int> passed(tree.below.size(), 0), solved(static_cast<std::size_t>(tree.slots), 0);
      const auto count = [](std::vector<int>& rows, const SolveTask& task) {
        for (int r = 0; r < inverse_tile * task.rows; ++r)
          ++rows[static_cast<std::size_t>(task.first_result + r)];
      };
      for (const SolveLevel& level : levels) {
        for (int t = 0; t < level.down_count; ++t)
          count(passed, tasks[static_cast<std::size_t>(level.first_down + t)]);
        for (int t = 0; t < level.up_count; ++t)
          count(solved, tasks[static_cast<std::size_t>(level.first_up + t)]);
      }
      EXPECT_EQ(passed, std::vector<int>(passed.size(), 1)) << cells << ", " << warps;
      EXPECT_EQ(solved, std::vector<int>(solved.size(), 1)) << cells << ", " << warps;
    }
}

TEST(SolveImage, LanesFindTheRowsBelowAsATensorCoreTakesThem) {
  const InverseTree tree = tree_of(31);
  const SolveImage image = make_solve_image(tree, 16);
  const auto below = numbers<int>(image, image.layout.below, tree.below.size());
  for (std::size_t first = 0; first < tree.below.size(); first += inverse_tile)
    for (int t = 0; t < 4; ++t) {
      const int rows[] = {2 * t, 2 * t + 1, 2 * t + 8, 2 * t + 9};
      for (int k = 0; k < 4; ++k) {
        const int slot = tree.below[first + static_cast<std::size_t>(rows[k])];
        EXPECT_EQ(below[first + static_cast<std::size_t>(4 * t + k)],
                  place_in_vector(slot - image.layout.first_upper));
        EXPECT_GE(slot, image.layout.first_upper);
      }
    }
}

TEST(SolveImage, APlaceOfEachSlotIsItsOwn) {
  std::vector<int> seen(vector_block_bytes / 2, 0);
  for (int slot = 0; slot < inverse_tile; ++slot)
    for (int c = 0; c < 3; ++c)
      for (const int part : {0, low_part_bytes})
        ++seen[static_cast<std::size_t>((place_in_vector(slot) + component_bytes * c + part) / 2)];
  EXPECT_EQ(std::accumulate(seen.begin(), seen.end(), 0), 6 * inverse_tile);
  for (const int count : seen) EXPECT_LE(count, 1);
  EXPECT_EQ(place_in_vector(inverse_tile + 3), vector_block_bytes + place_in_vector(3));
}

}  // namespace
}  // namespace flash::sim::cuda
