#include "data/mesh/enclosed_volume.h"

#include <Eigen/Geometry>

namespace flash::data {

double enclosed_volume(const TriangleMesh& mesh) {
  const Eigen::RowVector3d middle = mesh.vertices.colwise().mean();
  double volume = 0;
  for (const auto& t : mesh.triangles.rowwise()) {
    const Eigen::Vector3d a = mesh.vertices.row(t[0]) - middle, b = mesh.vertices.row(t[1]) - middle,
                          c = mesh.vertices.row(t[2]) - middle;
    volume += a.cross(b).dot(c) / 6;
  }
  return volume;
}

}  // namespace flash::data
