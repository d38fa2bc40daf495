#pragma once
#include <Eigen/Geometry>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "data/mesh/obstacle_mesh.h"
#include "data/mesh/procedural_mesh.h"
#include "sim/law/surface_mesh.h"
#include "sim/scene/environment.h"

// Surfaces of triangles that tests meet.
namespace flash::sim {

inline data::TriangleMesh mesh_from(const std::vector<Eigen::Vector3d>& vertices,
                                    const std::vector<Eigen::Vector3i>& triangles) {
  data::TriangleMesh mesh;
  mesh.vertices.resize(static_cast<Eigen::Index>(vertices.size()), 3);
  mesh.triangles.resize(static_cast<Eigen::Index>(triangles.size()), 3);
  for (std::size_t i = 0; i < vertices.size(); ++i)
    mesh.vertices.row(static_cast<Eigen::Index>(i)) = vertices[i].transpose();
  for (std::size_t i = 0; i < triangles.size(); ++i)
    mesh.triangles.row(static_cast<Eigen::Index>(i)) = triangles[i].transpose();
  return mesh;
}

/// The surface of a box about the origin, each face in `cells` x `cells`.
inline data::TriangleMesh box_surface(const Eigen::Vector3d& half_extents, int cells = 1) {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<Eigen::Vector3i> triangles;
  for (int axis = 0; axis < 3; ++axis)
    for (const int side : {-1, 1}) {
      const int first = static_cast<int>(vertices.size());
      for (int j = 0; j <= cells; ++j)
        for (int i = 0; i <= cells; ++i) {
          Eigen::Vector3d place;
          place[axis] = side;
          place[(axis + 1) % 3] = 2.0 * i / cells - 1;
          place[(axis + 2) % 3] = 2.0 * j / cells - 1;
          vertices.emplace_back(place.cwiseProduct(half_extents));
        }
      for (int j = 0; j < cells; ++j)
        for (int i = 0; i < cells; ++i) {
          const int a = first + j * (cells + 1) + i, b = a + 1, c = a + cells + 1, d = c + 1;
          if (side > 0) {
            triangles.emplace_back(a, b, d);
            triangles.emplace_back(a, d, c);
          } else {
            triangles.emplace_back(a, d, b);
            triangles.emplace_back(a, c, d);
          }
        }
    }
  return mesh_from(vertices, triangles);
}

/// A prism along y over an outline in x and z, which runs counter-clockwise seen from -y. Every corner of the
/// outline can be seen from the corner `hub`.
inline data::TriangleMesh prism_surface(const std::vector<Eigen::Vector2d>& outline, int hub,
                                        double half_width) {
  const int n = static_cast<int>(outline.size());
  std::vector<Eigen::Vector3d> vertices;
  std::vector<Eigen::Vector3i> triangles;
  for (const double y : {-half_width, half_width})
    for (const Eigen::Vector2d& corner : outline) vertices.emplace_back(corner.x(), y, corner.y());
  for (int k = 0; k < n; ++k) {
    const int next = (k + 1) % n;
    triangles.emplace_back(k, next, n + next);
    triangles.emplace_back(k, n + next, n + k);
    if (k == hub || next == hub) continue;
    triangles.emplace_back(hub, next, k);
    triangles.emplace_back(n + hub, n + k, n + next);
  }
  // Seen from -y the outline runs counter-clockwise where x points right and z up.
  for (Eigen::Vector3i& t : triangles) std::swap(t[1], t[2]);
  return mesh_from(vertices, triangles);
}

/// A cylinder along y with flat ends, its corners on the radius.
inline data::TriangleMesh rod_surface(double radius, double half_width, int sides, double turn = 0) {
  std::vector<Eigen::Vector2d> outline;
  for (int k = 0; k < sides; ++k) {
    const double angle = turn + 2 * M_PI * k / sides;
    outline.emplace_back(radius * std::cos(angle), radius * std::sin(angle));
  }
  return prism_surface(outline, 0, half_width);
}

/// An icosahedron whose triangles are cut in four `times` times, its corners on the radius.
inline data::TriangleMesh ball_surface(double radius, int times) {
  const double g = (1 + std::sqrt(5.0)) / 2;
  std::vector<Eigen::Vector3d> vertices = {{-1, g, 0}, {1, g, 0}, {-1, -g, 0}, {1, -g, 0},
                                           {0, -1, g}, {0, 1, g}, {0, -1, -g}, {0, 1, -g},
                                           {g, 0, -1}, {g, 0, 1}, {-g, 0, -1}, {-g, 0, 1}};
  std::vector<Eigen::Vector3i> triangles = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                                            {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                                            {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                                            {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
  for (int n = 0; n < times; ++n) {
    std::map<std::pair<int, int>, int> middles;
    const auto middle = [&](int a, int b) {
      const auto [found, is_new] = middles.emplace(std::minmax(a, b), static_cast<int>(vertices.size()));
      if (is_new) vertices.emplace_back(vertices[a].normalized() + vertices[b].normalized());
      return found->second;
    };
    std::vector<Eigen::Vector3i> finer;
    for (const Eigen::Vector3i& t : triangles) {
      const int a = middle(t[0], t[1]), b = middle(t[1], t[2]), c = middle(t[2], t[0]);
      finer.insert(finer.end(), {{t[0], a, c}, {t[1], b, a}, {t[2], c, b}, {a, b, c}});
    }
    triangles = finer;
  }
  for (Eigen::Vector3d& vertex : vertices) vertex = radius * vertex.normalized();
  return mesh_from(vertices, triangles);
}

/// Both meshes as one.
inline data::TriangleMesh joined_surfaces(const data::TriangleMesh& a, const data::TriangleMesh& b) {
  data::TriangleMesh both;
  both.vertices.resize(a.vertices.rows() + b.vertices.rows(), 3);
  both.vertices << a.vertices, b.vertices;
  both.triangles.resize(a.triangles.rows() + b.triangles.rows(), 3);
  both.triangles << a.triangles, b.triangles.array() + static_cast<int>(a.vertices.rows());
  return both;
}

inline data::TriangleMesh moved_surface(data::TriangleMesh mesh, const Eigen::Isometry3d& pose) {
  mesh.vertices = (mesh.vertices * pose.linear().transpose()).rowwise() + pose.translation().transpose();
  return mesh;
}

inline Mesh mesh_shape(const data::TriangleMesh& mesh, double margin = 0,
                       const Eigen::Isometry3d& pose = Eigen::Isometry3d::Identity()) {
  return {std::make_shared<const SurfaceMesh>(
              make_surface_mesh(data::checked_obstacle_mesh(mesh, "a surface of a test"))),
          pose, margin};
}

}  // namespace flash::sim
