#include "sim/scene/sheet.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <map>
#include <string>

#include "data/error.h"

namespace flash::sim {

Sheet make_sheet(const data::TriangleMesh& rest) {
  Sheet sheet{rest, {}, Eigen::VectorXd::Zero(rest.vertices.rows())};
  std::map<std::array<int, 3>, int> seen;
  const double extent = rest.vertices.rows() > 0
                            ? (rest.vertices.colwise().maxCoeff() - rest.vertices.colwise().minCoeff()).norm()
                            : 0.0;
  for (int t = 0; t < rest.triangles.rows(); ++t) {
    const std::string where = "triangle " + std::to_string(t);
    const Eigen::Vector3i v = rest.triangles.row(t);
    if (v.minCoeff() < 0 || v.maxCoeff() >= rest.vertices.rows())
      throw data::input_error("mesh", where, "vertex index out of range");
    std::array<int, 3> sorted = {v[0], v[1], v[2]};
    std::sort(sorted.begin(), sorted.end());
    if (const auto [other, fresh] = seen.try_emplace(sorted, t); !fresh)
      throw data::input_error("mesh", where, "the same triangle as " + std::to_string(other->second));
    const Eigen::Vector3d edge1 = rest.vertices.row(v[1]) - rest.vertices.row(v[0]);
    const Eigen::Vector3d edge2 = rest.vertices.row(v[2]) - rest.vertices.row(v[0]);
    const Eigen::Vector3d normal = edge1.cross(edge2);
    const double area = 0.5 * normal.norm();
    if (!(area > 1e-14 * extent * extent))
      throw data::input_error("mesh", where, "degenerate, its area is zero");
    const Eigen::Vector3d axis1 = edge1.normalized(), axis2 = normal.normalized().cross(axis1);
    Eigen::Matrix2d edges;
    edges << edge1.dot(axis1), edge2.dot(axis1), edge1.dot(axis2), edge2.dot(axis2);
    sheet.triangles.push_back({v, edges.inverse(), area});
    for (int corner : {v[0], v[1], v[2]}) sheet.vertex_area[corner] += area / 3;
  }
  for (int i = 0; i < rest.vertices.rows(); ++i)
    if (sheet.vertex_area[i] == 0)
      throw data::input_error("mesh", "vertex " + std::to_string(i), "belongs to no triangle");
  return sheet;
}

}  // namespace flash::sim
