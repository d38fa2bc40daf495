#pragma once
#include "sim/cpu/block_pattern.h"
#include "sim/step/contact_set.h"

namespace flash::sim {

/// Adds the stiffness of friction to the blocks of slipping vertices: the force turns with the slip.
void add_slip_stiffness(const ContactSet& contacts, BlockValues<double>& values);

/// Adds the Hessian of the gap times -lambda_n to the blocks of vertices on round surfaces: the normal force
/// turns as they slide.
void add_surface_curvature(const ContactSet& contacts, BlockValues<double>& values);

/// P B P + Q B Q, with the blocks on the diagonal in Q = I - P alone: the matrix of the free directions. A
/// factor outlives its contacts. What they let go then finds its own stiffness there: with that of the
/// membrane, a thousand times that of bending, conjugate gradients took up to half as many iterations more.
void restrict_matrix(const BlockPattern& pattern, const ContactSet& contacts, BlockValues<double>& values);

/// The iterate about which a problem is linear.
struct Linearization {
  const ContactStep& step;
  const data::Points& positions;  ///< [m]
  const data::Points& force;      ///< what each vertex needs from outside [N]
  const data::Points& residual;   ///< what is left of it [N]
};

/// One exchange of the active set of the linear problem. Holds vertices that `direction` drives into a
/// surface. Frees those that the surface would have to pull: `force` is what they need at the end of the
/// direction. A touch that was released is not held again. The row of `gradient` of a freed vertex becomes
/// that of the force at the iterate, or that of the residual where it still slides on another surface.
/// Returns whether any vertex changed.
bool exchange_contacts(const Linearization& iterate, const data::Points& direction, const data::Points& force,
                       data::Points& gradient, ContactSet& contacts);

/// Holds vertices on a surface that `direction` would take below it, and changes nothing else. Directions of
/// the problem that is left lead down, however short the step. Returns whether any vertex was held.
bool hold_touching(const Linearization& iterate, const data::Points& direction, ContactSet& contacts);

}  // namespace flash::sim
