#include "sim/plan/sheet_plan.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "sim/plan/isometric_bending.h"
#include "sim/plan/largest_entry.h"
#include "sim/plan/morley.h"
#include "sim/scene/shape_gradients.h"

namespace flash::sim {

namespace {

using PairIndex = std::map<std::pair<int, int>, int>;

int pair_index(PairIndex& index, BlockPattern& pattern, int i, int j) {
  const std::pair<int, int> key = std::minmax(i, j);
  const auto [entry, fresh] = index.try_emplace(key, static_cast<int>(pattern.pairs.size()));
  if (fresh) pattern.pairs.push_back({key.second, key.first});
  return entry->second;
}

/// The triangles from `first` on, up to eight of those before `end`. slot(row, column) is the place of a
/// block, row > column.
template <typename Slot>
TriangleGroup group_of(const std::vector<RestTriangle>& triangles, int first, int end, const Slot& slot) {
  TriangleGroup group;
  group.count = std::min(triangle_group_size, end - first);
  for (int lane = 0; lane < triangle_group_size; ++lane) {
    const RestTriangle& triangle = triangles[first + std::min(lane, group.count - 1)];
    const Eigen::Matrix<double, 3, 2> gradients = shape_gradients<2>(triangle.inverse_edges);
    std::array<int, 3> order = {0, 1, 2};
    std::sort(order.begin(), order.end(),
              [&](int a, int b) { return triangle.vertices[a] < triangle.vertices[b]; });
    for (int k = 0; k < 4; ++k) group.gradients[k][lane] = gradients(order[1 + k / 2], k % 2);
    group.area[lane] = triangle.area;
    for (int k = 0; k < 3; ++k) group.vertices[k][lane] = triangle.vertices[order[k]];
    constexpr std::pair<int, int> blocks[3] = {{1, 0}, {2, 0}, {2, 1}};
    for (int k = 0; k < 3; ++k)
      group.slots[k][lane] =
          slot(group.vertices[blocks[k].first][lane], group.vertices[blocks[k].second][lane]);
  }
  return group;
}

std::shared_ptr<const BendingOperator> make_bending_operator(const SheetPlan& plan, const BodyPlan& place,
                                                             data::BendingModel model, double poissons_ratio,
                                                             const data::Weave& weave) {
  const Body& body = place.body;
  const auto own_hinges = std::span(plan.hinges).subspan(place.first_hinge, place.hinge_count);
  auto bending = std::make_shared<BendingOperator>();
  bending->model = model;
  bending->kernels = plan.kernels;
  if (body.is_solid()) return bending;
  if (model == data::BendingModel::hinge) {
    bending->largest_entry = largest_hinge_entry(plan.sheet, body, own_hinges);
    return bending;
  }
  const Sheet alone = body_alone(plan.sheet, body);
  const Eigen::SparseMatrix<double> isometric = isometric_bending_stiffness(alone);
  const Eigen::SparseMatrix<double, Eigen::RowMajor> stiffness =
      model == data::BendingModel::plate ? plate_bending_stiffness(alone, poissons_ratio, 1e-6, weave)
                                         : isometric;
  bending->largest_entry = stiffness.coeffs().abs().maxCoeff();
  const data::Points flat = alone.rest.vertices.rowwise() - alone.rest.vertices.row(0);
  bending->flat_energy = 0.5 * data::Points(stiffness * flat).cwiseProduct(flat).cwiseAbs().sum();
  std::vector<int> as_numbered(body.vertex_count);
  std::iota(as_numbered.begin(), as_numbered.end(), 0);
  bending->stiffness = row_groups(stiffness, as_numbered);
  bending->elimination_stiffness =
      row_groups(stiffness, std::span(plan.symbolic->position).subspan(body.first_vertex));
  // Against the plate the isometric stiffness has its eigenvalues between 0.5 and 4.6 (regular meshes, nu =
  // 0.3). Scaled, they lie around 1, where those of the membrane and the mass are.
  const double scale = model == data::BendingModel::plate ? 0.6 * std::sqrt(weave.bending_ratio) : 1.0;
  const auto entry = [&](int row, int column) {
    const int i = row - body.first_vertex, j = column - body.first_vertex;
    return 0 <= i && i < body.vertex_count && 0 <= j && j < body.vertex_count ? scale * isometric.coeff(i, j)
                                                                              : 0.0;
  };
  for (int i = 0; i < plan.pattern.size; ++i) bending->stand_in.push_back(entry(i, i));
  for (const auto& [row, column] : plan.pattern.pairs) bending->stand_in.push_back(entry(row, column));
  return bending;
}

}  // namespace

std::shared_ptr<const SheetPlan> make_sheet_plan(const Sheet& sheet, InstructionLevel level) {
  auto plan = std::make_shared<SheetPlan>();
  plan->sheet = sheet;
  plan->kernels = &kernels_of(level);
  plan->hinges = sheet_hinges(sheet);
  plan->pattern.size = static_cast<int>(sheet.rest.vertices.rows());
  PairIndex index;
  const auto slot = [&](int row, int column) {
    return BlockSlot{plan->pattern.size + pair_index(index, plan->pattern, row, column), row < column};
  };
  for (const Body& body : sheet.bodies) {
    BodyPlan own{.body = body,
                 .first_group = static_cast<int>(plan->triangle_groups.size()),
                 .largest_entry = largest_membrane_entry(sheet, body)};
    const int end = body.first_triangle + body.triangle_count;
    for (int first = body.first_triangle; first < end; first += triangle_group_size)
      plan->triangle_groups.push_back(group_of(sheet.triangles, first, end,
                                               [&](int row, int column) { return slot(row, column).block; }));
    own.group_count = static_cast<int>(plan->triangle_groups.size()) - own.first_group;
    plan->bodies.push_back(own);
  }
  plan->solid_elements = solid_elements(sheet, [&](int row, int column) { return slot(row, column).block; });
  plan->edge_count = plan->pattern.pairs.size();
  for (const Hinge& hinge : plan->hinges) {
    const auto& v = hinge.vertices;
    plan->hinge_slots.push_back({slot(v[1], v[0]), slot(v[2], v[0]), slot(v[2], v[1]), slot(v[3], v[0]),
                                 slot(v[3], v[1]), slot(v[3], v[2])});
  }
  // Hinges are in the order of their lowest vertices, and so in that of the bodies.
  int first_hinge = 0;
  for (BodyPlan& own : plan->bodies) {
    const int end_vertex = own.body.first_vertex + own.body.vertex_count;
    own.first_hinge = first_hinge;
    while (first_hinge < static_cast<int>(plan->hinges.size()) &&
           plan->hinges[first_hinge].vertices[0] < end_vertex)
      ++first_hinge;
    own.hinge_count = first_hinge - own.first_hinge;
  }
  plan->symbolic = analyze(plan->pattern);
  const std::vector<int>& position = plan->symbolic->position;
  plan->triangle_product = product_pattern(plan->pattern, plan->edge_count, position);
  plan->full_product = product_pattern(plan->pattern, plan->pattern.pairs.size(), position);
  return plan;
}

const BendingOperator& bending_operator(const SheetPlan& plan, data::BendingModel model,
                                        double poissons_ratio, int body, const data::Weave& weave) {
  const bool plate = model == data::BendingModel::plate;
  const BendingOperators::Key key = {body, model, plate ? poissons_ratio : 0.0,
                                     plate ? weave.of_bending() : data::Weave{}};
  const std::lock_guard lock(plan.bending->mutex);
  auto& made = plan.bending->made;
  const auto known =
      std::find_if(made.begin(), made.end(), [&](const auto& entry) { return entry.first == key; });
  if (known != made.end()) return *known->second;
  made.emplace_back(key, make_bending_operator(plan, plan.bodies[body], model, poissons_ratio, key.weave));
  return *made.back().second;
}

std::size_t count_bending_operators(const SheetPlan& plan) {
  const std::lock_guard lock(plan.bending->mutex);
  return plan.bending->made.size();
}

}  // namespace flash::sim
