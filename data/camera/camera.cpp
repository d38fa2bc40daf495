#include "data/camera/camera.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

#include "data/camera/camera_info.h"
#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/text.h"
#include "data/files/yaml_file.h"

namespace flash::data {
namespace {

constexpr double kMostPixels = 1e6;  // a tele lens of 0.1 deg, or a centre far beside the picture

/// The first of the names that the file has.
std::pair<std::string, YAML::Node> find(const YAML::Node& file, std::initializer_list<const char*> names) {
  for (const char* name : names)
    if (file[name]) return {name, file[name]};
  return {*names.begin(), YAML::Node(YAML::NodeType::Undefined)};
}

std::vector<double> numbers(const YAML::Node& node, const std::string& path, const std::string& field) {
  // ROS and OpenCV: {rows, cols, data: [...]}; written by hand: the list itself.
  const YAML::Node list = node.IsDefined() && node.IsMap() ? node["data"] : node;
  if (!list.IsDefined() || !list.IsSequence())
    throw input_error(path, field, "missing, expected {rows, cols, data: [...]}");
  std::vector<double> values;
  for (const YAML::Node& item : list) {
    const std::optional<double> value = item.IsScalar() ? parse_number(item.Scalar()) : std::nullopt;
    if (!value || !std::isfinite(*value))
      throw input_error(path, field, "expected finite numbers in its data");
    values.push_back(*value);
  }
  return values;
}

/// rows and cols, where they are said, against the numbers that are there.
void expect_counts(const YAML::Node& node, std::size_t numbers, const std::string& path,
                   const std::string& field) {
  if (!node.IsMap() || !node["rows"] || !node["cols"]) return;
  const std::optional<long> rows =
                                node["rows"].IsScalar() ? parse_integer(node["rows"].Scalar()) : std::nullopt,
                            columns =
                                node["cols"].IsScalar() ? parse_integer(node["cols"].Scalar()) : std::nullopt;
  if (rows && columns && *rows > 0 && *columns > 0 &&
      static_cast<std::size_t>(*rows) * static_cast<std::size_t>(*columns) == numbers)
    return;
  throw input_error(path, field,
                    "found " + std::to_string(numbers) + " numbers, expected as many as rows times cols");
}

int pixels(const YAML::Node& file, const char* name, const std::string& path) {
  const YAML::Node node = file[name];
  const std::optional<long> value = node && node.IsScalar() ? parse_integer(node.Scalar()) : std::nullopt;
  if (!value || *value <= 0 || *value > 100000)
    throw input_error(path, name,
                      (node && node.IsScalar() ? "found \"" + node.Scalar() + "\"" : "missing") +
                          ", expected a number of pixels");
  return static_cast<int>(*value);
}

std::array<double, 8> coefficients(const CameraIntrinsics& camera) {
  std::array<double, 8> k{};
  if (camera.model != DistortionModel::none)
    std::copy_n(camera.distortion.begin(), std::min<std::size_t>(8, camera.distortion.size()), k.begin());
  return k;
}

/// Normalised image coordinates with lens distortion: k1 k2 p1 p2 k3 k4 k5 k6.
Eigen::Vector2d distort(const std::array<double, 8>& k, const Eigen::Vector2d& p) {
  const double x = p.x(), y = p.y(), r2 = p.squaredNorm();
  const double radial =
      (1 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]))) / (1 + r2 * (k[5] + r2 * (k[6] + r2 * k[7])));
  return {x * radial + 2 * k[2] * x * y + k[3] * (r2 + 2 * x * x),
          y * radial + k[2] * (r2 + 2 * y * y) + 2 * k[3] * x * y};
}

}  // namespace

