#include "sysid/replay/mark.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

#include "sysid/replay/sheet_distance.h"
#include "tests/sysid/moving_sheet.h"

namespace flash::sysid {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

Vector3d position_on(const Mark& mark, const data::Points& positions, const data::Triangles& triangles) {
  return mark_position(mark, corners_of(positions, triangles, mark.triangle));
}

/// The nearest point of all triangles, one after another.
SurfacePoint nearest_of_all(const Vector3d& place, const data::TriangleMesh& mesh) {
  SurfacePoint best;
  best.distance = INFINITY;
  for (int t = 0; t < mesh.triangles.rows(); ++t) {
    const Matrix3d corners = corners_of(mesh.vertices, mesh.triangles, t);
    SurfacePoint here = nearest_on_triangle(place, corners.col(0), corners.col(1), corners.col(2));
    here.triangle = t;
    if (here.distance < best.distance) best = here;
  }
  return best;
}

TEST(Mark, StandsWhereItWasPutAndMovesRigidlyWithItsTriangle) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> even(-1, 1);
  const data::TriangleMesh mesh = flat_sheet(5);
  const SheetDistance sheet(mesh.triangles, mesh.vertices);
  for (int i = 0; i < 50; ++i) {
    const Vector3d place(0.2 + 0.21 * even(random), 0.15 + 0.16 * even(random), 0.01 * even(random));
    const Mark mark = put_mark(place, mesh, sheet.nearest(place));
    EXPECT_LT((position_on(mark, mesh.vertices, mesh.triangles) - place).norm(), 1e-15);
    const Eigen::Isometry3d motion = Eigen::Translation3d(even(random), even(random), even(random)) *
                                     Eigen::AngleAxisd(3 * even(random), Vector3d(1, 2, -1).normalized());
    const data::Points moved =
        (mesh.vertices * motion.linear().transpose()).rowwise() + motion.translation().transpose();
    EXPECT_LT((position_on(mark, moved, mesh.triangles) - motion * place).norm(), 1e-14);
  }
}

// Stretched, the stalk keeps its length: it is none of the surface.
TEST(Mark, StalkKeepsItsLength) {
  const data::TriangleMesh mesh = flat_sheet(5);
  const Vector3d place(0.11, 0.07, 0.006);
  const Mark mark = put_mark(place, mesh, nearest_of_all(place, mesh));
  const data::Points stretched = 1.3 * mesh.vertices;
  EXPECT_LT((position_on(mark, stretched, mesh.triangles) - Vector3d(1.3 * 0.11, 1.3 * 0.07, 0.006)).norm(),
            1e-15);
}

TEST(Mark, IsFoundAsByTryingEveryTriangle) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> even(-1, 1);
  const data::TriangleMesh mesh = flat_sheet(6);
  const data::TriangleMesh bent{moving_sheet(mesh.vertices, 0.7), mesh.triangles};
  SheetDistance sheet(mesh.triangles, mesh.vertices);
  sheet.move(bent.vertices);
  for (int i = 0; i < 100; ++i) {
    const Vector3d place = bent.vertices.row(static_cast<Eigen::Index>(random() % 49)).transpose() +
                           0.02 * Vector3d(even(random), even(random), even(random));
    const SurfacePoint tried = nearest_of_all(place, bent);
    const Mark mark = put_mark(place, bent, sheet.nearest(place));
    EXPECT_NEAR(mark.offset.norm(), tried.distance, 1e-14);
    // The residual of a mark on another shape of the sheet: by its triangle's edges, written out.
    const data::Points there = moving_sheet(mesh.vertices, 0.9);
    const Matrix3d c = corners_of(there, mesh.triangles, mark.triangle);
    const Vector3d e = (c.col(1) - c.col(0)).normalized(),
                   n = (c.col(1) - c.col(0)).cross(c.col(2) - c.col(0)).normalized();
    Vector3d expected = mark.offset[0] * e + mark.offset[1] * n.cross(e) + mark.offset[2] * n;
    for (int k = 0; k < 3; ++k) expected += mark.barycentric[k] * c.col(k);
    SheetDistance moved = sheet;
    moved.move(there);
    const Vector3d seen = place + Vector3d(0.01, -0.02, 0.03);
    const SurfacePoint at = moved.mark(mark, seen);
    EXPECT_LT((at.position - expected).norm(), 1e-15);
    EXPECT_NEAR(at.distance, (seen - expected).norm(), 1e-15);
  }
}

TEST(Mark, ShiftIsTheDerivativeOfItsPosition) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> even(-1, 1);
  for (int i = 0; i < 50; ++i) {
    Matrix3d corners, moved;
    for (int k = 0; k < 9; ++k) corners(k) = even(random), moved(k) = even(random);
    const Mark mark{0, {0.2, 0.5, 0.3}, {even(random), even(random), even(random)}};
    constexpr double kStep = 1e-6;  // truncation of its square, rounding of 1e-16 over it: about 1e-10
    const Vector3d slope =
        (mark_position(mark, corners + kStep * moved) - mark_position(mark, corners - kStep * moved)) /
        (2 * kStep);
    // Slivers turn fast: relative to what the frame's turn may be.
    const double area = (corners.col(1) - corners.col(0)).cross(corners.col(2) - corners.col(0)).norm();
    EXPECT_LT((mark_shift(mark, corners, moved) - slope).norm(), 1e-8 / std::pow(std::min(area, 1.0), 3))
        << i;
  }
}

}  // namespace
}  // namespace flash::sysid
