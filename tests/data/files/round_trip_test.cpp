// What is written is what is read, for any values.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>

#include "data/asset/asset.h"
#include "data/files/atomic_file.h"
#include "data/mesh/mesh_io.h"
#include "data/mesh/procedural_mesh.h"
#include "data/motion/trajectory.h"
#include "data/recording/recording.h"
#include "tests/data/temporary_folder.h"
#include "tests/drawn_numbers.h"

namespace flash::data {
namespace {

/// Lengths over six decades, with all their digits.
Points draw_points(Eigen::Index rows) { return draw_noise(rows, draw_log(1e-3, 1e3)); }

Eigen::Isometry3d draw_pose(double reach) {
  return Eigen::Translation3d(draw(0, reach) * draw_direction()) *
         Eigen::AngleAxisd(draw(0, 3), draw_direction());
}

Trajectory draw_trajectory(double start) {
  Trajectory trajectory;
  double time = start;
  for (int left = 1 + draw_below(20); left > 0; --left) {
    trajectory.times.push_back(time);
    trajectory.poses.push_back(draw_pose(2));
    time += draw_log(1e-3, 1);
  }
  return trajectory;
}

SheetMaterial draw_material() {
  SheetMaterial material;
  material.constitutive = *rc::gen::element(Constitutive::tri_corotated, Constitutive::tri_arap,
                                            Constitutive::tri_stvk, Constitutive::tri_neohookean);
  material.bending_model =
      *rc::gen::element(BendingModel::plate, BendingModel::isometric, BendingModel::hinge);
  material.membrane_stiffness = draw_log(1, 1e6);
  material.poissons_ratio = draw(-0.9, 0.5);
  material.areal_density = draw_log(0.01, 10);
  material.bending_rigidity = draw_log(1e-9, 1);
  material.friction = draw(0, 2);
  material.air_drag = draw(0, 5);
  material.stiffness_damping = draw(0, 0.1);
  return material;
}

// Quaternions pass through a matrix and are made unit again: a few roundings.
void expect_same(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  RC_ASSERT(a.translation() == b.translation());
  RC_ASSERT((a.linear() - b.linear()).cwiseAbs().maxCoeff() < 1e-14);
}

RC_GTEST_PROP(RoundTrips, TriangleMeshesAreExact, ()) {
  const TemporaryFolder folder;
  TriangleMesh mesh = rectangle({.cells_x = 1 + draw_below(6), .cells_y = 1 + draw_below(6)});
  mesh.vertices = draw_points(mesh.vertices.rows());
  const std::string path = folder / *rc::gen::element<std::string>("a.ply", "a.obj", "a.vtk");
  save_triangle_mesh(mesh, path);
  const TriangleMesh read = load_triangle_mesh(path);
  RC_ASSERT(read.vertices == mesh.vertices);
  RC_ASSERT(read.triangles == mesh.triangles);
}

RC_GTEST_PROP(RoundTrips, TetrahedraAreExact, ()) {
  const TemporaryFolder folder;
  TetMesh mesh = tet_box({draw_log(0.01, 10), draw_log(0.01, 10), draw_log(0.01, 10)},
                         {1 + draw_below(3), 1 + draw_below(3), 1 + draw_below(3)});
  mesh.vertices *= draw(0.5, 2);
  const std::string path = folder / *rc::gen::element<std::string>("a.vtk", "a.tet");
  save_tet_mesh(mesh, path);
  const TetMesh read = load_tet_mesh(path);
  RC_ASSERT(read.vertices == mesh.vertices);
  RC_ASSERT(read.tetrahedra == mesh.tetrahedra);
}

RC_GTEST_PROP(RoundTrips, CloudsAreExactInSinglePrecision, ()) {
  const TemporaryFolder folder;
  const Points points = draw_points(draw_below(50));
  const std::string path = folder / *rc::gen::element<std::string>("a.ply", "a.pcd");
  save_point_cloud(points, path);
  RC_ASSERT(load_point_cloud(path) == points.cast<float>().cast<double>());
}

RC_GTEST_PROP(RoundTrips, TrajectoriesKeepTimesAndPoses, ()) {
  const TemporaryFolder folder;
  const Trajectory trajectory = draw_trajectory(draw_chance(0.5) ? 0 : draw(0, 2e9));
  save_tum(trajectory, folder / "a.tum");
  const Trajectory read = load_trajectory(folder / "a.tum");
  RC_ASSERT(read.times == trajectory.times);
  for (std::size_t k = 0; k < read.poses.size(); ++k) expect_same(read.poses[k], trajectory.poses[k]);
}

RC_GTEST_PROP(RoundTrips, AssetsKeepTheirMaterial, ()) {
  const TemporaryFolder folder;
  const SheetMaterial material = draw_material();
  std::optional<double> thickness;
  if (draw_chance(0.5)) thickness = draw_log(1e-4, 1e-2);
  save_asset(asset_from_sheet(material, thickness, "sheet:0.4x0.4:0.1"), folder / "a.json");
  const Asset asset = load_asset(folder / "a.json");
  const SheetMaterial read = resolve_sheet(asset, 0.16).material;
  // E t passes through E where there is a thickness: two roundings.
  RC_ASSERT(std::abs(read.membrane_stiffness - material.membrane_stiffness) <=
            1e-15 * material.membrane_stiffness);
  SheetMaterial rounded = material;
  rounded.membrane_stiffness = read.membrane_stiffness;
  RC_ASSERT(read == rounded);
  save_asset(asset, folder / "b.json");
  RC_ASSERT(read_file(folder / "b.json") == read_file(folder / "a.json"));
}

/// A recording with its files: a sheet somewhere, a gripper at its far corner, keyframes with clouds and
/// forces.
Recording draw_recording(const TemporaryFolder& folder, double clock) {
  Recording recording;
  recording.name = "drawn";
  recording.kind = *rc::gen::element<std::string>("free", "corner_lift", "drag");
  recording.gravity = 9.81 * draw_direction();
  recording.mesh_spec = "sheet:0.2x0.2:0.05";
  recording.base_from_object = draw_pose(1);
  recording.has_table = draw_chance(0.5);
  recording.table_point = draw(0, 1) * draw_direction();
  recording.table_normal = draw_direction();
  if (recording.gravity.dot(recording.table_normal) > 0) recording.gravity *= -1;  // into the table
  Trajectory gripper = draw_trajectory(clock);
  gripper.poses.front().translation() = recording.base_from_object * Eigen::Vector3d(0.2, 0.2, 0);
  recording.trajectory_paths["gripper"] = folder / "gripper.tum";
  save_tum(gripper, recording.trajectory_paths["gripper"]);
  RecordedGrasp grasp;
  grasp.gripper = "gripper";
  grasp.from = clock;
  grasp.select.corner = {1, 1};
  grasp.select.within = draw(0.06, 0.1);
  grasp.shape = *rc::gen::element(GraspShape::clamp, GraspShape::point, GraspShape::pinch);
  if (grasp.shape == GraspShape::pinch) {
    grasp.depth = draw_log(1e-3, 1e-1);
    grasp.pitch = draw(-1, 1);
  }
  recording.grasps.push_back(grasp);
  if (draw_chance(0.5)) recording.crop.min.z() = draw(-1, 0);
  if (draw_chance(0.5)) recording.crop.max.x() = draw(1, 2);
  const int keyframes = 1 + draw_below(4);
  for (int k = 0; k < keyframes; ++k) {
    RecordedKeyframe keyframe;
    keyframe.time = clock + 0.125 * k + draw(0, 0.1);
    keyframe.cloud = folder / ("cloud" + std::to_string(k) + ".ply");
    save_point_cloud(draw_noise(5, 0.2), keyframe.cloud);
    if (draw_chance(0.5)) keyframe.force = draw(0, 2) * draw_direction();
    recording.keyframes.push_back(keyframe);
  }
  recording.nuisance.offset.setConstant(draw(0, 0.1));
  recording.nuisance.time = draw(3, 5);  // keyframes may lie beyond the trajectory by so much
  return recording;
}

// All times count from the first grasp, to the microsecond.
RC_GTEST_PROP(RoundTrips, RecordingsKeepWhatTheySay, ()) {
  const TemporaryFolder folder;
  const double clock = draw_chance(0.5) ? 0 : draw(0, 2e9);
  const Recording recording = draw_recording(folder, clock);
  save_recording(recording, folder / "recording.json");
  const Recording read = load_recording(folder / "recording.json");
  RC_ASSERT(read.name == recording.name);
  RC_ASSERT(read.kind == recording.kind);
  RC_ASSERT(read.gravity == recording.gravity);
  RC_ASSERT(read.mesh_spec == recording.mesh_spec);
  expect_same(read.base_from_object, recording.base_from_object);
  RC_ASSERT(read.has_table == recording.has_table);
  if (read.has_table) {
    RC_ASSERT(read.table_point == recording.table_point);
    RC_ASSERT((read.table_normal - recording.table_normal).norm() < 1e-15);  // made unit again
  }
  RC_ASSERT(read.trajectory_paths == recording.trajectory_paths);
  RC_ASSERT(read.crop.min == recording.crop.min);
  RC_ASSERT(read.crop.max == recording.crop.max);
  RC_ASSERT(read.origin == clock);
  RC_ASSERT(read.grasps.size() == 1u);
  const RecordedGrasp &grasp = read.grasps[0], &written = recording.grasps[0];
  RC_ASSERT(grasp.from == 0);
  RC_ASSERT(std::isinf(grasp.to));
  RC_ASSERT(grasp.select.corner == written.select.corner);
  RC_ASSERT(grasp.select.within == written.select.within);
  RC_ASSERT(grasp.shape == written.shape);
  RC_ASSERT(grasp.depth == written.depth);
  RC_ASSERT(grasp.pitch == written.pitch);
  RC_ASSERT(read.nuisance.offset == recording.nuisance.offset);
  RC_ASSERT(read.nuisance.time == recording.nuisance.time);
  RC_ASSERT(read.keyframes.size() == recording.keyframes.size());
  for (std::size_t k = 0; k < read.keyframes.size(); ++k) {
    RC_ASSERT(std::abs(clock + read.keyframes[k].time - recording.keyframes[k].time) <= 1e-6);
    RC_ASSERT(read.keyframes[k].cloud == recording.keyframes[k].cloud);
    RC_ASSERT(read.keyframes[k].force == recording.keyframes[k].force);
  }
}

// What is read and written again is the same file, but for the last digits of what is made unit again.
RC_GTEST_PROP(RoundTrips, RecordingsSettle, ()) {
  const TemporaryFolder folder;
  save_recording(draw_recording(folder, draw_chance(0.5) ? 0 : draw(0, 2e9)), folder / "a.json");
  const Recording once = load_recording(folder / "a.json");
  save_recording(once, folder / "b.json");
  const Recording twice = load_recording(folder / "b.json");
  RC_ASSERT(twice.origin == once.origin);
  for (std::size_t k = 0; k < once.keyframes.size(); ++k)
    RC_ASSERT(twice.keyframes[k].time == once.keyframes[k].time);
  expect_same(twice.base_from_object, once.base_from_object);
}

}  // namespace
}  // namespace flash::data
