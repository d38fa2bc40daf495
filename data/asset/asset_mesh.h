#pragma once
#include <Eigen/Core>

#include "data/asset/asset.h"
#include "data/mesh/mesh.h"

namespace flash::data {

/// The asset's triangle mesh. Throws InputError where it is so large that it must be in millimetres, and for
/// tetrahedra.
TriangleMesh load_rest_mesh(const Asset& asset);

/// The asset's triangle mesh, moved by its transformation.
TriangleMesh load_asset_mesh(const Asset& asset);

/// The asset's tetrahedra, moved likewise. Throws InputError where they are so large, and for a sheet.
TetMesh load_asset_tet_mesh(const Asset& asset);

/// Rotation about fixed x, then y, then z [deg], then translation.
Eigen::Matrix3d rotation_from_degrees(const Eigen::Vector3d& degrees);

}  // namespace flash::data
