#pragma once
#include <array>
#include <map>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "data/material.h"
#include "sim/block_cholesky.h"
#include "sim/hinge_bending.h"
#include "sim/sheet.h"
#include "sim/sheet_product.h"

namespace flash::sim {

/// A 3 x 3 block of the system matrix between two vertices; stored once, for row > column.
struct BlockSlot {
  int block;       ///< index among the blocks of a BlockPattern, the diagonal ones first
  bool transpose;  ///< the stored block is that of (column, row)
};

inline constexpr int triangle_group_size = 8;

/// Eight triangles that go through the membrane's formulas together. In each triangle the vertices ascend, so
/// that its blocks (1, 0), (2, 0) and (2, 1) are stored as they are.
struct alignas(64) TriangleGroup {
  double gradients[4][triangle_group_size];  ///< w of F = (x1 - x0) w1^T + (x2 - x0) w2^T: w1, then w2 [1/m]
  double area[triangle_group_size];          ///< [m^2]
  std::array<int, triangle_group_size> vertices[3];
  std::array<int, triangle_group_size> slots[3];  ///< of blocks (1, 0), (2, 0), (2, 1) in a BlockPattern
  int count = 0;                                  ///< triangles; the lanes behind them repeat the last
};

/// Bending of a sheet for D = 1. Quadratic models act through `stiffness` on each coordinate alike.
struct BendingOperator {
  data::BendingModel model;
  RowGroups stiffness;              ///< empty for the hinge model
  RowGroups elimination_stiffness;  ///< the same in elimination order
  std::vector<double> stand_in;     ///< one number a block of the pattern: a sparser stiffness to factorize
};

/// Those made so far, for all environments of a sheet.
struct BendingOperators {
  std::mutex mutex;
  std::map<std::pair<data::BendingModel, double>, std::shared_ptr<const BendingOperator>> made;
};

/// Sparsity, ordering and places of the elements in the system matrix: what depends on the mesh alone.
struct SheetPlan {
  Sheet sheet;
  std::vector<Hinge> hinges;
  BlockPattern pattern;   ///< neighbours over an edge, then those across a hinge
  size_t edge_count = 0;  ///< of the pattern's pairs, those over an edge
  std::shared_ptr<const SymbolicFactor> symbolic;
  ProductPattern triangle_product, full_product;  ///< without and with the neighbours across a hinge
  std::vector<TriangleGroup> triangle_groups;
  std::vector<std::array<BlockSlot, 6>>
      hinge_slots;  ///< blocks (1,0), (2,0), (2,1), (3,0), (3,1), (3,2) of a hinge
  std::shared_ptr<BendingOperators> bending = std::make_shared<BendingOperators>();
};

std::shared_ptr<const SheetPlan> make_sheet_plan(const Sheet& sheet);

/// Made once for a sheet, model and, where it matters, Poisson's ratio, and kept with the plan; threads may
/// ask at once. Throws data::InputError where the model needs a flat rest shape and the sheet has none.
const BendingOperator& bending_operator(const SheetPlan& plan, data::BendingModel model,
                                        double poissons_ratio);

/// Bending operators that were made for a plan so far.
std::size_t count_bending_operators(const SheetPlan& plan);

}  // namespace flash::sim
