#pragma once
#include <string>

#include "data/mesh/mesh.h"

namespace flash::data {

/// Of a mesh with vertices in one place that are not joined, as files have them along seams of their texture:
/// how many, how many parts it falls into, and what to do. Empty where each vertex has a place of its own.
std::string seam_warning(const TriangleMesh& mesh);

}  // namespace flash::data
