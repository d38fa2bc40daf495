#pragma once
#include <array>
#include <memory>
#include <mutex>
#include <span>
#include <utility>
#include <vector>

#include "data/asset/material.h"
#include "sim/cpu/instruction_level.h"
#include "sim/cpu/sheet_product.h"
#include "sim/cpu/symbolic_factor.h"
#include "sim/cpu/triangle_group.h"
#include "sim/plan/hinge_bending.h"
#include "sim/plan/solid_plan.h"
#include "sim/scene/sheet.h"

namespace flash::sim {

/// A 3 x 3 block of the system matrix between two vertices; stored once, for row > column.
struct BlockSlot {
  int block;        ///< index among the blocks of a BlockPattern, the diagonal ones first
  bool transposed;  ///< the stored block is that of (column, row)
};

/// Bending of a body for D = 1. Quadratic models act through `stiffness` on each coordinate alike.
struct BendingOperator {
  data::BendingModel model;
  const Kernels* kernels;           ///< as in the plan
  RowGroups stiffness;              ///< from the body's first vertex on; empty for the hinge model
  RowGroups elimination_stiffness;  ///< the same in elimination order of all vertices
  double largest_entry = 0;         ///< of the stiffness, in magnitude; roughly, of hinges [1/m^2]
  double flat_energy = 0;        ///< of the flat sheet, which has none but by rounding: magnitudes added up
  std::vector<double> stand_in;  ///< one number a block of the pattern: a sparser stiffness to factorize
};

/// Bending operators made so far for the bodies of a sheet, shared by its environments.
struct BendingOperators {
  std::mutex mutex;
  struct Key {
    int body;
    data::BendingModel model;
    double poissons_ratio;
    data::Weave weave;

    bool operator==(const Key&) const = default;
  };
  std::vector<std::pair<Key, std::shared_ptr<const BendingOperator>>> made;
};

/// The part of a plan that belongs to one body.
struct BodyPlan {
  Body body;  ///< as in the sheet
  int first_group = 0, group_count = 0;
  int first_hinge = 0, hinge_count = 0;
  double largest_entry = 0;  ///< of its stiffness for E t = 1 [1], of a solid for E = 1 [m], on the diagonal
};

/// Sparsity, ordering and places of the elements in the system matrix: what depends on the mesh alone, and
/// the kernels that work on it.
struct SheetPlan {
  Sheet sheet;
  const Kernels* kernels;  ///< of the instruction level that was asked for
  std::vector<Hinge> hinges;
  BlockPattern pattern;   ///< neighbours over an edge, then those across a hinge
  size_t edge_count = 0;  ///< how many of the pattern's pairs lie over an edge
  std::shared_ptr<const SymbolicFactor> symbolic;
  ProductPattern triangle_product, full_product;  ///< without and with the neighbours across a hinge
  std::vector<BodyPlan> bodies;
  std::vector<TriangleGroup> triangle_groups;  ///< each of triangles of one body
  std::vector<SolidElement> solid_elements;    ///< tetrahedra, in the order of the sheet's
  std::vector<std::array<BlockSlot, 6>>
      hinge_slots;  ///< blocks (1,0), (2,0), (2,1), (3,0), (3,1), (3,2) of a hinge
  std::shared_ptr<BendingOperators> bending = std::make_shared<BendingOperators>();
};

std::shared_ptr<const SheetPlan> make_sheet_plan(const Sheet& sheet,
                                                 InstructionLevel level = highest_instruction_level());

/// The bending operator of a model and a body, made once a Poisson's ratio and weave and kept with the plan;
/// threads may ask at once. That of a solid is empty. Throws data::InputError where the model needs a flat
/// rest shape and the body has none.
const BendingOperator& bending_operator(const SheetPlan& plan, data::BendingModel model,
                                        double poissons_ratio, int body = 0, const data::Weave& weave = {});

/// That of a material.
inline const BendingOperator& bending_operator(const SheetPlan& plan, const data::SheetMaterial& material,
                                               int body = 0) {
  return bending_operator(plan, material.bending_model, material.poissons_ratio, body, material.weave);
}

/// Bending operators that were made for a plan so far.
std::size_t count_bending_operators(const SheetPlan& plan);

}  // namespace flash::sim
