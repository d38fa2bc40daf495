#include "sim/cuda/layout/sheet_layout.h"

#include <algorithm>
#include <array>
#include <numeric>

namespace flash::sim::cuda {
namespace {

/// Lists one after the other, with where each starts and, last, where they end.
void flatten(const std::vector<std::vector<int>>& lists, std::vector<int>& starts, std::vector<int>& all) {
  starts.assign(1, 0);
  for (const std::vector<int>& list : lists) {
    all.insert(all.end(), list.begin(), list.end());
    starts.push_back(static_cast<int>(all.size()));
  }
}

/// A triangle among those of a SheetPlan.
struct TriangleAt {
  const TriangleGroup* group;
  int lane;
  int place;  ///< the lowest of its vertices
};

/// In the order of their places, so that what vertices next to each other need lies together.
std::vector<TriangleAt> triangles_by_place(const SheetPlan& plan, const std::vector<int>& position) {
  std::vector<TriangleAt> triangles;
  for (const TriangleGroup& group : plan.triangle_groups)
    for (int lane = 0; lane < group.count; ++lane) {
      int place = position[group.vertices[0][lane]];
      for (const auto& vertices : group.vertices) place = std::min(place, position[vertices[lane]]);
      triangles.push_back({&group, lane, place});
    }
  std::stable_sort(triangles.begin(), triangles.end(),
                   [](const TriangleAt& a, const TriangleAt& b) { return a.place < b.place; });
  return triangles;
}

void add_triangles(const SheetPlan& plan, const std::vector<int>& position, SheetLayout& layout) {
  const std::vector<TriangleAt> triangles = triangles_by_place(plan, position);
  layout.triangle_count = static_cast<int>(triangles.size());
  const int count = layout.triangle_count;
  layout.triangle_vertices.resize(3L * count);
  layout.gradients.resize(4L * count);
  layout.areas.resize(count);
  std::vector<std::vector<int>> corners(layout.size);
  layout.pair_sources.resize(plan.pattern.pairs.size());
  for (int t = 0; t < count; ++t) {
    const TriangleGroup& group = *triangles[t].group;
    const int lane = triangles[t].lane;
    for (int k = 0; k < 3; ++k) {
      const int place = position[group.vertices[k][lane]];
      layout.triangle_vertices[k * count + t] = place;
      corners[place].push_back(3 * k * count + t);
      layout.pair_sources[group.slots[k][lane] - plan.pattern.size].add(3 * t + k);
    }
    for (int k = 0; k < 4; ++k) layout.gradients[k * count + t] = group.gradients[k][lane];
    layout.areas[t] = group.area[lane];
  }
  flatten(corners, layout.corner_starts, layout.corners);
}

void add_block_rows(const SheetPlan& plan, const std::vector<int>& position, SheetLayout& layout) {
  struct Entry {
    int column;
    EdgeSources sources;
  };
  std::vector<std::vector<Entry>> rows(layout.size);
  for (int vertex = 0; vertex < layout.size; ++vertex)
    rows[position[vertex]].push_back({position[vertex], {}});
  for (std::size_t k = 0; k < plan.edge_count; ++k) {
    const int row = position[plan.pattern.pairs[k].first], column = position[plan.pattern.pairs[k].second];
    EdgeSources sources = layout.pair_sources[k];
    rows[row].push_back({column, sources});
    sources.turned = 1;
    rows[column].push_back({row, sources});
  }
  layout.slice_starts.assign(1, 0);
  for (int first = 0; first < layout.size; first += slice_size) {
    const int end = std::min(first + slice_size, layout.size);
    std::size_t most = 0;
    for (int row = first; row < end; ++row) most = std::max(most, rows[row].size());
    for (std::size_t k = 0; k < most; ++k)
      for (int row = first; row < first + slice_size; ++row) {
        const bool there = row < end && k < rows[row].size();
        layout.slice_columns.push_back(there ? rows[row][k].column : std::min(row, layout.size - 1));
        layout.slice_sources.push_back(there ? rows[row][k].sources : EdgeSources{});
      }
    layout.slice_starts.push_back(layout.slice_starts.back() + static_cast<int>(most));
  }
}

/// Columns of two groups of scalar rows by steps: four of each in a step, -1 where there are no more. Eight
/// lanes read from on-chip memory at once, sixteen bytes each, without waiting where places differ modulo 8.
/// So in each step come first the remainders of which most columns are left, each once where that is
/// possible.
std::vector<std::array<int, 8>> spread_over_banks(const std::array<std::vector<int>, 2>& places) {
  constexpr int banks = 8, each = 4;
  std::array<std::array<std::vector<int>, banks>, 2> left;  // numbers of columns by remainder
  for (int g = 0; g < 2; ++g)
    for (int k = static_cast<int>(places[g].size()); k-- > 0;) left[g][places[g][k] % banks].push_back(k);
  std::vector<std::array<int, 8>> steps((std::max(places[0].size(), places[1].size()) + each - 1) / each);
  for (std::array<int, 8>& step : steps) {
    std::array<bool, banks> used = {};
    for (int lane = 0; lane < banks; ++lane) {
      auto& own = left[lane / each];
      const auto worth = [&](int bank) {
        return own[bank].empty() ? -1 : static_cast<int>(own[bank].size()) + (used[bank] ? 0 : 1 << 20);
      };
      int best = 0;
      for (int bank = 1; bank < banks; ++bank)
        if (worth(bank) > worth(best)) best = bank;
      step[lane] = -1;
      if (own[best].empty()) continue;
      step[lane] = own[best].back();
      own[best].pop_back();
      used[best] = true;
    }
  }
  return steps;
}

void add_scalar_rows(const BendingOperator& bending, const std::vector<int>& position, SheetLayout& layout) {
  constexpr int lanes_each = 4, lanes = lanes_each * bundle_groups;
  const RowGroups& stiffness = bending.stiffness;
  const int group_count = static_cast<int>(stiffness.rows.size());
  const auto length = [&](int group) { return stiffness.starts[group + 1] - stiffness.starts[group]; };
  // Those of a bundle are about as long.
  std::vector<int> groups(group_count);
  std::iota(groups.begin(), groups.end(), 0);
  std::stable_sort(groups.begin(), groups.end(), [&](int a, int b) { return length(a) > length(b); });
  groups.resize((groups.size() + bundle_groups - 1) / bundle_groups * bundle_groups, -1);
  for (const int group : groups)
    for (int k = 0; k < 4; ++k) {
      const int row = group < 0 ? -1 : stiffness.rows[group][k];
      layout.group_rows.push_back(row < 0 ? -1 : position[row]);
    }
  layout.bundle_starts = {0};
  for (std::size_t first = 0; first < groups.size(); first += bundle_groups) {
    constexpr int padding = lanes_each * steps_together;
    const int start = layout.bundle_starts.back(), longest = length(groups[first]),
              end = start + (longest + padding - 1) / padding * steps_together;
    layout.bundle_starts.push_back(end);
    // Zeros times any vertex.
    layout.step_columns.resize(static_cast<std::size_t>(lanes) * end, 0);
    layout.step_values.resize(4L * lanes * end, 0.0);
    for (int own = 0; own < bundle_groups; own += 2) {
      std::array<std::vector<int>, 2> places;
      for (int g = 0; g < 2; ++g)
        if (const int group = groups[first + own + g]; group >= 0)
          for (int k = stiffness.starts[group]; k < stiffness.starts[group + 1]; ++k)
            places[g].push_back(position[stiffness.columns[k]]);
      int to = lanes * start + lanes_each * own;
      for (const std::array<int, 8>& step : spread_over_banks(places)) {
        for (int lane = 0; lane < 8; ++lane) {
          const int g = lane / lanes_each, k = step[lane];
          if (k < 0) continue;
          const int from = stiffness.starts[groups[first + own + g]] + k;
          layout.step_columns[to + lane] = places[g][k];
          std::copy_n(stiffness.values.begin() + 4L * from, 4, layout.step_values.begin() + 4L * (to + lane));
        }
        to += lanes;
      }
    }
  }
  layout.stand_in = bending.stand_in;
}

void add_hinges(const SheetPlan& plan, const std::vector<int>& position, SheetLayout& layout) {
  const int count = static_cast<int>(plan.hinges.size());
  layout.hinge_count = count;
  layout.hinge_vertices.resize(4L * count);
  layout.hinge_rest_areas.resize(2L * count);
  std::vector<std::vector<int>> corners(layout.size), sources(layout.block_count);
  for (int e = 0; e < count; ++e) {
    const Hinge& hinge = plan.hinges[e];
    for (int k = 0; k < 4; ++k) {
      const int vertex = hinge.vertices[k];
      layout.hinge_vertices[k * count + e] = position[vertex];
      corners[position[vertex]].push_back(4 * e + k);
      sources[vertex].push_back(16 * e + 5 * k);
    }
    for (int k = 0; k < 2; ++k) layout.hinge_rest_areas[k * count + e] = hinge.rest_areas[k];
    layout.hinge_weights.push_back(hinge.weight);
    layout.hinge_rest_angles.push_back(hinge.rest_angle);
    constexpr std::pair<int, int> blocks[6] = {{1, 0}, {2, 0}, {2, 1}, {3, 0}, {3, 1}, {3, 2}};
    for (int b = 0; b < 6; ++b) {
      const auto [row, column] = blocks[b];
      const BlockSlot slot = plan.hinge_slots[e][b];
      sources[slot.block].push_back(16 * e + (slot.transposed ? 4 * column + row : 4 * row + column));
    }
  }
  flatten(corners, layout.hinge_corner_starts, layout.hinge_corners);
  flatten(sources, layout.hinge_source_starts, layout.hinge_sources);
}

}  // namespace

SheetLayout lay_out_bending(const SheetPlan& plan, const BendingOperator& bending, const FrontPlan& fronts) {
  SheetLayout layout;
  layout.size = plan.pattern.size;
  layout.block_count = layout.size + static_cast<int>(plan.pattern.pairs.size());
  add_scalar_rows(bending, fronts.position, layout);
  if (bending.model == data::BendingModel::hinge) add_hinges(plan, fronts.position, layout);
  return layout;
}

SheetLayout lay_out(const SheetPlan& plan, const BendingOperator& bending, const FrontPlan& fronts) {
  SheetLayout layout = lay_out_bending(plan, bending, fronts);
  layout.order.resize(layout.size);
  layout.vertex_area.resize(layout.size);
  for (int vertex = 0; vertex < layout.size; ++vertex) {
    layout.order[fronts.position[vertex]] = vertex;
    layout.vertex_area[fronts.position[vertex]] = plan.sheet.vertex_area[vertex];
  }
  layout.block_rows = layout.block_columns = fronts.position;
  for (const auto& [row, column] : plan.pattern.pairs) {
    layout.block_rows.push_back(fronts.position[row]);
    layout.block_columns.push_back(fronts.position[column]);
  }
  add_triangles(plan, fronts.position, layout);
  for (std::size_t k = 0; k < plan.edge_count; ++k) {
    const auto [i, j] = plan.pattern.pairs[k];
    layout.edge_lengths.push_back((plan.sheet.rest.vertices.row(i) - plan.sheet.rest.vertices.row(j)).norm());
  }
  add_block_rows(plan, fronts.position, layout);
  return layout;
}

}  // namespace flash::sim::cuda
