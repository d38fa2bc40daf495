#pragma once
#include "sim/cpu/block_pattern.h"
#include "sim/step/contact_set.h"

namespace flash::sim {

/// The friction force of a slipping vertex turns with its slip: adds that stiffness to the vertex's block.
void add_slip_stiffness(const ContactSet& contacts, BlockValues<double>& values);

/// A vertex that slides over a round surface turns its normal force: adds the Hessian of the gap times
/// -lambda_n.
void add_surface_curvature(const ContactSet& contacts, BlockValues<double>& values);

/// P B P + (I - P) scaled to its neighbours: the matrix of the free directions.
void restrict_matrix(const BlockPattern& pattern, const ContactSet& contacts, BlockValues<double>& values);

/// The iterate about which a problem is linear.
struct Linearization {
  const ContactStep& step;
  const data::Points& positions;  ///< [m]
  const data::Points& force;      ///< what each vertex needs from outside [N]
  const data::Points& residual;   ///< what is left of it [N]
};

/// One exchange of the active set of the linear problem: holds vertices that `direction` drives into a
/// surface and frees those that the surface would have to pull (`force`: what they would need at its end);
/// what was let go once is not held again. `gradient` of a freed vertex becomes its row of the force at the
/// iterate, of one that still slides on another surface that of the residual. Returns whether any changed.
bool exchange_contacts(const Linearization& iterate, const data::Points& direction, const data::Points& force,
                       data::Points& gradient, ContactSet& contacts);

/// Holds vertices on a surface that `direction` would take below it, and changes nothing else: directions of
/// the problem that is left lead down, however short the step. Returns whether any.
bool hold_touching(const Linearization& iterate, const data::Points& direction, ContactSet& contacts);

}  // namespace flash::sim
