#include "python/calib/bindings/files.h"

#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <string>
#include <vector>

#include "calib/calibrate/extrinsics.h"
#include "calib/dataset/lens_file.h"
#include "calib/dataset/target.h"
#include "data/camera/intrinsics_file.h"
#include "data/files/atomic_file.h"
#include "python/bindings/arrays.h"
#include "python/calib/bindings/camera.h"

namespace flash::python {

namespace nb = nanobind;

namespace {

nb::dict load(const std::string& path, bool despite_doubts) {
  const calib::Extrinsics extrinsics = calib::load_extrinsics(path, despite_doubts);
  nb::dict found;
  found["text"] = data::read_file(path);
  found["T"] = array_of(extrinsics.transform.T.matrix());
  found["target_pose"] = array_of(extrinsics.target_pose.T.matrix());
  found["covariance"] = array_of(extrinsics.covariance);
  return found;
}

/// Numbers as camera_of() takes them, and the covariance; None where the file states none.
nb::tuple load_camera(const std::string& path) {
  const data::CameraIntrinsics camera = data::load_intrinsics(path);
  const std::optional<calib::LensCovariance> covariance = calib::load_lens_covariance(path);
  return nb::make_tuple(numbers_of(camera), covariance ? nb::cast(array_of(*covariance)) : nb::none());
}

}  // namespace

void bind_files(nb::module_& module) {
  module.def("load", &load);
  module.def("load_camera", &load_camera);
  module.def("target_points", [](const std::string& words) {
    return array_of(calib::target_points(calib::parse_target(words)).transpose());
  });
}

}  // namespace flash::python
