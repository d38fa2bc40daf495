#pragma once
#include <vector>

#include "sim/scene/sheet.h"

namespace flash::sim {

/// Makes stiff the triangles of which every vertex is `held` (by one thing that does not bend): they do not
/// bend, so that the sheet leaves them with their slope. Held places alone keep it to within a cell only: a
/// strip clamped so bends as if it were longer by half a cell. For all bending models. Returns how many
/// triangles of the sheet's bodies of triangles are so.
int keep_slopes(const std::vector<int>& held, Sheet& sheet);

/// Whether the sheet bends about the border of a patch of which the places alone are held: a triangle with
/// all vertices `held` that is not stiff has a neighbour that is not held.
bool slope_gives_way(const Sheet& sheet, const std::vector<int>& held);

/// The largest angle between two stiff triangles with a common edge at `places` of the sheet's vertices
/// [rad]. The plate takes stiff triangles to lie in a plane.
double bend_between_stiff(const Sheet& sheet, const data::Points& places);

}  // namespace flash::sim
