#include "python/bindings/recording.h"

#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <cmath>
#include <cstddef>

#include "data/motion/trajectory.h"
#include "data/recording/recording_digest.h"
#include "python/bindings/arrays.h"

namespace flash::python {

namespace nb = nanobind;

namespace {

nb::object vector_of(const Eigen::Vector3d& vector) {
  return nb::cast(array_of(std::vector<double>(vector.data(), vector.data() + 3), {3}));
}

nb::tuple trajectory_of(const data::Trajectory& trajectory) {
  std::vector<double> poses;
  for (const Eigen::Isometry3d& pose : trajectory.poses) {
    const Eigen::Matrix<double, 7, 1> numbers = data::to_vector(pose);
    poses.insert(poses.end(), numbers.data(), numbers.data() + 7);
  }
  const std::size_t count = trajectory.times.size();
  return nb::make_tuple(array_of(trajectory.times, {count}), array_of(std::move(poses), {count, 7}));
}

nb::dict grasp_of(const data::Recording& recording, const data::RecordedGrasp& grasp) {
  nb::dict fields;
  fields["gripper"] = grasp.gripper;
  fields["from"] = grasp.from;
  fields["to"] = grasp.to;
  fields["shape"] = std::string(data::to_string(grasp.shape));
  const std::vector<int> vertices = data::select_vertices(recording, grasp);
  fields["vertices"] = array_of(vertices, {vertices.size()});
  return fields;
}

nb::dict support_of(const data::Recording& recording, const data::RecordedSupport& support) {
  nb::dict fields;
  fields["name"] = support.name;
  fields["from"] = support.from;
  fields["to"] = support.to;
  const std::vector<int> vertices = data::select_vertices(recording, support.select, "supports.select");
  fields["vertices"] = array_of(vertices, {vertices.size()});
  return fields;
}

nb::dict load_of(const data::Recording& recording, const data::RecordedLoad& load) {
  nb::dict fields;
  fields["attached_mass"] = load.attached_mass;
  const std::vector<int> vertices = data::select_vertices(recording, load.select, "loads.select");
  fields["vertices"] = array_of(vertices, {vertices.size()});
  return fields;
}

/// One of each keyframe, in order.
template <class Take>
nb::list of_keyframes(const LoadedRecording& loaded, const Take& take) {
  nb::list all;
  for (const data::Keyframe& keyframe : loaded.keyframes) all.append(take(keyframe));
  return all;
}

void add_keyframes(const LoadedRecording& loaded, nb::dict& fields) {
  const std::size_t count = loaded.keyframes.size();
  std::vector<double> times, forces;
  for (const data::Keyframe& keyframe : loaded.keyframes) {
    times.push_back(keyframe.time);
    const Eigen::Vector3d force = keyframe.force.value_or(Eigen::Vector3d::Constant(std::nan("")));
    forces.insert(forces.end(), force.data(), force.data() + 3);
  }
  fields["times"] = array_of(std::move(times), {count});
  fields["forces"] = array_of(std::move(forces), {count, 3});
  fields["clouds"] = of_keyframes(loaded, [](const data::Keyframe& k) { return array_of(k.cloud); });
  fields["contours"] = of_keyframes(loaded, [](const data::Keyframe& k) { return array_of(k.contour); });
  fields["markers"] = of_keyframes(loaded, [](const data::Keyframe& k) { return array_of(k.markers); });
  fields["marker_places"] =
      of_keyframes(loaded, [](const data::Keyframe& k) { return array_of(k.marker_places); });
}

/// What flash_sim.sysid.Recording has, by its names.
nb::dict fields_of(const LoadedRecording& loaded) {
  const data::Recording& recording = loaded.recording;
  nb::dict fields;
  fields["source"] = recording.source;
  fields["name"] = recording.name;
  fields["kind"] = recording.kind;
  fields["sha256"] = data::recording_sha256(recording);
  fields["asset"] = recording.asset.empty() ? nb::none() : nb::cast(recording.asset);
  fields["mesh"] = recording.mesh_spec;
  fields["vertices"] = array_of(recording.mesh.vertices);
  fields["triangles"] = array_of(recording.mesh.triangles);
  fields["tetrahedra"] = array_of(recording.tetrahedra);
  fields["start"] = array_of(recording.start);
  fields["gravity"] = vector_of(recording.gravity);
  fields["table"] = nb::none();
  if (recording.has_table)
    fields["table"] = nb::make_tuple(vector_of(recording.table_point), vector_of(recording.table_normal));
  nb::dict grippers, bounds;
  for (const auto& [name, trajectory] : recording.trajectories)
    grippers[name.c_str()] = trajectory_of(trajectory);
  fields["grippers"] = grippers;
  nb::list grasps, supports, loads;
  for (const data::RecordedGrasp& grasp : recording.grasps) grasps.append(grasp_of(recording, grasp));
  for (const data::RecordedSupport& support : recording.supports)
    supports.append(support_of(recording, support));
  for (const data::RecordedLoad& load : recording.loads) loads.append(load_of(recording, load));
  fields["grasps"] = grasps;
  fields["supports"] = supports;
  fields["loads"] = loads;
  fields["crop"] = nb::make_tuple(vector_of(recording.crop.min), vector_of(recording.crop.max));
  const data::NuisanceBounds& nuisance = recording.nuisance;
  bounds["offset"] = vector_of(nuisance.offset);
  bounds["yaw"] = nuisance.yaw;
  bounds["time"] = nuisance.time;
  bounds["table_height"] = nuisance.table_height;
  bounds["start_yaw"] = nuisance.start_yaw;
  fields["bounds"] = bounds;
  std::vector<std::string> warnings = recording.doubts;
  if (recording.camera)
    for (const std::string& warning : recording.camera->warnings)
      warnings.push_back("calibration of its camera: " + warning);
  fields["warnings"] = warnings;
  fields["notices"] = recording.notices;
  add_keyframes(loaded, fields);
  return fields;
}

}  // namespace

void bind_recording(nb::module_& module) {
  nb::class_<LoadedRecording>(module, "LoadedRecording").def("fields", &fields_of);
  module.def("load_recording", [](const std::string& path) {
    const nb::gil_scoped_release release;
    LoadedRecording loaded{data::load_recording(path), {}};
    loaded.keyframes = data::load_keyframes(loaded.recording, loaded.recording.notices);
    return loaded;
  });
}

}  // namespace flash::python
