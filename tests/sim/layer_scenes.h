#pragma once
#include "sim/newton/solver.h"

namespace flash::sim {

/// A world in which sheets or solids meet themselves or each other.
struct LayerScene {
  Sheet sheet;
  Environment environment;
};

/// A pile of square sheets on a rough plane, each let go just above the one below. Their meshes differ.
LayerScene pile(int count, const SelfContact& contact, double side, int cells);

/// A sheet on a larger one, on a plane tilted to a `slope`, its tangent.
LayerScene layer_on_incline(double slope, const SelfContact& contact);

/// Cells along a side of the lower and the upper block, and how far the upper one's mesh is turned against
/// the lower one's [rad].
struct BlockMeshes {
  int lower = 4, upper = 3;
  double turn = 0;
};

/// A soft block on a larger one whose bottom is held, both tilted to a `slope`; `sheet_between`: with a sheet
/// between them. The block on top is the last body.
LayerScene block_on_incline(double slope, const SelfContact& contact, bool sheet_between,
                            const BlockMeshes& meshes = {});

/// Bends a flat sheet that begins at x = 0 about its middle to a U of this radius [m], which opens towards
/// -x.
void bend_to_hairpin(double radius, data::Points& x);

/// A sheet bent to a U whose legs fly at each other at `speed` [m/s].
LayerScene thrown(const SelfContact& contact, double speed);

/// A sheet on a plane whose one end is carried over and laid down on the other in a second, in steps of 10
/// ms, and let go.
LayerScene fold(const SelfContact& contact);

/// A sheet folded in two, then in two across, on a plane. In 0.7 s a plate comes down to
/// the height of `plate_height` [m].
LayerScene folded_twice_and_pressed(const SelfContact& contact, double plate_height);

/// A narrow strip in an open overhand knot (the long trefoil of Shastri 1992), whose ends are pulled apart at
/// one speed, until their distance is a `share` of the length of the strip, in `seconds`.
LayerScene strip_knot(const SelfContact& contact, double share, double seconds);

/// Length of the strip of strip_knot [m].
double strip_length(const LayerScene& knot);

/// Two sheets side by side, upright, let go at 0.2 s between two fingers. One finger has a friction of
/// `finger_friction` on the second sheet. The other has none: the first sheet hangs on the second one alone.
LayerScene pinched_layers(const SelfContact& contact, double finger_friction);

/// Mean velocity of the vertices of a body [m/s].
Eigen::Vector3d mean_velocity(const LayerScene& scene, const Body& body);

}  // namespace flash::sim
