#pragma once
#include <Eigen/Core>
#include <array>
#include <functional>
#include <vector>

#include "data/mesh/mesh.h"

namespace flash::data {

/// A line on a sheet towards which its cells shrink: the outline of what a gripper holds.
struct Outline {
  /// Signed distance of a place of the rest shape from it, below zero inside [m].
  std::function<double(const Eigen::Vector3d&)> distance;
  double near = 0.005;                     ///< edge length of the cells there [m]
  std::vector<Eigen::Vector3d> corners{};  ///< where it turns: the cells have a vertex there [m]
  double near_corner = 0.001;              ///< edge length of the cells there [m]
};

/// A sheet of which every vertex has two places. Both are refined alike.
struct PlacedSheet {
  TriangleMesh rest;
  Points start;  ///< where the vertices start [m]
  /// Of each vertex that was added, behind the first ones: the ends of the edge that it was put on, -1 inside
  /// a triangle.
  std::vector<std::array<int, 2>> added{};
};

/// Triangles cut in two at the middle of their longest edge (Rivara 1984) until edges are no longer than
/// about
///
///     near + (growth - 1) |distance|   and   near_corner + (corner_growth - 1) |x - corner|
///
/// of every outline, so that neighbours differ in size by the growth. No angle becomes less than half of the
/// least there was. The vertices that there were keep their numbers and stand first.
PlacedSheet refined_towards(const PlacedSheet& sheet, const std::vector<Outline>& outlines,
                            double growth = 1.3, double corner_growth = 1.5);

/// The same sheet with edges along the outlines: vertices near one slide along their edges onto it, and the
/// edges that still cross it are cut there. Borders stay, and vertices keep their numbers. An outline within
/// one cell is not seen: refine towards it first.
PlacedSheet aligned_with(const PlacedSheet& sheet, const std::vector<Outline>& outlines);

/// Every triangle cut in four by the middles of its edges.
PlacedSheet halved_cells(const PlacedSheet& sheet);

}  // namespace flash::data
