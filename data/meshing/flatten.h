#pragma once
#include <string>

#include "data/mesh/mesh.h"

namespace flash::data {

/// A surface laid out in the plane.
struct FlatShape {
  Points vertices;               ///< of the surface, in the plane z = 0, triangles counter-clockwise [m]
  double width = 0, height = 0;  ///< of the least rectangle about it, the longer side along x, from 0 on [m]
  double largest_strain = 0;     ///< of its edges: |length in space / length in the plane - 1|
  double rms_strain = 0;         ///< the same over all edges, each counted by the area beside it
  int inverted = 0;              ///< triangles that are turned over
};

/// Lays a disc out as rigidly as possible: the layout minimises sum over triangles of area |F - R|^2, F the
/// gradient of the layout and R the rotation nearest to it (Liu et al. 2008, ARAP), from the least-squares
/// conformal layout (Levy et al. 2002). That is the layout of least elastic energy at nu = 0. A surface that
/// develops has no strain; a cap of a sphere, of radius r along the surface and Gaussian curvature K, has K
/// r^2 / 8 at its rim and K r^2 / (16 sqrt 2) rms. Throws InputError naming `source` unless the surface is
/// one disc: its Euler characteristic and its borders are told.
FlatShape flattened(const TriangleMesh& mesh, const std::string& source);

}  // namespace flash::data
