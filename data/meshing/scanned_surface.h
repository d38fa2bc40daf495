#pragma once
#include <cstddef>
#include <string>

#include "data/meshing/remesh.h"
#include "data/meshing/surface_topology.h"

namespace flash::data {

struct ScanSettings {
  double edge = 0.01;    ///< of the triangles [m]
  double smoothing = 0;  ///< standard deviation of the weights of a cloud's points [m]; 0: 3/4 of the edge
  double holes = 0.03;   ///< diameter up to which holes are closed [m]
};

/// A scanned sheet as a mesh to simulate, and what became of the scan.
struct ScannedSurface {
  TriangleMesh mesh;  ///< one part, two triangles an edge at most, one fan about each vertex
  int euler = 0, borders = 0;
  EdgeLengths edges;
  std::size_t points = 0;    ///< of the scan, or vertices of its mesh
  std::size_t outliers = 0;  ///< samples of a cloud, of an edge length / 4, that lie apart
  double dropped = 0;        ///< share of the area in parts that hang on nothing
  int filled = 0;            ///< holes
  double distance_rms = 0;   ///< of the scan's points within 3 edges of the mesh [m]
  double far_points = 0;     ///< share of those farther off
};

/// The surface that a cloud lies about, as sampled_surface finds it. Throws InputError naming `source`
/// where the points are too few, too far apart for the edge, or would take more than 200,000 vertices.
ScannedSurface mesh_of_cloud(const Points& cloud, const ScanSettings& settings, const std::string& source);

/// The surface of a scanner's own mesh. Throws InputError, too, where it is no surface.
ScannedSurface mesh_of_surface(const TriangleMesh& mesh, const ScanSettings& settings,
                               const std::string& source);

}  // namespace flash::data
