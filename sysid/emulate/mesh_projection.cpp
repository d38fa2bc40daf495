#include "sysid/emulate/mesh_projection.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "data/meshing/remesh.h"
#include "sysid/replay/surface_distance.h"

namespace flash::sysid {
namespace {

/// Barycentric places of the middles of the edges of `parts`^2 equal triangles within one: of equal weight,
/// exact for what is of second order on each.
std::vector<Eigen::Vector3d> places_within(int parts) {
  std::vector<Eigen::Vector3d> places;
  const double step = 1.0 / parts;
  const auto add_middles = [&](const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
    places.insert(places.end(), {(a + b) / 2, (b + c) / 2, (c + a) / 2});
  };
  const auto at = [&](int i, int j) { return Eigen::Vector3d(1 - (i + j) * step, i * step, j * step); };
  for (int i = 0; i < parts; ++i)
    for (int j = 0; i + j < parts; ++j) {
      add_middles(at(i, j), at(i + 1, j), at(i, j + 1));
      if (i + j + 1 < parts) add_middles(at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
    }
  return places;
}

}  // namespace

MeshProjection projection(const data::TriangleMesh& from, const data::TriangleMesh& to) {
  // Of an edge, over which a surface is averaged. Work: points of a quadrature; meshes differ by a factor of
  // 4 at most.
  constexpr double kMostParts = 4;
  const double ratio = data::edge_lengths(to).mean / data::edge_lengths(from).mean;
  const std::vector<Eigen::Vector3d> places =
      places_within(static_cast<int>(std::clamp(std::round(ratio), 1.0, kMostParts)));
  const SurfaceDistance sheet(from.triangles, from.vertices);
  std::vector<Eigen::Triplet<double>> load, mass;
  int hint = -1;
  for (const auto triangle : to.triangles.rowwise()) {
    const Eigen::Vector3d a = to.vertices.row(triangle[0]), b = to.vertices.row(triangle[1]),
                          c = to.vertices.row(triangle[2]);
    const double weight = 0.5 * (b - a).cross(c - a).norm() / static_cast<double>(places.size());
    for (const Eigen::Vector3d& phi : places) {
      const SurfacePoint there = sheet.nearest(phi[0] * a + phi[1] * b + phi[2] * c, hint);
      hint = there.triangle;
      for (int i = 0; i < 3; ++i) {
        if (phi[i] == 0) continue;
        for (int k = 0; k < 3; ++k) {
          if (phi[k] != 0) mass.emplace_back(triangle[i], triangle[k], weight * phi[i] * phi[k]);
          if (there.barycentric[k] != 0)
            load.emplace_back(triangle[i], from.triangles(there.triangle, k),
                              weight * phi[i] * there.barycentric[k]);
        }
      }
    }
  }
  MeshProjection result;
  result.load.resize(to.vertices.rows(), from.vertices.rows());
  result.load.setFromTriplets(load.begin(), load.end());
  Eigen::SparseMatrix<double> matrix(to.vertices.rows(), to.vertices.rows());
  matrix.setFromTriplets(mass.begin(), mass.end());
  result.mass = std::make_shared<const Eigen::SimplicialLLT<Eigen::SparseMatrix<double>>>(matrix);
  return result;
}

data::Points projected(const MeshProjection& projection, const data::Points& positions) {
  return projection.mass->solve(Eigen::MatrixXd(projection.load * positions));
}

}  // namespace flash::sysid
