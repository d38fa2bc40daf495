#pragma once
#include <vector>

#include "data/mesh/mesh.h"
#include "data/picture/picture.h"

namespace flash::data {

/// A mesh in a picture.
struct PicturedMesh {
  TriangleMesh mesh;
  Colour colour;
};

struct MeshPictureSettings {
  int width = 640, height = 560;  ///< [px]
  double azimuth = -60;           ///< where the eye stands: from the x axis towards y [deg]
  double elevation = 20;          ///< above the horizon [deg]
};

/// Meshes as a far eye sees them, z up, lit from the eye's upper left on both sides of each triangle. The
/// picture is filled by what all of them take. Where one lies on another, the one that is named first shows.
Picture draw_meshes(const std::vector<PicturedMesh>& meshes, const MeshPictureSettings& settings = {});

}  // namespace flash::data
