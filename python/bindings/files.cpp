#include "python/bindings/files.h"

#include <nanobind/stl/array.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>

#include <array>
#include <utility>

#include "data/camera/extrinsics.h"
#include "data/camera/intrinsics_file.h"
#include "data/mesh/mesh_io.h"
#include "data/motion/trajectory.h"
#include "python/bindings/arrays.h"

namespace flash::python {

namespace nb = nanobind;

namespace {

nb::tuple load_mesh(const std::string& path) {
  const data::TriangleMesh mesh = data::load_triangle_mesh(path);
  return nb::make_tuple(array_of(mesh.vertices), array_of(mesh.triangles));
}

/// Rows of t x y z qx qy qz qw.
auto load_trajectory(const std::string& path) {
  const data::Trajectory trajectory = data::load_trajectory(path);
  Eigen::Matrix<double, Eigen::Dynamic, 8> rows(std::ssize(trajectory.times), 8);
  for (Eigen::Index k = 0; k < rows.rows(); ++k) {
    const auto index = static_cast<std::size_t>(k);
    rows.row(k) << trajectory.times[index], data::to_vector(trajectory.poses[index]).transpose();
  }
  return array_of(rows);
}

/// Of the camera in the base frame: x y z qx qy qz qw.
auto load_camera_pose(const std::string& path) {
  const data::CameraPose camera = data::load_camera_pose(path, true);
  return array_of(data::to_vector(camera.transform.T).transpose().eval());
}

/// Width and height [px]; fx, fy, cx, cy [px].
std::pair<std::array<int, 2>, std::array<double, 4>> load_lens(const std::string& path) {
  const data::CameraIntrinsics lens = data::load_intrinsics(path);
  return {{lens.width, lens.height}, {lens.fx, lens.fy, lens.cx, lens.cy}};
}

}  // namespace

void bind_files(nb::module_& module) {
  module.def("load_cloud", [](const std::string& path) { return array_of(data::load_point_cloud(path)); });
  module.def("load_mesh", &load_mesh);
  module.def("load_trajectory", &load_trajectory);
  module.def("load_camera_pose", &load_camera_pose);
  module.def("load_lens", &load_lens);
}

}  // namespace flash::python
