#include "sim/sheet_plan.h"

#include <map>

#include "sim/isometric_bending.h"
#include "sim/morley.h"

namespace flash::sim {

namespace {

using PairIndex = std::map<std::pair<int, int>, int>;

int pair_index(PairIndex& index, BlockPattern& pattern, int i, int j) {
  const std::pair<int, int> key = std::minmax(i, j);
  const auto [entry, fresh] = index.try_emplace(key, static_cast<int>(pattern.pairs.size()));
  if (fresh) pattern.pairs.push_back({key.second, key.first});
  return entry->second;
}

}  // namespace

std::shared_ptr<const SheetPlan> make_sheet_plan(const Sheet& sheet) {
  auto plan = std::make_shared<SheetPlan>();
  plan->sheet = sheet;
  plan->hinges = sheet_hinges(sheet);
  plan->pattern.size = static_cast<int>(sheet.rest.vertices.rows());
  PairIndex index;
  const auto slot = [&](int row, int column) {
    return BlockSlot{plan->pattern.size + pair_index(index, plan->pattern, row, column), row < column};
  };
  for (const RestTriangle& triangle : sheet.triangles) {
    const auto& v = triangle.vertices;
    plan->triangle_slots.push_back({slot(v[1], v[0]), slot(v[2], v[0]), slot(v[2], v[1])});
  }
  for (const Hinge& hinge : plan->hinges) {
    const auto& v = hinge.vertices;
    plan->hinge_slots.push_back({slot(v[1], v[0]), slot(v[2], v[0]), slot(v[2], v[1]), slot(v[3], v[0]),
                                 slot(v[3], v[1]), slot(v[3], v[2])});
  }
  plan->symbolic = analyze(plan->pattern);
  return plan;
}

std::shared_ptr<const BendingOperator> make_bending_operator(const SheetPlan& plan, data::BendingModel model,
                                                             double poissons_ratio) {
  auto bending = std::make_shared<BendingOperator>();
  bending->model = model;
  if (model == data::BendingModel::hinge) return bending;
  const Eigen::SparseMatrix<double> isometric = isometric_bending_stiffness(plan.sheet);
  bending->stiffness = model == data::BendingModel::plate
                           ? plate_bending_stiffness(plan.sheet, poissons_ratio, 1e-6)
                           : isometric;
  bending->stiffness.makeCompressed();
  // Against the plate the isometric stiffness has its eigenvalues between 0.5 and 4.6 (regular meshes, nu =
  // 0.3): scaled, they lie around 1, where those of the membrane and the mass are.
  const double scale = model == data::BendingModel::plate ? 0.6 : 1.0;
  for (int i = 0; i < plan.pattern.size; ++i) bending->stand_in.push_back(scale * isometric.coeff(i, i));
  for (const auto& [row, column] : plan.pattern.pairs)
    bending->stand_in.push_back(scale * isometric.coeff(row, column));
  if (model == data::BendingModel::plate) {
    bending->correction =
        bending->stiffness - Eigen::SparseMatrix<double, Eigen::RowMajor>(scale * isometric);
    bending->correction.makeCompressed();
  }
  return bending;
}

}  // namespace flash::sim
