#include "data/asset/asset_mesh.h"

#include <Eigen/Geometry>
#include <numbers>

#include "data/files/error.h"
#include "data/files/text.h"
#include "data/mesh/mesh_io.h"
#include "data/mesh/procedural_mesh.h"

namespace flash::data {
namespace {

void check_size(const Asset& asset, const Points& vertices) {
  constexpr double kLargestSize = 20.0;  // as of recordings: above it, lengths are taken for millimetres [m]
  const double size = (vertices.colwise().maxCoeff() - vertices.colwise().minCoeff()).norm();
  if (size > kLargestSize)
    throw input_error(
        asset.source, "mesh",
        "is " + format_short(size) + " m across, expected metres (millimetres read as metres?)");
}

void transform(const Asset& asset, Points& vertices) {
  vertices *= rotation_from_degrees(asset.rotation_degrees).transpose();
  vertices.rowwise() += asset.translation.transpose();
}

}  // namespace

Eigen::Matrix3d rotation_from_degrees(const Eigen::Vector3d& degrees) {
  const Eigen::Vector3d r = degrees * std::numbers::pi / 180;
  return (Eigen::AngleAxisd(r.z(), Eigen::Vector3d::UnitZ()) *
          Eigen::AngleAxisd(r.y(), Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(r.x(), Eigen::Vector3d::UnitX()))
      .toRotationMatrix();
}

TriangleMesh load_rest_mesh(const Asset& asset) {
  if (asset.element_type != ElementType::triangle)
    throw input_error(asset.source, "element_type", "found TETRAHEDRON, expected TRIANGLE: a sheet");
  if (is_tet_mesh_spec(asset.mesh))
    throw input_error(
        asset.source, "mesh",
        "found \"" + asset.mesh + "\", expected sheet:..., disc:..., tshirt:..., shorts:... or a file");
  TriangleMesh mesh = is_mesh_spec(asset.mesh) ? parse_mesh_spec(asset.mesh, asset.source, "mesh")
                                               : load_triangle_mesh(asset.mesh);
  check_size(asset, mesh.vertices);
  return mesh;
}

TriangleMesh load_asset_mesh(const Asset& asset) {
  TriangleMesh mesh = load_rest_mesh(asset);
  transform(asset, mesh.vertices);
  return mesh;
}

TetMesh load_asset_tet_mesh(const Asset& asset) {
  if (is_mesh_spec(asset.mesh))
    throw input_error(
        asset.source, "mesh",
        "found \"" + asset.mesh + "\", expected box:... or a .vtk, .tet or .msh file of tetrahedra");
  TetMesh mesh = is_tet_mesh_spec(asset.mesh) ? parse_tet_mesh_spec(asset.mesh, asset.source, "mesh")
                                              : load_tet_mesh(asset.mesh);
  check_size(asset, mesh.vertices);
  transform(asset, mesh.vertices);
  return mesh;
}

}  // namespace flash::data
