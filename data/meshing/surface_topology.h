#pragma once
#include <string>
#include <vector>

#include "data/mesh/mesh.h"

namespace flash::data {

/// What a surface is, whatever its shape.
struct SurfaceTopology {
  int components = 0;                     ///< parts that hang together over edges
  int euler = 0;                          ///< vertices in use - edges + triangles; 1 of a disc, 2 of a sphere
  std::vector<std::vector<int>> borders;  ///< vertices of each border, the longest first; along its triangles
};

/// Of a surface as checked_surface lets through.
SurfaceTopology topology_of(const TriangleMesh& mesh);

/// Vertices at one place become one, triangles without area and vertices without a triangle go, and a vertex
/// that joins fans of triangles in a point alone becomes one vertex a fan. Throws InputError naming `source`
/// and an edge of more than two triangles, or of two that run against each other.
TriangleMesh checked_surface(const TriangleMesh& mesh, const std::string& source);

/// The part with the largest area; `dropped` gets the share of the area that the others have.
TriangleMesh largest_component(const TriangleMesh& mesh, double& dropped);

/// A surface without its small holes.
struct FilledSurface {
  TriangleMesh mesh;
  int filled = 0;
};

/// Closes each border but the longest whose length is at most pi `diameter` [m] with triangles of the least
/// area between its own vertices (Barequet and Sharir 1995). One of more than 400 edges stays.
FilledSurface fill_holes(const TriangleMesh& mesh, double diameter);

double area_of(const TriangleMesh& mesh);  ///< [m^2]

}  // namespace flash::data
