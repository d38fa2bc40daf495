#include "calib/dataset/lens_file.h"

#include <Eigen/Eigenvalues>
#include <cmath>

#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/text.h"
#include "data/files/yaml_file.h"

namespace flash::calib {

namespace {

constexpr const char* kField = "intrinsics_covariance";

}  // namespace

void save_lens(const data::CameraIntrinsics& camera, const LensCovariance& covariance,
               const std::string& path) {
  data::save_camera_info(camera, path);
  const auto unknowns = 4 + static_cast<Eigen::Index>(camera.distortion.size());
  const std::string size = std::to_string(unknowns);
  std::string text = std::string(kField) + ":\n  rows: " + size + "\n  cols: " + size + "\n  data: [";
  for (Eigen::Index i = 0; i < unknowns; ++i)
    for (Eigen::Index j = 0; j < unknowns; ++j)
      text += (i + j > 0 ? ", " : "") + data::format_number(covariance(i, j));
  data::write_atomically(path, data::read_file(path) + text + "]\n");
}

std::optional<LensCovariance> load_lens_covariance(const std::string& path) {
  if (data::lower_extension(path) == ".npz") return std::nullopt;
  const YAML::Node file = data::load_yaml(path);
  if (!file.IsMap() || !file[kField]) return std::nullopt;
  const YAML::Node node = file[kField];
  const std::vector<double> values =
      node.IsMap() && node["data"] ? data::yaml_numbers(node["data"], path, kField) : std::vector<double>();
  const auto size = static_cast<Eigen::Index>(std::lround(std::sqrt(static_cast<double>(values.size()))));
  if (size < 4 || size > kIntrinsics || size * size != static_cast<Eigen::Index>(values.size()))
    throw data::input_error(path, kField, "expected {rows, cols, data: [...]}, square, 4 to 12 rows");
  const Eigen::Map<const Eigen::MatrixXd> stated(values.data(), size, size);
  const Eigen::VectorXd sd = stated.diagonal().cwiseMax(0).cwiseSqrt();
  const Eigen::VectorXd inverse = sd.unaryExpr([](double s) { return s > 0 ? 1 / s : 0.0; });
  Eigen::MatrixXd correlation = inverse.asDiagonal() * stated * inverse.asDiagonal();
  correlation.diagonal().setOnes();
  const bool symmetric = (correlation - correlation.transpose()).norm() < 1e-6;
  if (stated.diagonal().minCoeff() < 0 || !symmetric ||
      !(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(correlation).eigenvalues().minCoeff() > 1e-12))
    throw data::input_error(path, kField, "expected a covariance: symmetric and positive definite");
  LensCovariance covariance = LensCovariance::Zero();
  covariance.topLeftCorner(size, size) = 0.5 * (stated + stated.transpose());
  return covariance;
}

}  // namespace flash::calib
