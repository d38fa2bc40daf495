#pragma once
#include <vector>

#include "data/mesh/obstacle_mesh.h"
#include "sim/law/vector3.h"

namespace flash::sim {

/// A triangle of a surface, with all that queries ask of it.
struct SurfaceTriangle {
  int vertices[3];
  Vector3<double> corners[3];
  Vector3<double> normal;           ///< unit, out of what a closed surface bounds
  Vector3<double> edge_normals[3];  ///< pseudonormal of the edge from corner k to the next
  bool at_border[3];                ///< whether that edge has no other triangle
  int part;                         ///< number of the part whose triangles hang together by edges
};

/// A node of the hierarchy: a box about triangles. An inner one has its children at `first` and `first + 1`.
struct SurfaceNode {
  Vector3<double> low, high;  ///< [m]
  int first = 0;
  int count = 0;  ///< triangles from `first` in `order`; 0: an inner node
};

/// A surface of triangles in a frame of its own, with a hierarchy of boxes over them. It is built once, the
/// same on every machine, and does not change. Plain arrays, so that a device may take them over.
struct SurfaceMesh {
  bool closed = false;
  std::vector<SurfaceTriangle> triangles;
  std::vector<Vector3<double>> vertex_normals;  ///< pseudonormals, weighted by the triangles' angles
  std::vector<bool> border_vertices;            ///< whether a vertex is an end of such an edge
  std::vector<SurfaceNode> nodes;               ///< the first is the root
  std::vector<int> order;                       ///< triangles, those of a leaf side by side

  int size() const { return static_cast<int>(triangles.size()); }
};

SurfaceMesh make_surface_mesh(const data::ObstacleMesh& mesh);

/// The part of a triangle that a point of it lies on.
enum class SurfaceFeature { face, edge, corner };

/// The point of a triangle that is nearest to another point.
struct SurfacePlace {
  int triangle = -1;
  SurfaceFeature feature = SurfaceFeature::face;
  int number = 0;  ///< of the edge or the corner
  Vector3<double> point{};
  double distance{};  ///< [m], not negative
};

SurfacePlace nearest_on(const SurfaceMesh& mesh, int triangle, const Vector3<double>& point);

/// The nearest of all triangles, to rounding; each is asked at most once, about log(size) where the surface
/// is near.
SurfacePlace nearest_on(const SurfaceMesh& mesh, const Vector3<double>& point);

/// Those of all triangles within `reach` [m], by the numbers of the triangles.
std::vector<SurfacePlace> near_on(const SurfaceMesh& mesh, const Vector3<double>& point, double reach);

/// The normal whose scalar product with the way to a point tells the side of the surface that the point is
/// on, where `place` is nearest to it (Baerentzen and Aanaes 2005). Not of unit length.
const Vector3<double>& pseudonormal(const SurfaceMesh& mesh, const SurfacePlace& place);

/// Whether a place is on the border of an open surface.
bool is_on_border(const SurfaceMesh& mesh, const SurfacePlace& place);

/// Where a straight way goes through a triangle.
struct SurfaceCrossing {
  double share = 0;  ///< of the way before it
  int triangle = -1;
  bool along_normal = false;  ///< whether it goes out by the triangle's normal
};

/// All of them, in order. What passes exactly through an edge or a corner meets each triangle there: none is
/// missed.
std::vector<SurfaceCrossing> crossings_of(const SurfaceMesh& mesh, const Vector3<double>& from,
                                          const Vector3<double>& to);

}  // namespace flash::sim
