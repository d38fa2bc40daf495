#include "python/calib/bindings/camera.h"

namespace flash::python {

data::CameraIntrinsics camera_of(const Numbers& numbers) {
  const double* const v = numbers.data();
  data::CameraIntrinsics camera{.width = static_cast<int>(v[0]),
                                .height = static_cast<int>(v[1]),
                                .fx = v[2],
                                .fy = v[3],
                                .cx = v[4],
                                .cy = v[5],
                                .distortion = {v + 6, v + numbers.size()}};
  if (camera.distortion.size() == 4) camera.distortion.push_back(0);
  camera.model = camera.distortion.empty()       ? data::DistortionModel::none
                 : camera.distortion.size() == 5 ? data::DistortionModel::plumb_bob
                                                 : data::DistortionModel::rational_polynomial;
  return camera;
}

std::vector<double> numbers_of(const data::CameraIntrinsics& camera) {
  std::vector<double> numbers = {static_cast<double>(camera.width),
                                 static_cast<double>(camera.height),
                                 camera.fx,
                                 camera.fy,
                                 camera.cx,
                                 camera.cy};
  numbers.insert(numbers.end(), camera.distortion.begin(), camera.distortion.end());
  return numbers;
}

calib::LensCovariance lens_covariance_of(const Numbers& rows) {
  calib::LensCovariance covariance = calib::LensCovariance::Zero();
  const auto size = static_cast<Eigen::Index>(rows.shape(0));
  for (Eigen::Index i = 0; i < size; ++i)
    for (Eigen::Index j = 0; j < size; ++j) covariance(i, j) = rows.data()[i * size + j];
  return covariance;
}

}  // namespace flash::python
