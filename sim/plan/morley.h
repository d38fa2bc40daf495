#pragma once
#include <Eigen/SparseCore>
#include <vector>

#include "data/asset/material.h"
#include "data/mesh/mesh.h"
#include "sim/plan/edge.h"
#include "sim/scene/sheet.h"

namespace flash::sim {

/// Uncondensed Morley plate, D = 1 [1/m^2]: energy per coordinate of the position
/// 1/2 (x^T xx x + 2 x^T xe theta + theta^T ee theta). theta_e = dx/dn at the midpoint of edge e, n = t x N
/// with t the unit direction a -> b and N the sheet normal: out of the sheet on a boundary edge.
struct MorleyPlate {
  std::vector<Edge> edges;
  Eigen::SparseMatrix<double> xx;  ///< vertices x vertices
  Eigen::SparseMatrix<double> xe;  ///< vertices x edges
  Eigen::SparseMatrix<double> ee;  ///< edges x edges, positive definite
};

/// Morley 1968; quadratic per triangle with constant curvature
/// k = 1/A sum_e n (l_e n theta_e + t (x_b - x_a))^T, energy A/2 [nu |k11 + k22|^2 + (1 - nu) |k|^2]. A woven
/// sheet has along warp and weft, with r = D_2 / D_1 and q = twisting_ratio,
/// A/2 [|k11|^2 + r |k22|^2 + 2 nu sqrt(r) k11 k22 + 2 (1 - nu) q sqrt(r) |k12|^2], D = D_1 (Huber 1923: q =
/// 1). Where a clamp holds all vertices of stiff triangles, its border keeps its slope too. With the places
/// of the vertices alone it would turn within a cell, an error of first order. Throws data::InputError unless
/// the rest shape is flat to 1e-6 of its size and -1 < nu < 1.
MorleyPlate morley_plate(const Sheet& sheet, double poissons_ratio, const data::Weave& weave = {});

/// Prescribed derivative of the position along the outward normal n (see MorleyPlate) of the edge a - b; the
/// undeformed sheet has slope = n.
struct ClampedEdge {
  int vertex_a, vertex_b;
  Eigen::Vector3d slope;
};

/// Plate with its edge unknowns condensed: energy D (1/2 tr(x^T stiffness x) - tr(force^T x) + constant).
struct CondensedPlate {
  Eigen::SparseMatrix<double> stiffness;  ///< vertices x vertices [1/m^2]
  data::Points force;                     ///< of the clamped edges [1/m]; zero without any
  double constant = 0.0;
  double excess = 0.0;  ///< by how much of it dropping raises the energy of a sheet bent evenly, at most
};

/// The edge unknowns at their minimum theta = T x + (clamps), T = -ee^-1 ex, free edges natural. T decays by
/// about a factor of three a cell. Entries below sqrt(drop_tolerance) |e| / (A_left + A_right) are dropped
/// but at a, b and the vertex on the left of the edge; the rest is moved so that affine positions keep their
/// slopes. The stiffness stays positive semi-definite, zero on affine positions, and above the exact one by
/// the square of what was dropped. On cells of like sides that is at most 0.2 % on any mode up to nu = 0.3
/// and 0.8 % at nu = 0.45 with 1e-6, for about 100 entries a row; see `excess` for others.
/// drop_tolerance = 0 is exact. Otherwise time grows with the number of vertices (see decaying_solution).
CondensedPlate condensed_plate(const Sheet& sheet, double poissons_ratio,
                               const std::vector<ClampedEdge>& clamped, double drop_tolerance = 1e-6,
                               const data::Weave& weave = {});

/// The stiffness without clamped edges, D = 1 [1/m^2]. `drop_tolerance` is made smaller by tens until the
/// excess is at most 1 %. On cells of like sides 1e-6 is small enough. Long cells, and sheets that twist much
/// more easily than they bend, take several times the entries a row.
Eigen::SparseMatrix<double> plate_bending_stiffness(const Sheet& sheet, double poissons_ratio,
                                                    double drop_tolerance = 1e-6,
                                                    const data::Weave& weave = {});

}  // namespace flash::sim
