#include "calib/dataset/intrinsics_file.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>

#include "calib/dataset/kalibr.h"
#include "calib/dataset/npz.h"
#include "calib/dataset/yaml_file.h"
#include "data/error.h"
#include "data/text.h"

namespace flash::calib {
namespace {

using Names = std::initializer_list<const char*>;
constexpr Names kMatrix = {"camera_matrix", "cameraMatrix",     "K",      "mtx",
                           "matrix",        "intrinsic_matrix", "camera", "intrinsics"};
constexpr Names kDistortion = {"distortion_coefficients",
                               "distCoeffs",
                               "dist_coeffs",
                               "dist_coeff",
                               "distortion",
                               "dist",
                               "D",
                               "coeffs"};

/// Numbers by name, whatever file they come from; none where a name is missing or holds other things.
class NamedNumbers {
 public:
  explicit NamedNumbers(const std::string& path) : path_(path) {
    if (data::lower_extension(path) == ".npz")
      arrays_ = load_npz(path);
    else
      add(load_yaml(path));  // JSON is YAML
  }

  std::vector<double> first(Names names) const {
    for (const char* name : names)
      if (const auto found = arrays_.find(name); found != arrays_.end() && !found->second.empty())
        return found->second;
    return {};
  }

  std::optional<double> number(Names names) const {
    const std::vector<double> found = first(names);
    return found.size() == 1 ? std::optional(found.front()) : std::nullopt;
  }

 private:
  /// Also of what stands one level deeper, as in {"intrinsics": {"fx": ...}}.
  void add(const YAML::Node& node, int depth = 0) {
    if (!node.IsMap())
      throw data::InputError(path_ + (node.IsNull() ? ": is empty" : ": holds no names") +
                             ", expected names and numbers, as camera_matrix: {data: [...]}");
    for (const auto& entry : node) {
      const YAML::Node value = entry.second;
      if (value.IsMap() && !value["data"]) {
        if (depth < 2) add(value, depth + 1);
        continue;
      }
      try {
        const std::vector<double> numbers =
            yaml_numbers(value.IsMap() ? value["data"] : value, path_, entry.first.Scalar());
        arrays_.emplace(entry.first.Scalar(), numbers);
      } catch (const data::InputError&) {
        // words are of no account here
      }
    }
  }

  std::string path_;
  std::map<std::string, std::vector<double>> arrays_;
};

data::CameraIntrinsics load_named(const std::string& path) {
  const NamedNumbers file(path);
  data::CameraIntrinsics camera;
  camera.width = static_cast<int>(file.number({"image_width", "width"}).value_or(0));
  camera.height = static_cast<int>(file.number({"image_height", "height"}).value_or(0));
  const std::vector<double> k = file.first(kMatrix);
  if (k.size() == 9) {
    if (k[1] != 0 || k[3] != 0 || k[6] != 0 || k[7] != 0 || k[8] != 1)
      throw data::input_error(path, "camera matrix", "expected 3 x 3: fx 0 cx, 0 fy cy, 0 0 1");
    camera.fx = k[0];
    camera.fy = k[4];
    camera.cx = k[2];
    camera.cy = k[5];
  } else {
    const std::optional<double> fx = file.number({"fx"}), fy = file.number({"fy"}),
                                cx = file.number({"cx", "ppx"}), cy = file.number({"cy", "ppy"});
    if (!fx || !fy || !cx || !cy)
      throw data::input_error(
          path, "camera_matrix",
          "missing, expected a 3 x 3 matrix (or camera_matrix, K, mtx) or fx, fy, cx, cy");
    camera.fx = *fx;
    camera.fy = *fy;
    camera.cx = *cx;
    camera.cy = *cy;
  }
  if (!(camera.fx > 0) || !(camera.fy > 0))
    throw data::input_error(path, "camera matrix", "expected focal lengths above 0");
  std::vector<double> distortion = file.first(kDistortion);
  const auto last = std::find_if(distortion.rbegin(), distortion.rend(), [](double c) { return c != 0; });
  distortion.erase(last.base(), distortion.end());
  if (distortion.size() > 8)
    throw data::input_error(
        path, "distortion",
        "found " + std::to_string(distortion.size()) + " coefficients, expected at most 8");
  if (distortion.empty()) return camera;
  camera.model =
      distortion.size() > 5 ? data::DistortionModel::rational_polynomial : data::DistortionModel::plumb_bob;
  distortion.resize(distortion.size() > 5 ? 8 : 5, 0.0);
  camera.distortion = distortion;
  return camera;
}

bool names_size(const std::string& path) {
  const YAML::Node file = load_yaml(path);
  return file.IsMap() && file["image_width"] && file["image_height"];
}

}  // namespace

data::CameraIntrinsics load_intrinsics(const std::string& path) {
  if (std::filesystem::path(path).filename().string().find("camchain") != std::string::npos)
    return load_camchain(path);
  const std::string extension = data::lower_extension(path);
  const bool yaml = extension == ".yaml" || extension == ".yml";
  return yaml && names_size(path) ? data::load_camera_intrinsics(path) : load_named(path);
}

}  // namespace flash::calib