CameraIntrinsics load_camera_intrinsics(const std::string& path) {
  const YAML::Node file = load_yaml(path);
  if (!file.IsMap())
    throw InputError(path + (file.IsNull() ? ": is empty" : ": holds no names") +
                     ", expected camera_info fields (image_width, camera_matrix, ...)");
  CameraIntrinsics camera;
  camera.width = pixels(file, "image_width", path);
  camera.height = pixels(file, "image_height", path);

  const auto [matrix_name, matrix] = find(file, {"camera_matrix", "cameraMatrix", "K"});
  const std::vector<double> k = numbers(matrix, path, matrix_name);
  if (k.size() != 9 || k[8] != 1 || k[3] != 0 || k[6] != 0 || k[7] != 0)
    throw input_error(path, matrix_name, "expected 3 x 3: fx 0 cx, 0 fy cy, 0 0 1");
  expect_counts(matrix, k.size(), path, matrix_name);
  for (const double focal : {k[0], k[4]})
    if (!(focal > 0))
      throw input_error(path, matrix_name,
                        "found a focal length of " + format_short(focal) + ", expected one above 0");
  if (k[1] != 0) throw input_error(path, matrix_name, "found skew " + format_short(k[1]) + ", expected 0");
  for (const double value : k)
    if (!(std::abs(value) <= kMostPixels))
      throw input_error(
          path, matrix_name,
          "found " + format_short(value) + ", expected pixels, at most " + format_short(kMostPixels));
  camera.fx = k[0];
  camera.cx = k[2];
  camera.fy = k[4];
  camera.cy = k[5];

  const auto [distortion_name, distortion] = find(file, {"distortion_coefficients", "distCoeffs", "D"});
  if (distortion.IsDefined()) camera.distortion = numbers(distortion, path, distortion_name);
  const YAML::Node model = file["distortion_model"];
  const std::string name = model && model.IsScalar()      ? model.Scalar()
                           : camera.distortion.size() > 5 ? "rational_polynomial"
                                                          : "plumb_bob";
  if (name != "plumb_bob" && name != "rational_polynomial" && name != "none" && !name.empty())
    throw input_error(path, "distortion_model",
                      "found \"" + name + "\", expected plumb_bob, rational_polynomial or none");
  // OpenCV also writes thin prism and tilt, 12 or 14 in all, which are zero unless asked for.
  const std::size_t used = name == "rational_polynomial" ? 8 : name == "plumb_bob" ? 5 : 0;
  for (std::size_t i = used; i < camera.distortion.size(); ++i)
    if (camera.distortion[i] != 0)
      throw input_error(path, distortion_name,
                        "found " + std::to_string(camera.distortion.size()) +
                            " coefficients, expected at most " + std::to_string(used));
  camera.distortion.resize(used, 0.0);
  const bool straight =
      std::all_of(camera.distortion.begin(), camera.distortion.end(), [](double c) { return c == 0; });
  camera.model = straight    ? DistortionModel::none
                 : used == 8 ? DistortionModel::rational_polynomial
                             : DistortionModel::plumb_bob;
  if (straight) camera.distortion.clear();
  return camera;
}

void save_camera_info(const CameraIntrinsics& camera, const std::string& path, const std::string& name) {
  write_atomically(path, camera_info_text(camera, name));
}

std::optional<Eigen::Vector2d> project(const CameraIntrinsics& camera, const Eigen::Vector3d& point) {
  if (!(point.z() > 0)) return std::nullopt;
  const Eigen::Vector2d p = distort(coefficients(camera), point.head<2>() / point.z());
  return Eigen::Vector2d(camera.fx * p.x() + camera.cx, camera.fy * p.y() + camera.cy);
}

Eigen::Vector3d unproject(const CameraIntrinsics& camera, const Eigen::Vector2d& pixel, double depth) {
  const Eigen::Vector2d seen((pixel.x() - camera.cx) / camera.fx, (pixel.y() - camera.cy) / camera.fy);
  Eigen::Vector2d p = seen;
  if (camera.model != DistortionModel::none) {
    const std::array<double, 8> k = coefficients(camera);
    for (int iteration = 0; iteration < 20; ++iteration) {
      const Eigen::Vector2d residual = distort(k, p) - seen;
      if (residual.norm() < 1e-14) break;
      constexpr double kStep = 1e-6;
      Eigen::Matrix2d jacobian;
      for (int axis = 0; axis < 2; ++axis) {
        const Eigen::Vector2d step = kStep * Eigen::Vector2d::Unit(axis);
        jacobian.col(axis) = (distort(k, p + step) - distort(k, p - step)) / (2 * kStep);
      }
      p -= jacobian.inverse() * residual;
    }
  }
  return {depth * p.x(), depth * p.y(), depth};
}

}  // namespace flash::data
