#include "tests/fuzz/good_files.h"

#include <filesystem>

#include "data/asset/asset.h"
#include "data/camera/camera.h"
#include "data/camera/depth_image.h"
#include "data/files/atomic_file.h"
#include "data/mesh/mesh_io.h"
#include "data/mesh/procedural_mesh.h"
#include "data/motion/trajectory.h"
#include "data/recording/recording.h"

namespace flash::fuzz {
namespace {

data::Trajectory lift() {
  data::Trajectory trajectory;
  for (int k = 0; k < 5; ++k) {
    trajectory.times.push_back(0.25 * k);
    trajectory.poses.emplace_back(Eigen::Translation3d(0.1, 0.1, 0.02 * k));
  }
  return trajectory;
}

void write_meshes(const std::string& folder) {
  const data::TriangleMesh sheet = data::rectangle({0.1, 0.1, 2, 2, data::DiagonalPattern::alternating});
  for (const char* file : {"ply/sheet.ply", "obj/sheet.obj", "vtk/sheet.vtk"})
    data::save_triangle_mesh(sheet, folder + '/' + file);
  const data::TetMesh box = data::tet_box({0.1, 0.1, 0.1}, {1, 1, 1});
  for (const char* file : {"vtk/box.vtk", "tet/box.tet"}) data::save_tet_mesh(box, folder + '/' + file);
  data::write_atomically(folder + "/msh/box.msh",
                         "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 4 1 4\n3 1 0 4\n1\n2\n3\n4\n0 0 0\n"
                         "1 0 0\n0 1 0\n0 0 1\n$EndNodes\n$Elements\n1 1 1 1\n3 1 4 1\n1 1 2 3 4\n"
                         "$EndElements\n");
  for (const char* file : {"pcd/cloud.pcd", "ply/cloud.ply", "recording/cloud.ply"})
    data::save_point_cloud(sheet.vertices, folder + '/' + file);
  data::write_atomically(folder + "/ply/ascii.ply",
                         "ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\n"
                         "property double z\nelement face 1\nproperty list uchar int vertex_indices\n"
                         "end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
  const std::string facet =
      "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";
  data::write_atomically(folder + "/stl/ascii.stl", "solid a\n" + facet + "endsolid a\n");
  data::write_atomically(folder + "/stl/binary.stl",
                         std::string(80, ' ') + std::string("\1\0\0\0", 4) + std::string(50, '\0'));
  data::write_atomically(folder + "/pcd/ascii.pcd",
                         "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 1\nHEIGHT 1\n"
                         "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 1\nDATA ascii\n0 0 0\n");
  data::write_atomically(
      folder + "/pcd/compressed.pcd",
      "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 8\nHEIGHT 1\n"
      "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 8\nDATA binary_compressed\n" +
          std::string(
              "\x26\x00\x00\x00\x60\x00\x00\x00\x04\x00\x00\x80\x3e\x00\xe0\x04\x03\x02\x00\x3f\x00\xe0"
              "\x04\x03\x00\x80\x20\x0f\xe0\x13\x03\x01\x00\x40\x20\x2f\xe0\x0a\x03\x01\xc0\x7f\x20\x17"
              "\x00\x40",
              46));
  data::write_atomically(
      folder + "/ply/big_endian.ply",
      "ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
      "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n" +
          std::string(12, '\0') + std::string("\x3f\x80\0\0\0\0\0\0\0\0\0\0", 12) +
          std::string("\0\0\0\0\x3f\x80\0\0\0\0\0\0", 12) + std::string("\3\0\0\0\0\0\0\0\1\0\0\0\2", 13));
}

void write_camera(const std::string& folder) {
  const data::CameraIntrinsics camera{4, 3, 500, 500, 2, 1.5, data::DistortionModel::none, {}};
  data::save_camera_info(camera, folder + "/camera/camera.yaml");
  data::write_atomically(
      folder + "/camera/opencv.yaml",
      "%YAML:1.0\n---\nimage_width: 4\nimage_height: 3\ncamera_matrix: !!opencv-matrix\n"
      "   rows: 3\n   cols: 3\n   dt: d\n   data: [ 500., 0., 2., 0., 500., 1.5, 0., 0., 1. ]\n"
      "distortion_coefficients: !!opencv-matrix\n   rows: 1\n   cols: 5\n   dt: d\n"
      "   data: [ 0.1, 0., 0., 0., 0. ]\n");
  data::save_camera_info(camera, folder + "/recording/camera.yaml");
  data::save_depth_image({4, 3, std::vector<std::uint16_t>(12, 500)}, folder + "/depth/depth.png");
  data::save_mask({4, 3, std::vector<std::uint8_t>(12, 255)}, folder + "/mask/mask.png");
}

void write_descriptions(const std::string& folder) {
  const data::SheetMaterial material;
  const data::Asset asset = data::asset_from_sheet(material, 0.001, "sheet:0.1x0.1:0.05");
  data::save_asset(asset, folder + "/asset/asset.json");
  data::save_asset(asset, folder + "/scene/asset.json");
  std::vector<std::string> notices;
  data::save_asset(data::express_as(asset, data::AssetFormat::published, 0.01, notices),
                   folder + "/asset/published.json");
  data::write_atomically(
      folder + "/scene/scene.json",
      R"({"schema": "flash-scene/1", "timestep": 0.01, "steps": 2, "gravity": [0, 0, -9.81],
 "linearsolver": {"type": "SPARSE_CHOLESKY"},
 "constraintsolver": {"type": "automatic", "maxforce": 1e10, "iterations": 10, "tolerance": 1e-9},
 "planecollisions": {"point": [0, 0, 0], "normal": [0, 0, 1], "friction": 0.3},
 "obstacles": {"peg": {"shape": "cylinder", "point": [0, 0, 0], "axis": [0, 1, 0], "radius": 0.01},
  "finger": {"shape": "capsule", "point": [0, 0, 0], "axis": [0, 1, 0], "half_length": 0.02, "radius": 0.01},
  "ball": {"shape": "sphere", "radius": 0.01, "keyframes": [{"t": 0, "translation": [0, 0, 0]}]}},
 "objects": {"cloth": {"asset": "asset.json", "start": {"T_base_object": [0, 0, 0.1, 0, 0, 0, 1]},
  "fixed": [{"vertices": [0], "axes": "xz"}], "loads": [{"vertices": [8], "force": [0, 0, 1]}],
  "prescribed": [{"vertices": [1], "keyframes": [{"t": 0, "translation": [0, 0, 0]}]}]}},
 "end_effectors": {"gripper": {"size": [0.02, 0.02, 0.02], "keyframes": [{"t": 0, "translation": [0, 0, 0]}],
  "grasps": [{"from": 0, "to": null, "threshold": 0.01}]}},
 "friction": [{"a": "cloth", "b": "peg", "friction": 0.2}], "keyframes": [0.01, 0.02]})");
  data::save_tum(lift(), folder + "/tum/gripper.tum");
  data::save_tum(lift(), folder + "/recording/gripper.tum");
  data::write_atomically(folder + "/trajectory_csv/gripper.csv",
                         "t,tx,ty,tz,qx,qy,qz,qw\n0,0,0,0,0,0,0,1\n1,0,0,0.1,0,0,0,1\n");
  data::write_atomically(
      folder + "/recording/recording.json",
      R"({"schema": "flash-recording/1", "name": "lift", "kind": "corner_lift", "gravity": [0, 0, -9.81],
 "object": {"mesh": "sheet:0.1x0.1:0.05", "asset": null, "start": {"T_base_object": [0, 0, 0, 0, 0, 0, 1]}},
 "table": {"point": [0, 0, 0], "normal": [0, 0, 1]}, "trajectories": {"gripper": "gripper.tum"},
 "grasps": [{"gripper": "gripper", "from": 0, "to": null, "select": {"corner": [1, 1], "within": 0.02},
  "shape": "pinch", "depth": 0.01, "direction": [1, 1, 0], "pitch": 0}],
 "camera": {"intrinsics": "camera.yaml", "T_base_camera": [0, 0, 1, 1, 0, 0, 0]},
 "crop": {"min": [null, null, -0.1], "max": [null, 1.0, null]},
 "keyframes": [{"t": 0.0, "cloud": "cloud.ply"}, {"t": 0.5, "cloud": "cloud.ply", "force": [0, 0, 1]}],
 "nuisance": {"offset_m": [0, 0, 0], "yaw_rad": 0, "time_s": 0, "table_height_m": 0, "start_yaw_rad": 0}})");
}

}  // namespace

void write_good_files(const std::string& folder) {
  write_meshes(folder);
  write_camera(folder);
  write_descriptions(folder);
}

}  // namespace flash::fuzz
