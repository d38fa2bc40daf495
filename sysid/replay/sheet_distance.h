#pragma once
#include <vector>

#include "sysid/replay/mark.h"
#include "sysid/replay/surface_distance.h"

namespace flash::sysid {

/// Where observations of a moving sheet belong on it: points on its surface, outlines on its border, marks at
/// the place they were put.
class SheetDistance {
 public:
  /// `layout`: see SurfaceDistance; also the first positions.
  SheetDistance(const data::Triangles& triangles, const data::Points& layout);

  void move(const data::Points& positions);
  /// Moves it for all that searches the border alone, or not at all, in less time.
  void move_border(const data::Points& positions);

  /// Nearest point of the surface, as SurfaceDistance::nearest finds it.
  SurfacePoint nearest(const Eigen::Vector3d& query, int hint = -1) const {
    return surface_.nearest(query, hint);
  }

  /// All triangles, neighbours on the sheet one after the other.
  std::vector<int> triangles_in_order() const { return surface_.triangles_in_order(); }

  /// Nearest point of the border, the edges of one triangle only; triangle -1 where there is no border.
  SurfacePoint nearest_on_border(const Eigen::Vector3d& query) const;

  /// Where a mark is, and how far that is from `query`.
  SurfacePoint mark(const Mark& mark, const Eigen::Vector3d& query) const;

 private:
  struct BorderEdge {
    int triangle, first;         // corners first and first + 1
    Eigen::Vector3d a, ab;       // [m]
    double inverse_squared = 0;  // of the length; zero for an edge without length
  };

  data::Triangles triangles_;
  data::Points positions_;
  SurfaceDistance surface_;
  std::vector<BorderEdge> border_;
};

}  // namespace flash::sysid
