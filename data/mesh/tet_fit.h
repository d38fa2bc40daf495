#pragma once
#include <optional>
#include <string>

#include "data/mesh/mesh.h"

namespace flash::data {

/// Two outer faces of a mesh of tetrahedra that should not be there.
struct Misfit {
  enum class Kind {
    doubled,   ///< the same three places, by vertices that are not joined
    apart,     ///< they lie on each other and are not one face: each body could slide along the other
    crossing,  ///< they pass through each other
  };
  Kind kind = Kind::apart;
  Eigen::Vector3i first = Eigen::Vector3i::Zero(), second = Eigen::Vector3i::Zero();
};

/// A pair of outer faces that do not fit: in one plane with a common area; or pass through each other; or
/// cut one and the same square of vertices along either diagonal, whether it is flat or not. Empty where all
/// fit. `mesh`: as check_tet_mesh wants it otherwise. Time grows as n log n.
std::optional<Misfit> first_misfit(const TetMesh& mesh);

/// Throws InputError naming `source`, both faces and what to do.
void check_fit(const TetMesh& mesh, const std::string& source);

}  // namespace flash::data
