#include "data/camera/camchain.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "data/files/error.h"
#include "data/files/text.h"
#include "data/files/yaml_file.h"

namespace flash::data {
namespace {

std::vector<double> numbers(const YAML::Node& camera, const char* name, std::size_t count,
                            const std::string& path) {
  const YAML::Node list = camera[name];
  std::vector<double> values;
  if (list && list.IsSequence())
    for (const YAML::Node& item : list) {
      const std::optional<double> value = item.IsScalar() ? parse_number(item.Scalar()) : std::nullopt;
      if (value && std::isfinite(*value)) values.push_back(*value);
    }
  if (values.size() != count)
    throw input_error(path, std::string("cam0.") + name, "expected " + std::to_string(count) + " numbers");
  return values;
}

}  // namespace

CameraIntrinsics load_camchain(const std::string& path) {
  const YAML::Node file = load_yaml(path);
  const YAML::Node node = file.IsMap() ? file["cam0"] : YAML::Node();
  if (!node || !node.IsMap()) throw input_error(path, "cam0", "missing, expected Kalibr's camchain");
  const auto word = [&](const char* name) {
    return node[name] && node[name].IsScalar() ? node[name].Scalar() : std::string();
  };
  if (word("camera_model") != "pinhole")
    throw input_error(path, "cam0.camera_model", "found \"" + word("camera_model") + "\", expected pinhole");
  CameraIntrinsics camera;
  const std::vector<double> k = numbers(node, "intrinsics", 4, path),
                            size = numbers(node, "resolution", 2, path);
  camera.fx = k[0];
  camera.fy = k[1];
  camera.cx = k[2];
  camera.cy = k[3];
  camera.width = static_cast<int>(size[0]);
  camera.height = static_cast<int>(size[1]);
  if (!(camera.fx > 0 && camera.fy > 0 && camera.width > 0 && camera.height > 0))
    throw input_error(path, "cam0.intrinsics", "expected focal lengths and a resolution above 0");
  constexpr double kMostPixels = 1e6;
  for (const double value : k)
    if (!(std::abs(value) <= kMostPixels))
      throw input_error(
          path, "cam0.intrinsics",
          "found " + format_short(value) + ", expected pixels, at most " + format_short(kMostPixels));
  const std::string model = word("distortion_model");
  if (model == "none" || model.empty()) return camera;
  if (model != "radtan")
    throw input_error(path, "cam0.distortion_model", "found \"" + model + "\", expected radtan or none");
  camera.distortion = numbers(node, "distortion_coeffs", 4, path);
  camera.distortion.push_back(0);
  const bool straight =
      std::all_of(camera.distortion.begin(), camera.distortion.end(), [](double c) { return c == 0; });
  if (straight)
    camera.distortion.clear();
  else
    camera.model = DistortionModel::plumb_bob;
  return camera;
}

}  // namespace flash::data
