#include "data/camera/intrinsics_file.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <map>
#include <optional>
#include <utility>

#include "data/camera/camchain.h"
#include "data/files/error.h"
#include "data/files/npz.h"
#include "data/files/text.h"
#include "data/files/yaml_file.h"

namespace flash::data {
namespace {

using Names = std::initializer_list<const char*>;
/// As plain() writes them, the likeliest first.
constexpr Names kMatrix = {"cameramatrix",     "k",         "mtx",        "matrix", "intrinsicmatrix",
                           "intrinsicsmatrix", "intrinsic", "intrinsics", "camera"};
constexpr Names kDistortion = {"distortioncoefficients",
                               "distcoeffs",
                               "distcoeff",
                               "distortioncoeffs",
                               "distortion",
                               "dist",
                               "d",
                               "coeffs",
                               "coefficients"};

/// A name without capitals and what parts its words: "Camera_Matrix" and "cameraMatrix" are one.
std::string plain(const std::string& name) {
  std::string text;
  for (const char c : name)
    if (std::isalnum(static_cast<unsigned char>(c)))
      text += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

/// Numbers and words by name, whatever file they come from; none where a name is missing or holds other
/// things.
class NamedValues {
 public:
  explicit NamedValues(const std::string& path) : path_(path) {
    if (lower_extension(path) == ".npz")
      for (const auto& [name, array] : load_npz(path)) {
        numbers_.emplace(plain(name), array.values);
        const bool has_elements = std::count(array.shape.begin(), array.shape.end(), 0U) == 0;
        if (array.values.empty() && has_elements)
          without_numbers_.emplace(plain(name), std::pair(name, array));
      }
    else
      add(load_yaml(path));  // JSON is YAML
  }

  std::vector<double> first(Names names) const {
    for (const char* name : names)
      if (const auto found = numbers_.find(name); found != numbers_.end() && !found->second.empty()) {
        return found->second;
      } else if (const auto other = without_numbers_.find(name); other != without_numbers_.end()) {
        expect_numbers(other->second.second, path_, other->second.first);
      }
    return {};
  }

  std::optional<double> number(Names names) const {
    const std::vector<double> found = first(names);
    return found.size() == 1 ? std::optional(found.front()) : std::nullopt;
  }

  std::string word(Names names) const {
    for (const char* name : names)
      if (const auto found = words_.find(name); found != words_.end()) return found->second;
    return {};
  }

 private:
  /// Also of what stands one level deeper, as in {"intrinsics": {"fx": ...}}; there by both names together,
  /// too, as in {"distortion": {"coefficients": ...}}.
  void add(const YAML::Node& node, const std::string& above = "", int depth = 0) {
    if (!node.IsMap())
      throw InputError(path_ + (node.IsNull() ? ": is empty" : ": holds no names") +
                       ", expected names and numbers, as camera_matrix: {data: [...]}");
    for (const auto& entry : node) {
      const YAML::Node value = entry.second;
      const std::string name = plain(entry.first.Scalar());
      if (value.IsMap() && !value["data"]) {
        if (depth < 2) add(value, name, depth + 1);
        continue;
      }
      try {
        const std::vector<double> numbers =
            yaml_numbers(value.IsMap() ? value["data"] : value, path_, entry.first.Scalar());
        numbers_.emplace(name, numbers);
        numbers_.emplace(above + name, numbers);
      } catch (const InputError&) {
        if (!value.IsScalar()) continue;
        words_.emplace(name, value.Scalar());
        words_.emplace(above + name, value.Scalar());
      }
    }
  }

  std::string path_;
  std::map<std::string, std::vector<double>> numbers_;
  std::map<std::string, std::string> words_;
  std::map<std::string, std::pair<std::string, NumpyArray>> without_numbers_;  // with their own names
};

/// Those of a lens that OpenCV's formula describes; empty where the file names none. Throws InputError of
/// another formula.
std::vector<double> distortion_of(const NamedValues& file, const std::string& path) {
  const std::string model = file.word({"distortionmodel", "distortiontype", "distortion"});
  const Names known = {"plumbbob", "radtan",   "radialtangential",   "brown", "brownconrady", "opencv",
                       "pinhole",  "rational", "rationalpolynomial", "none",  "null",         ""};
  if (std::find(known.begin(), known.end(), plain(model)) == known.end())
    throw input_error(path, "distortion",
                      "found the model \"" + model + "\", expected plumb_bob, rational_polynomial or none");
  std::vector<double> distortion = file.first(kDistortion);
  if (distortion.empty())
    for (const char* name : {"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"})
      distortion.push_back(file.number({name}).value_or(0));
  while (!distortion.empty() && distortion.back() == 0) distortion.pop_back();
  return distortion;
}

CameraIntrinsics load_named(const std::string& path) {
  const NamedValues file(path);
  CameraIntrinsics camera;
  camera.width = static_cast<int>(file.number({"imagewidth", "width"}).value_or(0));
  camera.height = static_cast<int>(file.number({"imageheight", "height"}).value_or(0));
  const std::vector<double> k = file.first(kMatrix);
  if (k.size() == 9) {
    if (k[1] != 0 || k[3] != 0 || k[6] != 0 || k[7] != 0 || k[8] != 1)
      throw input_error(path, "camera matrix", "expected 3 x 3: fx 0 cx, 0 fy cy, 0 0 1");
    camera.fx = k[0];
    camera.fy = k[4];
    camera.cx = k[2];
    camera.cy = k[5];
  } else {
    const std::optional<double> fx = file.number({"fx"}), fy = file.number({"fy"}),
                                cx = file.number({"cx", "ppx"}), cy = file.number({"cy", "ppy"});
    if (!fx || !fy || !cx || !cy)
      throw input_error(path, "camera_matrix",
                        "missing, expected a 3 x 3 matrix (or camera_matrix, K, mtx) or fx, fy, cx, cy");
    camera.fx = *fx;
    camera.fy = *fy;
    camera.cx = *cx;
    camera.cy = *cy;
  }
  constexpr double kMostPixels = 1e6;
  for (const double value : {camera.fx, camera.fy, camera.cx, camera.cy})
    if (!(std::abs(value) <= kMostPixels))
      throw input_error(
          path, "camera_matrix",
          "found " + format_short(value) + ", expected pixels, at most " + format_short(kMostPixels));
  for (const double focal : {camera.fx, camera.fy})
    if (!(focal > 0))
      throw input_error(path, "camera matrix",
                        "found a focal length of " + format_short(focal) + ", expected one above 0");
  const std::vector<double> distortion = distortion_of(file, path);
  if (distortion.size() > 8)
    throw input_error(path, "distortion",
                      "found " + std::to_string(distortion.size()) + " coefficients, expected at most 8");
  if (distortion.empty()) return camera;
  const bool rational = distortion.size() > 5;
  camera.model = rational ? DistortionModel::rational_polynomial : DistortionModel::plumb_bob;
  camera.distortion = distortion;
  camera.distortion.resize(rational ? 8 : 5, 0.0);
  return camera;
}

/// As ROS and OpenCV write it.
bool names_size(const std::string& path) {
  const YAML::Node file = load_yaml(path);
  return file.IsMap() && file["image_width"] && file["image_height"] &&
         (file["distortion_coefficients"] || file["distCoeffs"] || file["D"]);
}

}  // namespace

CameraIntrinsics load_intrinsics(const std::string& path) {
  if (std::filesystem::path(path).filename().string().find("camchain") != std::string::npos)
    return load_camchain(path);
  const std::string extension = lower_extension(path);
  const bool yaml = extension == ".yaml" || extension == ".yml";
  return yaml && names_size(path) ? load_camera_intrinsics(path) : load_named(path);
}

}  // namespace flash::data
