#pragma once
#include <string>

#include "data/recording/recording.h"

namespace flash::sysid {

/// Puts the mesh that a specification or a file names in place of the recording's. The start follows its
/// pose; what was selected by vertices takes those that lie in the same place. Throws data::InputError where
/// the recording starts from a mesh of its own, or the mesh is of another kind or size.
void replace_mesh(const std::string& mesh, data::Recording& recording);

/// The same with other triangles of the same sheet.
void place_mesh(data::TriangleMesh mesh, data::Recording& recording);

}  // namespace flash::sysid
