#include "sim/cuda/layout/solve_image.h"

#include <algorithm>
#include <array>
#include <cstring>

namespace flash::sim::cuda {
namespace {

constexpr int alignment = 16;

int rounded(std::size_t bytes) { return static_cast<int>((bytes + alignment - 1) / alignment) * alignment; }

/// Appends an array. Returns where it begins [bytes].
template <typename Number>
int append(const std::vector<Number>& numbers, std::vector<char>& to) {
  const std::size_t at = to.size(), bytes = numbers.size() * sizeof(Number);
  to.resize(at + static_cast<std::size_t>(rounded(bytes)), 0);
  if (bytes > 0) std::memcpy(to.data() + at, numbers.data(), bytes);
  return static_cast<int>(at);
}

SolveTask task_down(const InverseNode& node, int first, int rows) {
  return {rows, node.column_tiles, 0, node.first_W + first * node.column_tiles,
          0,    node.first_block,  0, node.first_below + inverse_tile * first};
}

SolveTask task_up(const InverseNode& node, int first, int rows) {
  return {rows,
          node.column_tiles,
          node.below_tiles,
          node.first_D + first * node.column_tiles,
          node.first_W + first,
          node.first_block,
          node.first_below,
          inverse_tile * (node.first_block + first)};
}

/// Appends the tasks of a level, rows_of(node) of each node: two rows each, which read the same vectors,
/// unless the longest way of a warp is shorter by an eighth with one each.
template <typename Rows, typename Task>
int add_tasks(const InverseTree& tree, const InverseLevel& level, int warps, const Rows& rows_of,
              const Task& task, std::vector<SolveTask>& tasks) {
  const std::size_t before = tasks.size();
  int rows = 0, pairs = 0;
  for (int k = level.first_node; k < level.first_node + level.node_count; ++k) {
    rows += rows_of(tree.nodes[k]);
    pairs += (rows_of(tree.nodes[k]) + 1) / 2;
  }
  const auto rounds = [&](int count) { return (count + warps - 1) / warps; };
  const int together = 8 * rounds(rows) > 7 * 2 * rounds(pairs) ? 2 : 1;
  for (int k = level.first_node; k < level.first_node + level.node_count; ++k)
    for (int first = 0; first < rows_of(tree.nodes[k]); first += together)
      tasks.push_back(task(tree.nodes[k], first, std::min(together, rows_of(tree.nodes[k]) - first)));
  return static_cast<int>(tasks.size() - before);
}

/// The levels, and the tasks of all.
std::vector<SolveLevel> levels_of(const InverseTree& tree, int warps, std::vector<SolveTask>& tasks) {
  std::vector<SolveLevel> levels;
  for (const InverseLevel& level : tree.levels) {
    const InverseNode &first = tree.nodes[level.first_node],
                      &last = tree.nodes[level.first_node + level.node_count - 1];
    SolveLevel own{inverse_tile * first.first_block,
                   inverse_tile * (last.first_block + last.column_tiles),
                   static_cast<int>(tasks.size()),
                   0,
                   0,
                   0};
    own.down_count = add_tasks(
        tree, level, warps, [](const InverseNode& node) { return node.below_tiles; }, task_down, tasks);
    own.first_up = static_cast<int>(tasks.size());
    own.up_count = add_tasks(
        tree, level, warps, [](const InverseNode& node) { return node.column_tiles; }, task_up, tasks);
    levels.push_back(own);
  }
  return levels;
}

/// Places in the solved vector of the rows below, sixteen at a time: of lane t of each four the rows 2 t,
/// 2 t + 1, 2 t + 8 and 2 t + 9.
std::vector<int> places_below(const InverseTree& tree, int first_upper) {
  constexpr std::array<int, inverse_tile> rows = {0, 1, 8, 9, 2, 3, 10, 11, 4, 5, 12, 13, 6, 7, 14, 15};
  std::vector<int> places;
  for (std::size_t first = 0; first < tree.below.size(); first += inverse_tile)
    for (const int row : rows)
      places.push_back(place_in_vector(tree.below[first + static_cast<std::size_t>(row)] - first_upper));
  return places;
}

}  // namespace

SolveImage make_solve_image(const InverseTree& tree, int warps) {
  SolveImage image;
  SolveLayout& layout = image.layout;
  std::vector<SolveTask> tasks;
  const std::vector<SolveLevel> levels = levels_of(tree, warps, tasks);
  layout.level_count = static_cast<int>(levels.size());
  layout.first_upper = levels.front().end_slot;
  layout.tiles = tree.tiles;
  layout.levels = append(levels, image.tables);
  layout.tasks = append(tasks, image.tables);
  layout.below = append(places_below(tree, layout.first_upper), image.tables);
  layout.gather_starts =
      append(std::vector<int>(tree.gather_starts.begin() + layout.first_upper, tree.gather_starts.end()),
             image.tables);
  layout.gathered = append(tree.gathered, image.tables);
  layout.right = static_cast<int>(image.tables.size());
  layout.solved = layout.right + tree.slots / inverse_tile * vector_block_bytes;
  // The block of zeros too.
  layout.exchange =
      layout.solved + ((tree.slots - layout.first_upper) / inverse_tile + 1) * vector_block_bytes;
  const int rows = std::max(tree.slots, static_cast<int>(tree.below.size()));
  layout.bytes = layout.exchange + rows * static_cast<int>(4 * sizeof(float));
  return image;
}

}  // namespace flash::sim::cuda
