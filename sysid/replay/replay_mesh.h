#pragma once
#include <string>

#include "data/recording/recording.h"
#include "sysid/replay/replay.h"

namespace flash::sysid {

/// "sheet:0.4x0.4:0.02[:pattern]" or "box:0.1x0.03x0.03:0.01" with its cell times a factor; empty for
/// anything else.
std::string scaled_cell(const std::string& specification, double factor);

/// Whether a recorded object can be meshed anew with cells of any size: it has a specification, and does not
/// start in a shape of its own.
bool takes_any_cell(const data::Recording& recording);

/// Meshes a recording as the settings say: settings.mesh in place of its own, cells times
/// settings.cell_scale, and smaller ones towards the grasps (grade_towards_grasps). A specification is meshed
/// anew. Of a sheet that does not take any cell, all cells are halved, as often as comes next to that factor
/// and once at least, those at the grasps too.
void mesh_as_set(const ReplaySettings& settings, data::Recording& recording);

/// The same of a recording on the mesh of a replay, where `settings` have another mesh or scale than it.
void mesh_anew(const Replay& replay, const ReplaySettings& settings, data::Recording& recording);

}  // namespace flash::sysid
