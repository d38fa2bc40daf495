#include "data/mesh/mesh_io.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <vector>

#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/text.h"
#include "data/mesh/gmsh.h"
#include "data/mesh/obj.h"
#include "data/mesh/pcd.h"
#include "data/mesh/ply.h"
#include "data/mesh/stl.h"
#include "data/mesh/tet_faces.h"
#include "data/mesh/tet_fit.h"
#include "data/mesh/vtk.h"
#include "data/mesh/weld.h"

namespace flash::data {
namespace {

void check_points(const Points& points, const std::string& source) {
  Eigen::Index count = 0, first = -1;
  for (Eigen::Index i = 0; i < points.rows(); ++i)
    if (!points.row(i).allFinite()) {
      if (count++ == 0) first = i;
    }
  if (count > 0)
    throw InputError(source + ": " + format_count(static_cast<std::size_t>(count)) + " of " +
                     format_count(static_cast<std::size_t>(points.rows())) +
                     " points are not finite; first at index " + std::to_string(first));
}

/// Far below where areas and volumes overflow, far above what is simulated.
constexpr double largest_coordinate = 1e12;

void check_size(const Points& points, const std::string& source) {
  for (Eigen::Index i = 0; i < points.rows(); ++i)
    if (const double largest = points.row(i).cwiseAbs().maxCoeff(); largest > largest_coordinate)
      throw input_error(source, "vertex " + std::to_string(i),
                        "found a coordinate of " + format_short(largest) + ", expected at most " +
                            format_short(largest_coordinate));
}

template <class Rows>
void check_indices(const Rows& rows, Eigen::Index vertices, const char* what, const std::string& source) {
  if (vertices == 0 && rows.rows() > 0)
    throw InputError(source + ": found no vertices, expected those that its elements name");
  for (Eigen::Index i = 0; i < rows.rows(); ++i)
    for (Eigen::Index k = 0; k < rows.cols(); ++k)
      if (rows(i, k) < 0 || rows(i, k) >= vertices)
        throw input_error(source, std::string(what) + ' ' + std::to_string(i),
                          "found vertex index " + std::to_string(rows(i, k)) + ", expected 0 to " +
                              std::to_string(vertices - 1));
}

double signed_volume(const Points& x, const Eigen::Vector4i& t) {
  const Eigen::Vector3d a = x.row(t[1]) - x.row(t[0]), b = x.row(t[2]) - x.row(t[0]),
                        c = x.row(t[3]) - x.row(t[0]);
  return a.cross(b).dot(c) / 6;
}

double longest_edge(const Points& x, const Eigen::Vector4i& t) {
  double longest = 0;
  for (int k = 1; k < 4; ++k)
    for (int l = 0; l < k; ++l) longest = std::max(longest, (x.row(t[k]) - x.row(t[l])).norm());
  return longest;
}

std::string list_of(const Eigen::VectorXi& vertices) {
  std::string text;
  for (const int vertex : vertices) text += (text.empty() ? "" : ", ") + std::to_string(vertex);
  return text;
}

Geometry parse(const std::string& path) {
  const std::string extension = lower_extension(path);
  if (extension == ".ply") return parse_ply(read_file(path), path);
  if (extension == ".obj") return parse_obj(read_file(path), path);
  if (extension == ".vtk") return parse_vtk(read_file(path), path);
  if (extension == ".stl") return parse_stl(read_file(path), path);
  if (extension == ".tet") return parse_tet(read_file(path), path);
  if (extension == ".msh") return parse_msh(read_file(path), path);
  if (extension == ".pcd") return {parse_pcd(read_file(path), path), {}, {}};
  const bool is_like_a_specification = path.find(':') != std::string::npos;
  throw InputError(
      path + ": ending \"" + extension +
      "\" is not known, expected .ply, .obj, .vtk, .stl, .pcd, .tet or .msh" +
      (is_like_a_specification ? ", or a mesh made on the spot, such as sheet:0.4x0.4:0.02" : ""));
}

void check_geometry(const Geometry& geometry, const std::string& path) {
  check_points(geometry.points, path);
  check_indices(geometry.triangles, geometry.points.rows(), "triangle", path);
  check_indices(geometry.tetrahedra, geometry.points.rows(), "tetrahedron", path);
}

Points finite_points(const Points& points, std::size_t& left_out) {
  std::vector<Eigen::Index> finite;
  for (Eigen::Index i = 0; i < points.rows(); ++i)
    if (points.row(i).allFinite()) finite.push_back(i);
  left_out += static_cast<std::size_t>(points.rows()) - finite.size();
  return points(finite, Eigen::all);
}

}  // namespace

Geometry load_geometry(const std::string& path) {
  Geometry geometry = parse(path);
  check_geometry(geometry, path);
  return geometry;
}

void check_triangle_mesh(const TriangleMesh& mesh, const std::string& source) {
  check_points(mesh.vertices, source);
  check_indices(mesh.triangles, mesh.vertices.rows(), "triangle", source);
  if (mesh.triangles.rows() == 0) throw InputError(source + ": found no triangles");
  check_size(mesh.vertices, source);
  std::map<std::array<int, 3>, Eigen::Index> seen;
  std::map<std::array<int, 2>, Eigen::Index> sides;  // by the direction in which their triangle runs
  std::vector<bool> used(static_cast<std::size_t>(mesh.vertices.rows()), false);
  for (Eigen::Index i = 0; i < mesh.triangles.rows(); ++i) {
    const Eigen::Vector3i t = mesh.triangles.row(i);
    const Eigen::Vector3d a = mesh.vertices.row(t[1]) - mesh.vertices.row(t[0]);
    const Eigen::Vector3d b = mesh.vertices.row(t[2]) - mesh.vertices.row(t[0]);
    // Twice the area against the longest edge squared: below this the rest shape cannot be inverted in
    // double.
    const double longest = std::max({a.squaredNorm(), b.squaredNorm(), (a - b).squaredNorm()});
    if (a.cross(b).norm() <= 1e-10 * longest || longest == 0)
      throw input_error(source, "triangle " + std::to_string(i),
                        "is degenerate: vertices " + std::to_string(t[0]) + ", " + std::to_string(t[1]) +
                            ", " + std::to_string(t[2]) + " lie on a line");
    std::array<int, 3> key = {t[0], t[1], t[2]};
    std::sort(key.begin(), key.end());
    const auto [earlier, is_new] = seen.emplace(key, i);
    if (!is_new)
      throw input_error(source, "triangle " + std::to_string(i),
                        "repeats triangle " + std::to_string(earlier->second));
    for (int k = 0; k < 3; ++k) {
      const std::array<int, 2> side = {t[k], t[(k + 1) % 3]};
      const auto [other, is_free] = sides.emplace(side, i);
      if (!is_free)
        throw input_error(source, "triangle " + std::to_string(i),
                          "runs from vertex " + std::to_string(side[0]) + " to " + std::to_string(side[1]) +
                              " as triangle " + std::to_string(other->second) +
                              " does: one of them is flipped, or more than two share the edge");
      used[static_cast<std::size_t>(t[k])] = true;
    }
  }
  const auto lone = std::find(used.begin(), used.end(), false);
  if (lone != used.end())
    throw input_error(source, "vertex " + std::to_string(lone - used.begin()), "belongs to no triangle");
}

TriangleMesh load_triangle_mesh(const std::string& path, bool weld) {
  Geometry geometry = load_geometry(path);
  TriangleMesh mesh{std::move(geometry.points), std::move(geometry.triangles)};
  if (weld) mesh = welded(mesh);
  check_triangle_mesh(mesh, path);
  return mesh;
}

void check_tet_mesh(const TetMesh& mesh, const std::string& source) {
  check_points(mesh.vertices, source);
  check_indices(mesh.tetrahedra, mesh.vertices.rows(), "tetrahedron", source);
  if (mesh.tetrahedra.rows() == 0) throw InputError(source + ": found no tetrahedra");
  check_size(mesh.vertices, source);
  std::vector<bool> used(static_cast<std::size_t>(mesh.vertices.rows()), false);
  for (Eigen::Index i = 0; i < mesh.tetrahedra.rows(); ++i) {
    const Eigen::Vector4i t = mesh.tetrahedra.row(i);
    const double volume = signed_volume(mesh.vertices, t), longest = longest_edge(mesh.vertices, t);
    // Six times the volume against the longest edge: below this the rest shape cannot be inverted in double.
    if (6 * std::abs(volume) <= 1e-10 * longest * longest * longest)
      throw input_error(source, "tetrahedron " + std::to_string(i),
                        "is flat: vertices " + list_of(t) + " lie in a plane");
    if (volume < 0)
      throw input_error(source, "tetrahedron " + std::to_string(i),
                        "is inverted: the volume of vertices " + list_of(t) + " is negative");
    for (const int vertex : t) used[static_cast<std::size_t>(vertex)] = true;
  }
  if (const Overlap overlap = first_overlap(mesh.tetrahedra); overlap.second >= 0)
    throw input_error(source, "tetrahedron " + std::to_string(overlap.second),
                      "lies on the same side of the face of vertices " + list_of(overlap.face) +
                          " as tetrahedron " + std::to_string(overlap.first) +
                          ": one of them is inverted, or they are the same");
  const auto lone = std::find(used.begin(), used.end(), false);
  if (lone != used.end())
    throw input_error(source, "vertex " + std::to_string(lone - used.begin()), "belongs to no tetrahedron");
  check_fit(mesh, source);
}

TetMesh load_tet_mesh(const std::string& path, bool weld) {
  Geometry geometry = load_geometry(path);
  if (geometry.tetrahedra.rows() == 0) throw InputError(path + ": found no tetrahedra");
  for (Eigen::Index i = 0; i < geometry.tetrahedra.rows(); ++i)
    if (signed_volume(geometry.points, geometry.tetrahedra.row(i)) < 0)
      std::swap(geometry.tetrahedra(i, 2), geometry.tetrahedra(i, 3));
  TetMesh mesh{std::move(geometry.points), std::move(geometry.tetrahedra)};
  if (weld) mesh = welded(mesh);
  check_tet_mesh(mesh, path);
  return mesh;
}

Points load_point_cloud(const std::string& path, std::size_t& left_out) {
  return finite_points(parse(path).points, left_out);
}

Points load_point_cloud(const std::string& path) {
  std::size_t left_out = 0;
  return load_point_cloud(path, left_out);
}

Geometry load_scan(const std::string& path, std::size_t& left_out) {
  Geometry geometry = parse(path);
  if (geometry.triangles.rows() > 0)
    check_geometry(geometry, path);
  else
    geometry.points = finite_points(geometry.points, left_out);
  return geometry;
}

std::string format_triangle_mesh(const TriangleMesh& mesh, const std::string& path) {
  const std::string extension = lower_extension(path);
  if (extension == ".ply") return format_ply(mesh.vertices, mesh.triangles, PlyNumbers::float64);
  if (extension == ".obj") return format_obj(mesh);
  if (extension == ".vtk") return format_vtk(mesh);
  throw InputError(path + ": ending \"" + extension +
                   "\" is not known for meshes, expected .ply, .obj or .vtk");
}

std::string format_tet_mesh(const TetMesh& mesh, const std::string& path) {
  const std::string extension = lower_extension(path);
  if (extension == ".vtk") return format_vtk(mesh);
  if (extension == ".tet") return format_tet(mesh);
  throw InputError(path + ": ending \"" + extension +
                   "\" is not known for tetrahedra, expected .vtk or .tet");
}

void save_triangle_mesh(const TriangleMesh& mesh, const std::string& path) {
  write_atomically(path, format_triangle_mesh(mesh, path));
}

void save_tet_mesh(const TetMesh& mesh, const std::string& path) {
  write_atomically(path, format_tet_mesh(mesh, path));
}

void save_point_cloud(const Points& points, const std::string& path) {
  const std::string extension = lower_extension(path);
  if (extension == ".ply") return write_atomically(path, format_ply(points, {}, PlyNumbers::float32));
  if (extension == ".pcd") return write_atomically(path, format_pcd(points));
  throw InputError(path + ": ending \"" + extension + "\" is not known for clouds, expected .ply or .pcd");
}

}  // namespace flash::data
