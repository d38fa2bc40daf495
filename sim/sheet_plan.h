#pragma once
#include <Eigen/SparseCore>
#include <array>
#include <memory>
#include <vector>

#include "data/material.h"
#include "sim/block_cholesky.h"
#include "sim/hinge_bending.h"
#include "sim/sheet.h"

namespace flash::sim {

/// A 3 x 3 block of the system matrix between two vertices; stored once, for row > column.
struct BlockSlot {
  int block;       ///< index among the blocks of a BlockPattern, the diagonal ones first
  bool transpose;  ///< the stored block is that of (column, row)
};

/// Sparsity, ordering and places of the elements in the system matrix: what depends on the mesh alone.
struct SheetPlan {
  Sheet sheet;
  std::vector<Hinge> hinges;
  BlockPattern pattern;  ///< neighbours over an edge and across a hinge
  std::shared_ptr<const SymbolicFactor> symbolic;
  std::vector<std::array<BlockSlot, 3>> triangle_slots;  ///< blocks (1, 0), (2, 0), (2, 1) of a triangle
  std::vector<std::array<BlockSlot, 6>>
      hinge_slots;  ///< blocks (1,0), (2,0), (2,1), (3,0), (3,1), (3,2) of a hinge
};

std::shared_ptr<const SheetPlan> make_sheet_plan(const Sheet& sheet);

/// Bending of a sheet for D = 1. Quadratic models act through `stiffness` on each coordinate alike.
struct BendingOperator {
  data::BendingModel model;
  Eigen::SparseMatrix<double, Eigen::RowMajor> stiffness;  ///< exact; empty for the hinge model
  Eigen::SparseMatrix<double, Eigen::RowMajor>
      correction;  ///< stiffness less the stand-in; for the plate only
  std::vector<double>
      stand_in;  ///< one number a block of the pattern: a sparser stiffness for the Newton matrix
};

/// Throws data::InputError where the model needs a flat rest shape and the sheet has none.
std::shared_ptr<const BendingOperator> make_bending_operator(const SheetPlan& plan, data::BendingModel model,
                                                             double poissons_ratio);

}  // namespace flash::sim
