#pragma once

namespace flash::sysid {

// What the search in sysid/replay/kernels reads: plain arrays alone, as in sim/cpu/kernels.h.

/// Triangles of a packet, children of a node. Work.
inline constexpr int surface_width = 8;

/// Eight triangles, coordinate by coordinate: corner a, edges e = b - a and f = c - a, normal n = e x f and
/// the constants of the projections on edges and plane.
struct alignas(64) TrianglePacket {
  double a[3][surface_width], e[3][surface_width], f[3][surface_width], n[3][surface_width];
  double inverse_ee[surface_width], inverse_ff[surface_width], inverse_gg[surface_width];  // g = c - b
  double ee[surface_width], ef[surface_width], ff[surface_width];
  double inverse_determinant[surface_width];  // NaN for a triangle without area: then only its edges count
};

/// Eight boxes.
struct alignas(64) BoxNode {
  double low[3][surface_width], high[3][surface_width];
};

struct SurfaceTree {
  const TrianglePacket* packets;
  const BoxNode* const* levels;  ///< the first bounds packets
};

/// Corners of eight triangles, numbers of vertices.
struct TriangleCorners {
  int of[3][surface_width];
};

/// A surface that moves.
struct MovedSurface {
  const TriangleCorners* corners;  ///< one a packet
  const double* positions;         ///< x, y, z of each vertex
  int packets;
  TrianglePacket* moved;
  BoxNode* boxes;  ///< of the packets, eight a node
};

struct SurfaceKernels {
  /// Takes packets and their boxes to the positions.
  void (*move)(const MovedSurface& surface);
  /// Looks for a triangle nearer to `query` than `best` [m^2] among those of a packet, or below a node.
  /// `slot`: eight times the packet and the place in it.
  void (*search_packet)(const SurfaceTree& tree, int packet, const double* query, double& best, int& slot);
  void (*search)(const SurfaceTree& tree, int level, int node, const double* query, double& best, int& slot);
};

}  // namespace flash::sysid
