#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "data/mesh/mesh.h"
#include "sim/cpu/instruction_level.h"
#include "sysid/replay/surface_tree.h"

namespace flash::sysid {

/// The point of a triangle surface nearest to a query point.
struct SurfacePoint {
  int triangle = -1;
  Eigen::Vector3d barycentric = Eigen::Vector3d::Zero();  ///< weights of the triangle's corners, sum 1
  Eigen::Vector3d position = Eigen::Vector3d::Zero();     ///< [m]
  double distance = 0;                                    ///< [m], not negative
};

/// Nearest point of one triangle by its Voronoi regions (Ericson, Real-Time Collision Detection, 5.1.5).
SurfacePoint nearest_on_triangle(const Eigen::Vector3d& query, const Eigen::Vector3d& a,
                                 const Eigen::Vector3d& b, const Eigen::Vector3d& c);

/// Exact nearest-point queries against a surface that moves. The hierarchy follows the layout of the sheet
/// once: eight triangles a packet, eight children a node, so that a deformed sheet needs new boxes only,
/// never a new tree.
class SurfaceDistance {
 public:
  /// `layout`: positions that neighbourhood is judged by, usually the rest shape; also the first surface.
  SurfaceDistance(const data::Triangles& triangles, const data::Points& layout,
                  sim::InstructionLevel level = sim::highest_instruction_level());

  /// Moves the surface, O(triangles).
  void move(const data::Points& positions);

  /// `hint`: a triangle likely to be near, as the last answer for the same point; it changes speed only.
  SurfacePoint nearest(const Eigen::Vector3d& query, int hint = -1) const;

  /// All triangles, neighbours in the layout one after the other.
  std::vector<int> triangles_in_order() const;

 private:
  const SurfaceKernels* kernels_;
  data::Triangles triangles_;
  data::Points positions_;
  std::vector<int> order_;    // slot -> triangle, -1 past the end of the last packet
  std::vector<int> slot_of_;  // triangle -> slot
  std::vector<TriangleCorners> corners_;
  std::vector<TrianglePacket> packets_;
  std::vector<std::vector<BoxNode>> levels_;  // levels_[0] bounds packets, the last level has one node
};

}  // namespace flash::sysid
