#pragma once
#include <Eigen/Geometry>
#include <vector>

#include "data/mesh/mesh.h"

namespace flash::data {

/// Where on a surface something is.
struct SurfacePoint {
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< [m]
  int triangle = -1;
};

/// Nearest points on a surface, exactly, by a tree of boxes.
class TriangleTree {
 public:
  explicit TriangleTree(TriangleMesh mesh);  ///< at least one triangle
  SurfacePoint nearest(const Eigen::Vector3d& point) const;
  const TriangleMesh& mesh() const { return mesh_; }

 private:
  struct Node {
    Eigen::AlignedBox3d box;
    int begin, end;  ///< places in order_
    int right;       ///< the second child; the first one follows its parent. -1 of a leaf
  };
  int build(int begin, int end, const Points& middles);

  TriangleMesh mesh_;
  std::vector<int> order_;
  std::vector<Node> nodes_;
};

/// The point of the triangle a, b, c nearest to p (Ericson 2005, section 5.1.5).
Eigen::Vector3d nearest_in_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                    const Eigen::Vector3d& b, const Eigen::Vector3d& c);

}  // namespace flash::data
