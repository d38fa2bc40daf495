#include "sysid/emulate/mesh_projection.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "data/mesh/procedural_mesh.h"
#include "data/meshing/remesh.h"
#include "sysid/emulate/two_mesh_motions.h"

namespace flash::sysid {
namespace {

constexpr double kRadius = 0.03;  // [m]

/// A flat sheet rolled up along its first axis.
data::Points rolled(const data::TriangleMesh& mesh) {
  data::Points positions = mesh.vertices;
  for (auto position : positions.rowwise()) {
    const double angle = position[0] / kRadius;
    position[0] = kRadius * std::sin(angle);
    position[2] = kRadius * (1 - std::cos(angle));
  }
  return positions;
}

/// Mean and mean square of how far points between the vertices lie outside the cylinder [m], [m^2].
struct Outside {
  double mean = 0, square = 0;
};

Outside outside(const data::TriangleMesh& mesh, const data::Points& positions) {
  Outside sum;
  double area = 0;
  const int parts = 6;
  for (const auto t : mesh.triangles.rowwise()) {
    const Eigen::Vector3d a = mesh.vertices.row(t[0]), b = mesh.vertices.row(t[1]),
                          c = mesh.vertices.row(t[2]);
    const double part = (b - a).cross(c - a).norm();
    for (int i = 0; i < parts; ++i)
      for (int j = 0; i + j < parts; ++j) {
        const double u = (i + 1.0 / 3) / parts, v = (j + 1.0 / 3) / parts;
        const Eigen::RowVector3d x =
            (1 - u - v) * positions.row(t[0]) + u * positions.row(t[1]) + v * positions.row(t[2]);
        const double miss = std::hypot(x[0], x[2] - kRadius) - kRadius;
        sum.mean += part * miss;
        sum.square += part * miss * miss;
        area += part;
      }
  }
  return {sum.mean / area, sum.square / area};
}

data::TriangleMesh sheet(double cell) {
  return data::remeshed(data::parse_mesh_spec("sheet:0.1x0.1:0.01"), cell);
}

TEST(MeshProjection, ChordsLieToBothSidesOfAnArc) {
  const data::TriangleMesh coarse = sheet(0.02), fine = sheet(0.004);
  const data::Points by_vertices = prolongation(fine, coarse) * rolled(fine),
                     by_surface = projected(projection(fine, coarse), rolled(fine));
  const Outside vertices = outside(coarse, by_vertices), surface = outside(coarse, by_surface),
                finest = outside(fine, rolled(fine));
  // Chords of h lie h^2 / 12 r inside on average, were they all across the axis.
  EXPECT_LT(vertices.mean, -0.3 * 0.02 * 0.02 / (12 * kRadius));
  EXPECT_NEAR(surface.mean, finest.mean, 0.1 * std::abs(vertices.mean));
  EXPECT_LT(surface.square, 0.5 * vertices.square);
}

TEST(MeshProjection, LeavesWhatTheOtherMeshCanShow) {
  const data::TriangleMesh coarse = sheet(0.02), fine = sheet(0.007);
  data::Points inclined = coarse.vertices, there = fine.vertices;
  inclined.col(2) = 0.3 * inclined.col(0) - 0.2 * inclined.col(1);
  there.col(2) = 0.3 * there.col(0) - 0.2 * there.col(1);
  EXPECT_LT((projected(projection(fine, coarse), there) - inclined).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_LT((projected(projection(coarse, fine), inclined) - there).cwiseAbs().maxCoeff(), 1e-12);
  const data::Points bent = rolled(coarse);
  EXPECT_LT((projected(projection(coarse, coarse), bent) - bent).cwiseAbs().maxCoeff(), 1e-12);
}

}  // namespace
}  // namespace flash::sysid
