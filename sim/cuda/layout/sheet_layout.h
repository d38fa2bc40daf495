#pragma once
#include <vector>

#include "sim/cuda/layout/edge_sources.h"
#include "sim/cuda/layout/front_plan.h"
#include "sim/plan/sheet_plan.h"

namespace flash::sim::cuda {

/// The structure of a sheet for kernels, vertices in the order of a FrontPlan.
struct SheetLayout {
  int size = 0, triangle_count = 0;
  std::vector<int> order;  ///< vertex at each place

  // Triangles, each array by triangle. Vertices ascend as numbered in the mesh, so that blocks need no turn.
  std::vector<int> triangle_vertices;  ///< three times triangle_count
  std::vector<double> gradients;       ///< four times, as in TriangleGroup
  std::vector<double> areas;
  /// What of the triangles enters each vertex: 3 * corner * triangle_count + triangle, where the first of
  /// three numbers is, triangle_count apart.
  std::vector<int> corner_starts, corners;

  // Blocks of the pattern.
  std::vector<EdgeSources> pair_sources;       ///< of each pair; those over no edge have none
  std::vector<int> block_rows, block_columns;  ///< places of the vertices of each block
  int block_count = 0;

  // Block rows, in slices of vertices (sliced ELLPACK): as many blocks a vertex as the fullest of its slice,
  // that on the diagonal first.
  std::vector<int> slice_starts;           ///< of each slice, in blocks a vertex, and their end
  std::vector<int> slice_columns;          ///< slice_size a block; the vertex itself where there is none
  std::vector<EdgeSources> slice_sources;  ///< likewise, none on the diagonal

  // The scalar rows, four at a time as in RowGroups, and bundle_groups of them side by side. In a step a lane
  // of a warp takes a column of a group, whose four lanes share its columns. Empty for hinges.
  std::vector<int> group_rows;      ///< four of each group, bundle after bundle; -1 where there is none
  std::vector<int> bundle_starts;   ///< of each bundle, in steps, and their end
  std::vector<int> step_columns;    ///< one a lane and step
  std::vector<double> step_values;  ///< four likewise, of the rows of the lane's group
  std::vector<double> stand_in;     ///< one number a block

  // Hinges; without them where the model is another. Each array by hinge.
  int hinge_count = 0;
  std::vector<int> hinge_vertices;                       ///< four times hinge_count
  std::vector<double> hinge_weights, hinge_rest_angles;  ///< as in Hinge
  std::vector<double> hinge_rest_areas;                  ///< twice
  std::vector<int> hinge_corner_starts, hinge_corners;   ///< of each vertex: 4 * hinge + corner
  std::vector<int> hinge_source_starts, hinge_sources;   ///< of each block: 16 * hinge + 4 * row + column
  std::vector<double> vertex_area;                       ///< by place [m^2]
  std::vector<double> edge_lengths;                      ///< at rest; the first pairs are the edges [m]
};

SheetLayout lay_out(const SheetPlan& plan, const BendingOperator& bending, const FrontPlan& fronts);

/// What depends on the bending operator: scalar rows and hinges. The rest is empty.
SheetLayout lay_out_bending(const SheetPlan& plan, const BendingOperator& bending, const FrontPlan& fronts);

}  // namespace flash::sim::cuda
