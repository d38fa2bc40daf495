#include "sim/cuda/layout/front_plan.h"

#include <algorithm>
#include <numeric>
#include <stdexcept>

#include "sim/cuda/layout/dissection.h"
#include "sim/cuda/layout/places.h"

namespace flash::sim::cuda {
namespace {

/// A front in the order of elimination, children before parents.
struct Node {
  int first_column = 0, column_count = 0;
  std::vector<int> rows;  ///< positions below, ascending
  std::array<int, 2> children = {-1, -1};
  int height = 0;
};

int below_at(const Node& node) { return rounded_up(3 * node.column_count, 4); }
int row_tiles(const Node& node) {
  return rounded_up(below_at(node) + 3 * static_cast<int>(node.rows.size()), solve_tile_width) /
         solve_tile_width;
}
int column_tiles(const Node& node) {
  return rounded_up(3 * node.column_count, solve_tile_width) / solve_tile_width;
}
int factor_tiles(const Node& node) { return row_tiles(node) * column_tiles(node); }
int below(const Node& node) { return 3 * static_cast<int>(node.rows.size()); }
int panel_size(const Node& node) {
  return panel_numbers(3 * node.column_count, below(node), node.children[0] >= 0 || node.children[1] >= 0);
}

/// The dissection's nodes with what each touches below it.
std::vector<Node> nodes_of(const std::vector<DissectionNode>& dissection,
                           const std::vector<std::vector<int>>& neighbours) {
  std::vector<Node> nodes;
  int next = 0;
  for (const DissectionNode& part : dissection) {
    Node node;
    node.first_column = next;
    node.column_count = static_cast<int>(part.vertices.size());
    node.children = part.children;
    next += node.column_count;
    for (int column = node.first_column; column < next; ++column)
      for (const int row : neighbours[column])
        if (row >= next) node.rows.push_back(row);
    for (const int child : node.children)
      if (child >= 0)
        for (const int row : nodes[child].rows)
          if (row >= next) node.rows.push_back(row);
    std::sort(node.rows.begin(), node.rows.end());
    node.rows.erase(std::unique(node.rows.begin(), node.rows.end()), node.rows.end());
    nodes.push_back(std::move(node));
  }
  return nodes;
}

/// Nodes whose panel is too large, as chains: each the only child of the next.
std::vector<Node> split_nodes(const std::vector<Node>& whole, int capacity) {
  std::vector<Node> nodes;
  std::vector<int> last_piece;
  for (const Node& node : whole) {
    Node rest = node;
    for (int& child : rest.children)
      if (child >= 0) child = last_piece[child];
    while (panel_size(rest) > capacity || 3 * rest.column_count > block_threads / 2) {
      Node piece = rest;
      // The rows that the piece leaves above it are as many as before: only its columns get fewer.
      const auto take = [&](int count) {
        piece.column_count = count;
        piece.rows.resize(rest.column_count - count);
        std::iota(piece.rows.begin(), piece.rows.end(), rest.first_column + count);
        piece.rows.insert(piece.rows.end(), rest.rows.begin(), rest.rows.end());
      };
      int count = std::min((rest.column_count + 1) / 2, block_threads / 6);
      for (take(count); panel_size(piece) > capacity && count > 1;) take(--count);
      if (panel_size(piece) > capacity) throw std::invalid_argument("front_plan: a row does not fit on chip");
      nodes.push_back(piece);
      rest.first_column += count;
      rest.column_count -= count;
      rest.children = {static_cast<int>(nodes.size()) - 1, -1};
    }
    nodes.push_back(rest);
    last_piece.push_back(static_cast<int>(nodes.size()) - 1);
  }
  return nodes;
}

/// By height, and at one height the most work first.
std::vector<Node> by_height(std::vector<Node> nodes) {
  for (std::size_t n = 0; n < nodes.size(); ++n)
    for (const int child : nodes[n].children)
      if (child >= 0) nodes[n].height = std::max(nodes[n].height, nodes[child].height + 1);
  std::vector<int> order(nodes.size()), place(nodes.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
    if (nodes[a].height != nodes[b].height) return nodes[a].height < nodes[b].height;
    return factor_tiles(nodes[a]) > factor_tiles(nodes[b]);
  });
  for (std::size_t n = 0; n < order.size(); ++n) place[order[n]] = static_cast<int>(n);
  std::vector<Node> sorted;
  for (const int n : order) {
    Node node = nodes[n];
    for (int& child : node.children)
      if (child >= 0) child = place[child];
    sorted.push_back(std::move(node));
  }
  return sorted;
}

/// The fronts' tiles one after the other. What a front passes up lives until its parent is done.
void place_memory(const std::vector<Node>& nodes, FrontPlan& plan) {
  Places updates;
  // Zeros, for the columns that a child lacks.
  int longest = 0;
  for (const Node& node : nodes) longest = std::max(longest, below(node));
  updates.take(rounded_up(longest, 8));
  std::size_t front = 0;
  for (const FrontLevel& level : plan.levels) {
    const std::size_t end = level.first_front + level.front_count;
    for (std::size_t f = front; f < end; ++f) {
      FrontLayout& layout = plan.fronts[f];
      layout.first_tile = plan.factor_tiles;
      plan.factor_tiles += layout.row_tiles * layout.column_tiles;
      layout.update_leading = rounded_up(3 * layout.row_count, 8);
      layout.update_at = updates.take(3L * layout.row_count * layout.update_leading);
    }
    for (; front < end; ++front)
      for (const int child : nodes[front].children) {
        if (child < 0) continue;
        const FrontLayout& layout = plan.fronts[child];
        updates.give_back(layout.update_at, 3L * layout.row_count * layout.update_leading);
      }
  }
  plan.update_size = updates.total();
}

void add_levels(const std::vector<Node>& nodes, const FrontSettings& settings, FrontPlan& plan) {
  for (std::size_t first = 0; first < nodes.size();) {
    FrontLevel level{};
    level.first_front = static_cast<int>(first);
    int panel = 0;
    for (; first < nodes.size() && nodes[first].height == static_cast<int>(plan.levels.size()); ++first) {
      ++level.front_count;
      panel = std::max(panel, panel_size(nodes[first]));
    }
    // As many groups as fronts, so that none is idle.
    level.groups = 1;
    while (2 * level.groups <= settings.most_groups && level.groups < level.front_count &&
           2 * level.groups * panel <= settings.panel_capacity)
      level.groups *= 2;
    plan.shared_panel = std::max(plan.shared_panel, level.groups * rounded_up(panel, 4));
    plan.levels.push_back(level);
  }
}

void add_layouts(const std::vector<Node>& nodes, FrontPlan& plan) {
  for (const Node& node : nodes) {
    FrontLayout layout{};
    layout.first_column = node.first_column;
    layout.column_count = node.column_count;
    layout.first_row = static_cast<int>(plan.rows.size());
    layout.row_count = static_cast<int>(node.rows.size());
    layout.below_at = below_at(node);
    layout.row_tiles = row_tiles(node);
    layout.column_tiles = column_tiles(node);
    layout.children[0] = node.children[0];
    layout.children[1] = node.children[1];
    plan.rows.insert(plan.rows.end(), node.rows.begin(), node.rows.end());

    layout.first_map = static_cast<int>(plan.child_rows.size());
    std::vector<int> own(node.column_count);
    std::iota(own.begin(), own.end(), node.first_column);
    own.insert(own.end(), node.rows.begin(), node.rows.end());
    for (const int child : node.children) {
      for (const int vertex : own) {
        int place = -1;
        if (child >= 0) {
          const std::vector<int>& below = nodes[child].rows;
          const auto found = std::lower_bound(below.begin(), below.end(), vertex);
          if (found != below.end() && *found == vertex) place = static_cast<int>(found - below.begin());
        }
        plan.child_rows.push_back(place);
      }
    }

    layout.first_entry = static_cast<int>(plan.entries.size());
    for (int row = 0; row < solve_tile_width * layout.row_tiles; ++row) {
      const int below = row - layout.below_at;
      int entry = -1;
      if (row < 3 * node.column_count)
        entry = 3 * node.first_column + row;
      else if (below >= 0 && below < 3 * layout.row_count)
        entry = 3 * (plan.size + node.rows[below / 3]) + below % 3;
      plan.entries.push_back(entry);
    }

    const double c = 3.0 * node.column_count, r = 3.0 * layout.row_count;
    plan.factor_entries += static_cast<long>(c * (c + 1) / 2 + c * r);
    // Cholesky, columns below, update; then the inverse and its product with what is below.
    plan.factor_flops += (c * c * c / 3 + c * c * r + c * r * r) + (c * c * c / 3 + c * c * r);
    plan.fronts.push_back(layout);
  }
}

void add_panel_rows(FrontPlan& plan) {
  for (FrontLayout& front : plan.fronts) {
    if (front.children[0] < 0 && front.children[1] < 0) continue;
    const int columns = 3 * front.column_count, below = 3 * front.row_count, own = padded_columns(columns),
              rows = mapped_rows(columns, below), vertices = front.column_count + front.row_count;
    front.first_panel_row = static_cast<int>(plan.panel_rows.size());
    plan.panel_rows.insert(plan.panel_rows.end(), 2 * rows, -1);
    plan.panel_rows.insert(plan.panel_rows.end(), 2 * rows, 0);
    for (int k = 0; k < 2; ++k)
      for (int entry = 0; entry < columns + below && front.children[k] >= 0; ++entry) {
        const int found = plan.child_rows[front.first_map + k * vertices + entry / 3];
        if (found < 0) continue;
        const FrontLayout& child = plan.fronts[front.children[k]];
        const int place = 3 * found + entry % 3, row = entry < columns ? entry : entry - columns + own;
        int* const places = plan.panel_rows.data() + front.first_panel_row + k * rows;
        places[row] = place;
        places[row + 2 * rows] = static_cast<int>(child.update_at) + place * child.update_leading;
      }
  }
}

void add_blocks(const BlockPattern& pattern, const std::vector<Node>& nodes, FrontPlan& plan) {
  std::vector<int> owner(pattern.size);
  for (std::size_t n = 0; n < nodes.size(); ++n)
    for (int c = 0; c < nodes[n].column_count; ++c) owner[nodes[n].first_column + c] = static_cast<int>(n);
  std::vector<std::vector<BlockPlace>> places(nodes.size());
  const auto row_in = [&](const Node& node, int row) {
    if (row < node.first_column + node.column_count) return row - node.first_column;
    return node.column_count +
           static_cast<int>(std::lower_bound(node.rows.begin(), node.rows.end(), row) - node.rows.begin());
  };
  for (int vertex = 0; vertex < pattern.size; ++vertex) {
    const int at = plan.position[vertex], n = owner[at], place = at - nodes[n].first_column;
    places[n].push_back({place, place, 0, vertex});
  }
  for (std::size_t k = 0; k < pattern.pairs.size(); ++k) {
    const int row = plan.position[pattern.pairs[k].first], column = plan.position[pattern.pairs[k].second];
    const int n = owner[std::min(row, column)];
    places[n].push_back({row_in(nodes[n], std::max(row, column)),
                         std::min(row, column) - nodes[n].first_column, row < column,
                         pattern.size + static_cast<int>(k)});
  }
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    plan.fronts[n].first_block = static_cast<int>(plan.blocks.size());
    plan.fronts[n].block_count = static_cast<int>(places[n].size());
    plan.blocks.insert(plan.blocks.end(), places[n].begin(), places[n].end());
  }
}

}  // namespace

FrontPlan plan_fronts(const BlockPattern& pattern, const data::Points& places,
                      const FrontSettings& settings) {
  FrontPlan plan;
  plan.size = pattern.size;
  const std::vector<DissectionNode> dissection = dissect(pattern, places, settings.leaf_size);
  plan.position.resize(pattern.size);
  int next = 0;
  for (const DissectionNode& node : dissection)
    for (const int vertex : node.vertices) plan.position[vertex] = next++;
  std::vector<std::vector<int>> neighbours(pattern.size);
  for (const auto& [a, b] : pattern.pairs) {
    neighbours[plan.position[a]].push_back(plan.position[b]);
    neighbours[plan.position[b]].push_back(plan.position[a]);
  }
  const std::vector<Node> nodes =
      by_height(split_nodes(nodes_of(dissection, neighbours), settings.panel_capacity));
  add_layouts(nodes, plan);
  add_levels(nodes, settings, plan);
  place_memory(nodes, plan);
  add_panel_rows(plan);
  add_blocks(pattern, nodes, plan);
  return plan;
}

}  // namespace flash::sim::cuda
