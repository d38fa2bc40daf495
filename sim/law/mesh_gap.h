#pragma once
#include "sim/law/contact_way.h"
#include "sim/law/surface_mesh.h"

namespace flash::sim {
inline namespace FLASH_LEVEL {

/// How a vertex stands against one of the surfaces of a mesh, in the frame of the mesh.
struct MeshGap {
  double distance{};                      ///< less the margin, negative inside [m]
  Vector3<double> normal{};               ///< unit, to the side that the vertex is on
  Vector3<double> curvature_direction{};  ///< as in SurfaceGap, of an edge that the margin rounds [m^-1/2]
  double ball_curvature{};                ///< likewise of a corner [1/m]
  double depth{};  ///< below this surface at the start of the way, where it starts inside [m]
  int triangle = -1;
};

/// Surfaces of a mesh that meet at a vertex: one on a smooth part, two in a crease, three in a corner. Where
/// there are fewer, the first stands for the others, too, and bears the load.
struct MeshGaps {
  MeshGap surfaces[most_mesh_surfaces];
  bool starts_inside = false;
};

/// Signed distance of a place; of an open mesh the distance from either side. `margin`: how far outside of
/// the triangles the surface is [m].
MeshGap gap_at(const SurfaceMesh& mesh, double margin, const Vector3<double>& place);

/// How a vertex stands at the end of a straight way, all in the frame of the mesh:
/// - one whose way went in and did not come out stands against the triangle through which it went in. So does
///   one that came out on the far side. A way that comes out beside, by a triangle that is turned by less
///   than 96 degrees against the first, rounds an edge and is let go.
/// - where the nearest triangle is turned by less than 60 degrees against that one, the mesh is met there as
///   the smooth surface it stands for: the vertex stands against what is nearest.
/// - outside it stands against what is nearest, and in a crease or a corner, where the solid is not convex,
///   against each triangle that it is straight above.
/// - one that starts inside leaves by the nearest side, or along `way_out` where that is not zero.
MeshGaps gaps_after(const SurfaceMesh& mesh, double margin, const Vector3<double>& from,
                    const Vector3<double>& to, const Vector3<double>& way_out);

/// How far a place inside is from the surface along a unit direction [m]; no_such_side where the mesh is
/// open.
double depth_of(const SurfaceMesh& mesh, double margin, const Vector3<double>& place,
                const Vector3<double>& direction);

/// The last answer of gaps_after. A step asks for each surface of a mesh, and where a vertex was before.
struct MeshMemory {
  bool known = false;
  Vector3<double> from{}, to{}, way_out{};
  MeshGaps gaps;
};

}  // namespace FLASH_LEVEL
}  // namespace flash::sim
