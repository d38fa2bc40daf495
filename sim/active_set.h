#pragma once
#include <vector>

#include "sim/block_cholesky.h"
#include "sim/vertex_constraint.h"

namespace flash::sim {

/// The friction force of a slipping vertex turns with its slip: adds that stiffness to the vertex's block.
void add_slip_stiffness(const std::vector<VertexConstraint>& constraints, BlockValues<double>& values);

/// A vertex that slides over a round surface turns its normal force: adds the Hessian of the gap times
/// -lambda_n.
void add_surface_curvature(const std::vector<VertexConstraint>& constraints, BlockValues<double>& values);

/// P B P + (I - P) scaled to its neighbours: the matrix of the free directions.
void restrict_matrix(const BlockPattern& pattern, const std::vector<VertexConstraint>& constraints,
                     BlockValues<double>& values);

/// One exchange of the active set of the linear problem: holds vertices that `direction` drives into a
/// surface and frees those that the surface would have to pull (`force`: what they would need at its end);
/// what was let go once is not held again. `gradient` of a freed vertex becomes its row of `force_before`, of
/// one that still slides on another surface that of `residual_before`. Returns whether any changed.
bool exchange_contacts(const data::Points& direction, const data::Points& force_before,
                       const data::Points& residual_before, const data::Points& force, data::Points& gradient,
                       std::vector<VertexConstraint>& constraints);

/// Holds vertices on a surface that `direction` would take below it, and changes nothing else: directions of
/// the problem that is left lead down, however short the step. Returns whether any.
bool hold_touching(const data::Points& direction, std::vector<VertexConstraint>& constraints);

}  // namespace flash::sim
