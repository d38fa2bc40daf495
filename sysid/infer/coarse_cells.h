#pragma once
#include <string>
#include <vector>

#include "sysid/replay/replay.h"

namespace flash::sysid {

/// Edge length of equilateral triangles as large as those in which a point of a sheet lies on average [m].
double typical_cell(const data::TriangleMesh& mesh);

/// A sheet that a gripper lifts off a table leaves it in a fold of about the radius
///
///     (D / (rho g))^(1/3),
///
/// rho the areal density: its bending length (Peirce 1930). Where cells take more than 0.4 of that, the line
/// along which the sheet leaves the table moves from vertex to vertex, an error of first order that friction
/// answers for. What a warning then says; of the first such recording; empty where there is none:
/// cells are smaller, or there is no table, no weight, no bending or a solid.
std::string coarse_cells_text(const std::vector<Replay>& replays, const ReplayCandidate& candidate);

}  // namespace flash::sysid
